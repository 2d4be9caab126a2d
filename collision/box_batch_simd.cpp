// The box kernel at the widths of this machine's instruction sets.

#include "collision/box_batch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/box_batch_simd.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::collision {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128

static void collide_boxes_here(BoxBatch& batch, int count) {
  collide_boxes_reference(batch, count);
}

#else

#include "collision/simd_lanes-inl.h"

#define SKERRY_LANES HWY_ATTR
#include "collision/lane_vectors-inl.h"

#include "collision/box_points-inl.h"

#include "collision/box_lanes-inl.h"
#undef SKERRY_LANES

static void collide_boxes_here(BoxBatch& batch, int count) {
  collide_box_batch<Lane>(batch, count);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::collision {

HWY_EXPORT(collide_boxes_here);

void collide_boxes(BoxBatch& batch, int count) {
  HWY_DYNAMIC_DISPATCH(collide_boxes_here)(batch, count);
}

}  // namespace skerry::collision
#endif  // HWY_ONCE
