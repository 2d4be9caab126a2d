// Bounds of colliders: tight boxes, fat boxes, and the stage that keeps them.
#pragma once

#include "core/step_context.h"

namespace skerry::collision {

using core::ColliderIndex;
using core::IndexRange;
using core::StepContext;
using core::Task;

// Axis-aligned box in world coordinates, rounded outward to float.
struct Aabb {
  float min[3];
  float max[3];
};
inline bool overlap(const Aabb& a, const Aabb& b) {
  return a.min[0] <= b.max[0] && b.min[0] <= a.max[0] && a.min[1] <= b.max[1] &&
         b.min[1] <= a.max[1] && a.min[2] <= b.max[2] && b.min[2] <= a.max[2];
}

inline bool is_inside(const Aabb& inner, const Aabb& outer) {
  bool in = true;
  for (int axis = 0; axis < 3; ++axis)
    in &= (inner.min[axis] >= outer.min[axis]) & (inner.max[axis] <= outer.max[axis]);
  return in;
}

// Smallest box around a collider at its body's pose. Planes give a half-infinite or infinite box.
Aabb tight_bounds(const core::Collider& collider, const core::BodyPose& pose);

// Stage "update_bounds", per awake body (rows of Bodies::awake). Tests whether each collider's tight
// box, swept by its velocity over dt, still lies in its fat box; if not, gives it a new fat box and
// marks it moved. Writes bounds of its own colliders only.
void update_bounds(const StepContext& step, IndexRange awake_bodies, Task& task);

}  // namespace skerry::collision
