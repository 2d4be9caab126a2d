// External forces on a body: gravity, user forces, force fields.
#pragma once

#include "core/step_context.h"

namespace skerry::solver {

struct ExternalForce {
  Vec3 force = Vec3::Zero();   // N, at the centre of mass; gravity included
  Vec3 torque = Vec3::Zero();  // N m, world
};

// At time t (s) with the body at r (m), moving with v and w. Field callbacks that throw count as no
// field; the exception is kept in step.callback_errors. Locked axes are cleared.
ExternalForce external_force(const core::StepContext& step, core::BodyIndex body, double t,
                             const Vec3& r, const Vec3& v, const Vec3& w);

// False if external forces are the same at every instant of the step.
bool forces_vary(const core::StepContext& step);

}  // namespace skerry::solver
