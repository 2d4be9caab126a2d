// The choice of points at the widths of this machine's instruction sets.

#include "collision/mesh_points.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/mesh_points_simd.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::collision {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128

static void choose_here(std::vector<MeshPoints::Block>& blocks, PointChoice& choice) {
  choose_spread_reference(blocks, choice);
}

#else

#include "collision/simd_lanes-inl.h"

#define SKERRY_LANES HWY_ATTR
#include "collision/lane_vectors-inl.h"

#include "collision/axis_lanes-inl.h"
#include "collision/mesh_points-inl.h"
#undef SKERRY_LANES

static void choose_here(std::vector<MeshPoints::Block>& blocks, PointChoice& choice) {
  choose_spread_lanes<Lane>(blocks, choice);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::collision {

HWY_EXPORT(choose_here);

void choose_spread(std::vector<MeshPoints::Block>& blocks, PointChoice& choice) {
  HWY_DYNAMIC_DISPATCH(choose_here)(blocks, choice);
}

}  // namespace skerry::collision
#endif  // HWY_ONCE
