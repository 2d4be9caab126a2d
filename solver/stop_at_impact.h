// Ends a fast body's step where continuous collision found that it first meets something.
#pragma once

#include "core/step_context.h"

namespace skerry::solver {

// Puts stopped bodies (FastBodies::stopped) where they were after the part of the step that FastBodies::part
// says, with the velocity they had there; the rest of the step is lost to them, but neither momentum nor energy.
// A body in free flight flies that part again. One that was pushed goes back along its way, and its speed
// changes by what gravity did on the way that it no longer makes. Islands on which nothing but contacts acts
// keep their angular momentum: their bodies are shifted by little. Writes FastBodies::moved.
void stop_at_impacts(const core::StepContext& step);

}  // namespace skerry::solver
