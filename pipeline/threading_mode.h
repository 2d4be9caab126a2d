// The only place that knows what a public ThreadingMode means: who drives the step, and what runs
// its stages.
#pragma once

#include <functional>
#include <memory>

#include <skerry/jobs/executor.h>
#include <skerry/settings.h>

namespace skerry::pipeline {

// True if a simulation thread of its own drives the step.
bool has_simulation_thread(ThreadingMode mode);

std::unique_ptr<jobs::Executor> make_step_executor(const WorldSettings& settings);

// While one lives, worlds that are created run their steps on what the factory makes: for tests that
// shuffle or delay tasks, and for measured rows of other schedulers. One at a time, one thread.
class ExecutorOverride {
 public:
  using Factory = std::function<std::unique_ptr<jobs::Executor>(const WorldSettings&)>;
  explicit ExecutorOverride(Factory factory);
  ~ExecutorOverride();
  ExecutorOverride(const ExecutorOverride&) = delete;
  ExecutorOverride& operator=(const ExecutorOverride&) = delete;
};

}  // namespace skerry::pipeline
