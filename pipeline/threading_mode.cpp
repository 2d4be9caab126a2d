#include "pipeline/threading_mode.h"

#include <utility>

namespace skerry::pipeline {
namespace {

ExecutorOverride::Factory& override_factory() {
  static ExecutorOverride::Factory factory;
  return factory;
}

jobs::ExecutorKind executor_kind(const WorldSettings& settings) {
  switch (settings.mode) {
    case ThreadingMode::serial:
    case ThreadingMode::dedicated_thread:
      return jobs::ExecutorKind::serial;
    case ThreadingMode::fork_join:
      return jobs::ExecutorKind::fork_join;
    case ThreadingMode::dedicated_thread_jobs:
    case ThreadingMode::job_system:
      break;
  }
  return settings.pool ? jobs::ExecutorKind::host_pool : jobs::ExecutorKind::job_system;
}

}  // namespace

bool has_simulation_thread(ThreadingMode mode) {
  return mode == ThreadingMode::dedicated_thread || mode == ThreadingMode::dedicated_thread_jobs;
}

std::unique_ptr<jobs::Executor> make_step_executor(const WorldSettings& settings) {
  if (const auto& factory = override_factory()) return factory(settings);
  return jobs::make_executor(executor_kind(settings), {.workers = settings.workers,
                                                       .wait = settings.wait,
                                                       .affinity = settings.affinity,
                                                       .pool = settings.pool});
}

ExecutorOverride::ExecutorOverride(Factory factory) { override_factory() = std::move(factory); }
ExecutorOverride::~ExecutorOverride() { override_factory() = nullptr; }

}  // namespace skerry::pipeline
