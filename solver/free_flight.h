// Free flight in double: bodies with no contact and no joint in this step, and kinematic bodies.
#pragma once

#include "core/step_context.h"

namespace skerry::solver {

// Advances one body by step.dt with settings->integrator; writes its pose and motion. Rotation is
// driven by the angular momentum, which a torque-free flight leaves untouched. Never produces
// non-finite state: such a body is quarantined (pose kept, stopped, kQuarantined).
void fly_free(const core::StepContext& step, core::BodyIndex body);

}  // namespace skerry::solver
