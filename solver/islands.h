// Simulation islands: what must be solved together.
#pragma once

#include "core/step_context.h"

namespace skerry::solver {

using core::BodyIndex;
using core::IndexRange;
using core::StepContext;
using core::Task;

// Stage "build_islands", once. Wakes sleeping islands that an awake body touches, connects bodies
// by touching (non-sensor) pairs and joints (union-find), lists islands in ascending order of their
// lowest body, packs them into groups (largest first), and lists free bodies.
void build_islands(const StepContext& step, IndexRange, Task& task);

}  // namespace skerry::solver
