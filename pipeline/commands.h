// Stage "apply_commands": what the game posted since the last step.
#pragma once

#include <skerry/jobs/task_graph.h>

namespace skerry::pipeline {

struct WorldData;

// Takes the inbox and applies it in the order posted. A command that cannot be applied (its body
// has gone) is skipped and named in the report's warnings; what a Spawn callback throws is kept for
// the caller of the step.
void apply_commands(WorldData& world, jobs::IndexRange, jobs::Task& task);

}  // namespace skerry::pipeline
