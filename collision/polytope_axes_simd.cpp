// The separating-axis search at the widths of this machine's instruction sets.
#include <algorithm>
#include <bit>

#include "collision/polytope_axes.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/polytope_axes_simd.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::collision {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128

static std::uint32_t facing_face_here(const PolytopeLanes& shape, const core::V3f& toward) {
  return facing_face_reference(shape, toward);
}
static Axis recall_axis_here(const AxisQuery& query, const AxisName& name) {
  return recall_axis_reference(query, name);
}
static void search_axes_here(const AxisQuery& query, AxisAnswer& answer) {
  search_axes_reference(query, answer);
}

#else

#include "collision/simd_lanes-inl.h"

#define SKERRY_LANES HWY_ATTR
#include "collision/lane_vectors-inl.h"

#include "collision/axis_lanes-inl.h"
#include "collision/polytope_axes-inl.h"
#undef SKERRY_LANES

static std::uint32_t facing_face_here(const PolytopeLanes& shape, const core::V3f& toward) {
  return facing_face_lanes<Lane>(shape, toward);
}
static Axis recall_axis_here(const AxisQuery& query, const AxisName& name) {
  return recall_axis_lanes<Lane>(query, name);
}
static void search_axes_here(const AxisQuery& query, AxisAnswer& answer) {
  search_axes_lanes<Lane>(query, answer);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::collision {

HWY_EXPORT(facing_face_here);
HWY_EXPORT(recall_axis_here);
HWY_EXPORT(search_axes_here);

std::uint32_t facing_face(const PolytopeLanes& shape, const core::V3f& toward) {
  return HWY_DYNAMIC_DISPATCH(facing_face_here)(shape, toward);
}
Axis recall_axis(const AxisQuery& query, const AxisName& name) {
  return HWY_DYNAMIC_DISPATCH(recall_axis_here)(query, name);
}
void search_axes(const AxisQuery& query, AxisAnswer& answer) {
  HWY_DYNAMIC_DISPATCH(search_axes_here)(query, answer);
}

}  // namespace skerry::collision
#endif  // HWY_ONCE
