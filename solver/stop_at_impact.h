// Ends a fast body's step where continuous collision found that it first meets something.
#pragma once

#include "core/step_context.h"

namespace skerry::solver {

// Puts a body where it was after the part of the step that FastBodies::part says, with the velocity
// it had there; the rest of the step is lost to it, but neither momentum nor energy. A body in free
// flight flies that part again. One that was pushed goes back along its way, and its speed changes
// by what gravity did on the way that it no longer makes.
void stop_at_impact(const core::StepContext& step, core::BodyIndex body);

}  // namespace skerry::solver
