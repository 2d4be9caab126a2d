// The only place that knows what a public ThreadingMode means: who drives the step, and what runs
// its stages.
#pragma once

#include <memory>

#include <skerry/jobs/executor.h>
#include <skerry/settings.h>

namespace skerry::pipeline {

// True if a simulation thread of its own drives the step.
bool has_simulation_thread(ThreadingMode mode);

std::unique_ptr<jobs::Executor> make_step_executor(const WorldSettings& settings);

}  // namespace skerry::pipeline
