// Walks down eight-wide trees in the order in which a ray, a moving box or a growing distance meets
// the boxes, so that the first find prunes most of the rest. Which items are visited may depend on
// the order; what is found must not: callers break ties by ids.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "collision/box_lanes.h"
#include "collision/query_convex.h"
#include "core/rounding.h"

namespace skerry::collision {

// A float at least one unit in the last place below, or above, a double.
inline float float_below(double value) {
  const auto v = core::rounded_to_float(value);
  return v - (std::abs(v) * 0x1p-23f + std::numeric_limits<float>::min());
}
inline float float_above(double value) { return -float_below(-value); }

// A box with half extents `half` (zero: a ray) whose centre moves from `origin` by `translation`.
struct MovingBox {
  // Of the plane of a node's box that the mover meets first, and of the one it meets last, both
  // moved out by the half extents: the mover's origin in their coordinate, rounded so that the box
  // never shrinks.
  float first_origin[3], last_origin[3];
  float inverse[3];  // of the translation; finite
  bool backward[3];  // the mover meets the box's upper plane first

  MovingBox(const V3d& origin, const V3d& translation, const V3d& half) {
    const double o[3] = {origin.x, origin.y, origin.z};
    const double d[3] = {translation.x, translation.y, translation.z};
    const double h[3] = {half.x, half.y, half.z};
    for (int i = 0; i < 3; ++i) {
      backward[i] = std::signbit(d[i]);
      const float above = float_above(o[i] + h[i]), below = float_below(o[i] - h[i]);
      first_origin[i] = backward[i] ? below : above;
      last_origin[i] = backward[i] ? above : below;
      // A component this small moves the ray by less than rounding; 0 times infinity must not be.
      inverse[i] =
          core::rounded_to_float(1 / (std::abs(d[i]) < 1e-20 ? std::copysign(1e-20, d[i]) : d[i]));
    }
  }
};

// Lanes of a node that a mover meets at a fraction of at most `most`, and when it enters them
// (never later than it does).
#if defined(__SSE2__)
inline unsigned moving_lanes(const BoxNode& node, const MovingBox& mover, float most,
                             float (&enter)[BoxNode::kWidth]) {
  // Rounding of the products below, several times over.
  const __m128 earlier = _mm_set1_ps(1 - 1e-6f), later = _mm_set1_ps(1 + 1e-6f);
  unsigned lanes = 0;
  for (unsigned first = 0; first < BoxNode::kWidth; first += 4) {
    __m128 in = _mm_setzero_ps(), out = _mm_set1_ps(most);
    for (int axis = 0; axis < 3; ++axis) {
      const float* near = mover.backward[axis] ? node.max[axis] : node.min[axis];
      const float* far = mover.backward[axis] ? node.min[axis] : node.max[axis];
      const __m128 inverse = _mm_set1_ps(mover.inverse[axis]);
      const __m128 t0 = _mm_mul_ps(
          _mm_sub_ps(_mm_load_ps(near + first), _mm_set1_ps(mover.first_origin[axis])), inverse);
      const __m128 t1 = _mm_mul_ps(
          _mm_sub_ps(_mm_load_ps(far + first), _mm_set1_ps(mover.last_origin[axis])), inverse);
      in = _mm_max_ps(_mm_mul_ps(t0, earlier), in);
      out = _mm_min_ps(_mm_mul_ps(t1, later), out);
    }
    _mm_storeu_ps(enter + first, in);
    lanes |= static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(in, out))) << first;
  }
  return lanes;
}
#else
inline unsigned moving_lanes(const BoxNode& node, const MovingBox& mover, float most,
                             float (&enter)[BoxNode::kWidth]) {
  unsigned lanes = 0;
  for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane) {
    float in = 0, out = most;
    for (int axis = 0; axis < 3; ++axis) {
      const float* near = mover.backward[axis] ? node.max[axis] : node.min[axis];
      const float* far = mover.backward[axis] ? node.min[axis] : node.max[axis];
      const float t0 = (near[lane] - mover.first_origin[axis]) * mover.inverse[axis];
      const float t1 = (far[lane] - mover.last_origin[axis]) * mover.inverse[axis];
      in = t0 * (1 - 1e-6f) > in ? t0 * (1 - 1e-6f) : in;
      out = t1 * (1 + 1e-6f) < out ? t1 * (1 + 1e-6f) : out;
    }
    enter[lane] = in;
    lanes |= unsigned{in <= out} << lane;
  }
  return lanes;
}
#endif

// Lanes within a distance of a box, and a lower bound of that distance.
inline unsigned near_lanes(const BoxNode& node, const Aabb& box, float most,
                           float (&enter)[BoxNode::kWidth]) {
  unsigned lanes = 0;
  for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane) {
    float squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float below = node.min[axis][lane] - box.max[axis];
      const float above = box.min[axis] - node.max[axis][lane];
      float out = below > above ? below : above;
      out = out > 0 ? out : 0;
      squared += out * out;
    }
    enter[lane] = std::sqrt(squared) * (1 - 1e-6f);
    lanes |= unsigned{enter[lane] <= most && node.child[lane] != BoxNode::kEmpty} << lane;
  }
  return lanes;
}

// Calls visit(item) for items in order of their key, `lanes(node, most, keys) -> mask`, as long as
// it does not exceed most(), which may fall meanwhile. visit returns false to end the walk; so does
// the walk.
template <class Lanes, class Most, class Visit>
bool walk_in_order(const std::vector<BoxNode>& nodes, const Lanes& lanes, const Most& most,
                   const Visit& visit) {
  if (nodes.empty()) return true;
  struct Entry {
    float key;
    std::uint32_t child;
  };
  Entry stack[kMaxDepth * BoxNode::kWidth];
  unsigned size = 0;
  stack[size++] = {0, 0};
  while (size > 0) {
    const Entry entry = stack[--size];
    const float limit = most();
    if (entry.key > limit) continue;
    if (entry.child & BoxNode::kItem) {
      if (!visit(entry.child & ~BoxNode::kItem)) return false;
      continue;
    }
    const BoxNode& node = nodes[entry.child];
    float keys[BoxNode::kWidth];
    const unsigned first = size;
    for (unsigned mask = lanes(node, limit, keys); mask != 0; mask &= mask - 1) {
      const auto lane = static_cast<unsigned>(std::countr_zero(mask));
      const Entry child{keys[lane], node.child[lane]};
      unsigned at = size++;  // farthest first, so that the nearest is popped first
      for (; at > first && stack[at - 1].key < child.key; --at) stack[at] = stack[at - 1];
      stack[at] = child;
    }
  }
  return true;
}

}  // namespace skerry::collision
