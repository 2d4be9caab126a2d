// The separating-axis search with float for lanes: the reference, and what runs without SIMD.
#include "collision/polytope_axes.h"

#include <algorithm>
#include <bit>

#include "collision/float_lanes.h"

namespace skerry::collision {
namespace float_lanes {

#define SKERRY_LANES
#include "collision/lane_vectors-inl.h"

#include "collision/axis_lanes-inl.h"
#include "collision/polytope_axes-inl.h"
#undef SKERRY_LANES

}  // namespace float_lanes

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
