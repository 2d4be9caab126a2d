#include "collision/bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "collision/box_lanes.h"
#include "collision/broadphase.h"
#include "collision/mesh_tree.h"
#include "core/rounding.h"

namespace skerry::collision {
namespace {

using core::Collider;
using core::ShapeType;
using core::V3f;
using V3d = core::V3<double>;
using M3d = core::M3<double>;

// Farther out than this (1e30 m) boxes stop growing, so that their arithmetic stays finite.
constexpr double kFarthest = 1e30;

// At least one unit in the last place beyond the value: covers the rounding to float, and that of
// the double arithmetic before it.
float rounded_down(double value) {
  const auto v = core::rounded_to_float(std::clamp(value, -kFarthest, kFarthest));
  return v - (std::abs(v) * 0x1p-23f + std::numeric_limits<float>::min());
}
float rounded_up(double value) { return -rounded_down(-value); }

// Bounds relative to the body's centre.
struct Range {
  double low[3], high[3];
};

double component(const V3d& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
// Row of a matrix given by columns.
V3d row(const M3d& m, int axis) {
  return {component(m.c0, axis), component(m.c1, axis), component(m.c2, axis)};
}
M3d times(const M3d& a, const M3d& b) { return {a * b.c0, a * b.c1, a * b.c2}; }
V3d widened(const V3f& v) { return {double(v.x), double(v.y), double(v.z)}; }

M3d shape_axes(const Collider& collider, const core::BodyPose& pose) {
  const Quat& q = pose.orientation;
  const M3d body = to_matrix(core::Q4<double>{q.x(), q.y(), q.z(), q.w()});
  if (!collider.has_local_rotation) return body;
  const core::Q4f& local = collider.local_rotation;
  return times(body, to_matrix(core::Q4<double>{double(local.x), double(local.y), double(local.z),
                                                double(local.w)}));
}

// How far a disc with this radius, across the given axis, reaches along each world axis.
double disc_reach(double radius, double axis_component) {
  return radius * std::sqrt(std::max(0.0, 1 - axis_component * axis_component));
}

// Half extent along world axis i of the shapes that are symmetric about their frame's origin.
double symmetric_reach(const Collider& collider, const M3d& axes, int i) {
  const V3d size = widened(collider.size);
  const V3d r = row(axes, i);
  switch (collider.type) {
    case ShapeType::sphere:
      return size.x;
    case ShapeType::capsule:
      return std::abs(r.y) * size.y + size.x;
    case ShapeType::box:
      return std::abs(r.x) * size.x + std::abs(r.y) * size.y + std::abs(r.z) * size.z;
    case ShapeType::cylinder:
      return std::abs(r.y) * size.y + disc_reach(size.x, r.y);
    case ShapeType::ellipsoid: {
      const V3d s = {r.x * size.x, r.y * size.y, r.z * size.z};
      return std::sqrt(dot(s, s));
    }
    default:
      return 0;
  }
}

Range cone_range(const Collider& collider, const M3d& axes) {
  Range range;
  for (int i = 0; i < 3; ++i) {
    const double up = component(axes.c1, i), apex = up * double(collider.size.y);
    const double disc = disc_reach(double(collider.size.x), up);
    range.low[i] = std::min(apex, -apex - disc);
    range.high[i] = std::max(apex, -apex + disc);
  }
  return range;
}

Range vertex_range(const std::vector<V3f>& vertices, const M3d& axes) {
  Range range;
  for (int i = 0; i < 3; ++i) {
    const V3d r = row(axes, i);
    double low = dot(r, widened(vertices[0])), high = low;
    for (const V3f& vertex : vertices) {
      const double x = dot(r, widened(vertex));
      low = x < low ? x : low;
      high = x > high ? x : high;
    }
    range.low[i] = low;
    range.high[i] = high;
  }
  return range;
}

// The largest r.x over the box of each lane; with the roundings of dot, whose result is monotone in each
// coordinate: no less than what dot gives for any point inside. NaN or hugely negative for empty lanes.
std::array<double, BoxNode::kWidth> largest_in(const BoxNode& node, const V3d& r) {
  const float(*const far[3])[BoxNode::kWidth] = {r.x > 0 ? &node.max[0] : &node.min[0],
                                                 r.y > 0 ? &node.max[1] : &node.min[1],
                                                 r.z > 0 ? &node.max[2] : &node.min[2]};
  std::array<double, BoxNode::kWidth> largest;
  for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane)
    largest[lane] =
        dot(r, V3d{double((*far[0])[lane]), double((*far[1])[lane]), double((*far[2])[lane])});
  return largest;
}

// The largest r.x over the corners of a mesh's triangles.
double largest_in(const core::MeshGeometry& mesh, const V3d& r) {
  double best = -std::numeric_limits<double>::infinity();
  const auto take = [&](std::uint32_t triangle) {
    for (const std::uint32_t vertex : mesh.triangles[triangle])
      best = std::max(best, dot(r, widened(mesh.vertices[vertex])));
  };
  const std::vector<BoxNode>& nodes = mesh.tree->nodes;
  // Down to a corner far out first: it spares the walk most of the tree.
  std::uint32_t child = 0;
  while (!(child & BoxNode::kItem)) {
    const auto largest = largest_in(nodes[child], r);
    unsigned most = 0;  // never empty
    for (unsigned lane = 1; lane < BoxNode::kWidth; ++lane)
      if (largest[lane] > largest[most]) most = lane;
    child = nodes[child].child[most];
  }
  take(child & ~BoxNode::kItem);
  walk(
      nodes,
      [&](const BoxNode& node) {
        const auto largest = largest_in(node, r);
        unsigned lanes = 0;
        for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane)
          lanes |= unsigned{largest[lane] > best} << lane;
        return lanes;
      },
      take);
  return best;
}

Range mesh_range(const core::MeshGeometry& mesh, const M3d& axes) {
  Range range;
  for (int i = 0; i < 3; ++i) {
    const V3d r = row(axes, i);
    range.low[i] = -largest_in(mesh, -r);
    range.high[i] = largest_in(mesh, r);
  }
  return range;
}

// Of the box around all heights, turned.
Range field_range(const core::HeightFieldGeometry& field, const M3d& axes) {
  const double low[3] = {0, double(field.low), 0};
  const double high[3] = {field.step_x * (field.columns - 1), double(field.high),
                          field.step_z * (field.rows - 1)};
  Range range;
  for (int i = 0; i < 3; ++i) {
    const V3d r = row(axes, i);
    range.low[i] = range.high[i] = 0;
    for (int k = 0; k < 3; ++k) {
      const double a = component(r, k) * low[k], b = component(r, k) * high[k];
      range.low[i] += std::min(a, b);
      range.high[i] += std::max(a, b);
    }
  }
  return range;
}

Range shape_range(const Collider& collider, const M3d& axes) {
  if (collider.type == ShapeType::cone) return cone_range(collider, axes);
  if (collider.type == ShapeType::hull) return vertex_range(collider.hull->vertices, axes);
  if (collider.type == ShapeType::mesh) return mesh_range(*collider.mesh, axes);
  if (collider.type == ShapeType::height_field) return field_range(*collider.field, axes);
  Range range;
  for (int i = 0; i < 3; ++i) {
    range.high[i] = symmetric_reach(collider, axes, i);
    range.low[i] = -range.high[i];
  }
  return range;
}

// Beyond every world, yet below infinity: an infinite box would meet the empty lanes of a tree.
constexpr float kFar = 3e38f;

// Without bounds, but for the side of a plane that lies exactly along a world axis.
Aabb plane_bounds(const Collider& collider, const M3d& axes, const V3d& origin) {
  const V3d normal = axes * widened(collider.size);
  Aabb box{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};
  for (int i = 0; i < 3; ++i) {
    const double along = component(normal, i);
    const double across =
        std::abs(component(normal, (i + 1) % 3)) + std::abs(component(normal, (i + 2) % 3));
    if (across != 0) continue;
    const double surface = component(origin, i) + along * collider.plane_offset;
    (along > 0 ? box.max : box.min)[i] = along > 0 ? rounded_up(surface) : rounded_down(surface);
  }
  return box;
}

}  // namespace

Aabb tight_bounds(const Collider& collider, const core::BodyPose& pose) {
  const Quat& q = pose.orientation;
  const M3d body_axes = to_matrix(core::Q4<double>{q.x(), q.y(), q.z(), q.w()});
  const M3d axes = shape_axes(collider, pose);
  const V3d center = {pose.center.x(), pose.center.y(), pose.center.z()};
  const V3d origin = center + body_axes * widened(collider.local_position);
  if (collider.type == ShapeType::plane) return plane_bounds(collider, axes, origin);
  const Range range = shape_range(collider, axes);
  Aabb box;
  for (int i = 0; i < 3; ++i) {
    box.min[i] = rounded_down(component(origin, i) + range.low[i]);
    box.max[i] = rounded_up(component(origin, i) + range.high[i]);
  }
  return box;
}

void update_bounds(const StepContext& step, IndexRange awake_bodies, Task& task) {
  step.broadphase->update_bounds(step, awake_bodies, task);
}

}  // namespace skerry::collision
