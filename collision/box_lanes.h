// Tests of a box or a ray against the eight lanes of a node, and the walk down a tree that they
// steer. Compare and select only (rays: also + - x): the same bits at any lane width.
#pragma once

#include <bit>
#include <cmath>
#include <vector>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "collision/bounds.h"
#include "collision/box_node.h"

namespace skerry::collision {

// Bit per lane whose box meets `box`; touching counts, empty lanes never meet. SSE2 itself, not
// Highway: the walk needs it inlined, and Highway's own baseline on x86-64 without flags is scalar.
#if defined(__SSE2__)
inline unsigned overlap_lanes(const BoxNode& node, const Aabb& box) {
  unsigned lanes = 0;
  for (unsigned first = 0; first < BoxNode::kWidth; first += 4) {
    __m128 hit = _mm_cmple_ps(_mm_load_ps(node.min[0] + first), _mm_set1_ps(box.max[0]));
    hit = _mm_and_ps(hit, _mm_cmpge_ps(_mm_load_ps(node.max[0] + first), _mm_set1_ps(box.min[0])));
    for (int axis = 1; axis < 3; ++axis) {
      const __m128 low = _mm_load_ps(node.min[axis] + first);
      const __m128 high = _mm_load_ps(node.max[axis] + first);
      hit = _mm_and_ps(hit, _mm_cmple_ps(low, _mm_set1_ps(box.max[axis])));
      hit = _mm_and_ps(hit, _mm_cmpge_ps(high, _mm_set1_ps(box.min[axis])));
    }
    lanes |= static_cast<unsigned>(_mm_movemask_ps(hit)) << first;
  }
  return lanes;
}
#else
inline unsigned overlap_lanes(const BoxNode& node, const Aabb& box) {
  unsigned lanes = 0;
  for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane) {
    bool hit = true;
    for (int axis = 0; axis < 3; ++axis)
      hit &= (node.min[axis][lane] <= box.max[axis]) & (node.max[axis][lane] >= box.min[axis]);
    lanes |= unsigned{hit} << lane;
  }
  return lanes;
}
#endif

struct Ray {
  float origin[3];
  float inverse[3];  // of the direction's components; finite
  float max_fraction;
};

inline Ray make_ray(const float origin[3], const float direction[3], float max_fraction) {
  Ray ray{{origin[0], origin[1], origin[2]}, {}, max_fraction};
  for (int axis = 0; axis < 3; ++axis) {
    // A component this small moves the ray by less than rounding; its inverse must not be infinite
    // (0 times infinity).
    const float component = std::abs(direction[axis]) < 1e-20f
                                ? std::copysign(1e-20f, direction[axis])
                                : direction[axis];
    ray.inverse[axis] = 1 / component;
  }
  return ray;
}

// Slab test, widened by the rounding of its own products so that no hit is lost.
inline unsigned ray_lanes(const BoxNode& node, const Ray& ray) {
  constexpr float kRounding = 1e-6f;
  unsigned lanes = 0;
  for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane) {
    float enter = 0, leave = ray.max_fraction;
    for (int axis = 0; axis < 3; ++axis) {
      const float t0 = (node.min[axis][lane] - ray.origin[axis]) * ray.inverse[axis];
      const float t1 = (node.max[axis][lane] - ray.origin[axis]) * ray.inverse[axis];
      const float near = t0 < t1 ? t0 : t1, far = t0 < t1 ? t1 : t0;
      const float low = near - std::abs(near) * kRounding, high = far + std::abs(far) * kRounding;
      enter = low > enter ? low : enter;
      leave = high < leave ? high : leave;
    }
    lanes |= unsigned{enter <= leave && node.child[lane] != BoxNode::kEmpty} << lane;
  }
  return lanes;
}

// Nodes still to visit. Trees are never deeper than kMaxDepth (see BoxTree), and a node leaves at
// most seven siblings behind.
inline constexpr unsigned kMaxDepth = 64;
struct NodeStack {
  std::uint32_t nodes[kMaxDepth * BoxNode::kWidth];
  unsigned size = 0;
  void push(std::uint32_t node) { nodes[size++] = node; }
  std::uint32_t pop() { return nodes[--size]; }
};

// Calls found(item) for every item whose lane passes `test(node) -> lanes`, and all its ancestors.
template <class Test, class Found>
void walk(const std::vector<BoxNode>& nodes, const Test& test, const Found& found) {
  if (nodes.empty()) return;
  NodeStack stack;
  stack.push(0);
  while (stack.size > 0) {
    const BoxNode& node = nodes[stack.pop()];
    for (unsigned lanes = test(node); lanes != 0; lanes &= lanes - 1) {
      const std::uint32_t child = node.child[std::countr_zero(lanes)];
      if (child & BoxNode::kItem)
        found(child & ~BoxNode::kItem);
      else
        stack.push(child);
    }
  }
}

}  // namespace skerry::collision
