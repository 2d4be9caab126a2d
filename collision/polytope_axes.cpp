// The separating-axis search with float for lanes: the reference, and what runs without SIMD.
#include "collision/polytope_axes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "collision/float_lanes.h"

namespace skerry::collision {
namespace float_lanes {

#define SKERRY_LANES
#include "collision/lane_vectors-inl.h"

#include "collision/axis_lanes-inl.h"
#include "collision/polytope_axes-inl.h"
#undef SKERRY_LANES

}  // namespace float_lanes

core::V3f axis_normal(const AxisQuery& query, const AxisName& name) {
  using core::dot;
  using core::V3f;
  if (name.kind == AxisName::kFaceOfA) return query.a.face_normal(name.a);
  if (name.kind == AxisName::kFaceOfB) return -(query.rotation * query.b.face_normal(name.b));
  const V3f out =
      query.a.edge(PolytopeLanes::kLeft, name.a) + query.a.edge(PolytopeLanes::kRight, name.a);
  const V3f product = cross(query.a.edge(PolytopeLanes::kAlong, name.a),
                            query.rotation * query.b.edge(PolytopeLanes::kAlong, name.b));
  const float scale = 1 / std::sqrt(dot(product, product));
  return product * (dot(product, out) < 0 ? -scale : scale);
}

bool parts(const AxisQuery& query, const Axis& axis) {
  if (axis.separation > query.margin) return true;
  if (!(axis.separation > query.slop)) return false;
  const float along = core::dot(axis_normal(query, axis.name), query.way);
  return axis.separation > query.slop + std::max(0.0f, query.spin - along);
}

std::uint32_t facing_face_reference(const PolytopeLanes& shape, const core::V3f& toward) {
  return float_lanes::facing_face_lanes<float_lanes::Lane>(shape, toward);
}
Axis recall_axis_reference(const AxisQuery& query, const AxisName& name) {
  return float_lanes::recall_axis_lanes<float_lanes::Lane>(query, name);
}
void search_axes_reference(const AxisQuery& query, AxisAnswer& answer) {
  float_lanes::search_axes_lanes<float_lanes::Lane>(query, answer);
}

}  // namespace skerry::collision
