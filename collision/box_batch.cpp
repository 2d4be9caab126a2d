// The box kernel with float for lanes: the reference, and what runs where there is no SIMD.
#include "collision/box_batch.h"

#include "collision/float_lanes.h"

namespace skerry::collision {
namespace float_lanes {

#define SKERRY_LANES
#include "collision/lane_vectors-inl.h"

#include "collision/box_points-inl.h"

#include "collision/box_lanes-inl.h"
#undef SKERRY_LANES

}  // namespace float_lanes

void collide_boxes_reference(BoxBatch& batch, int count) {
  float_lanes::collide_box_batch<float_lanes::Lane>(batch, count);
}

}  // namespace skerry::collision
