#include <skerry/jobs/executor.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "jobs/serial_executor.h"
#include "jobs/ticket_executor.h"

namespace skerry::jobs {
namespace {

constexpr int kMostWorkers = 1024;

void check(ExecutorKind kind, const ExecutorSettings& settings) {
  if (settings.workers < 0 || settings.workers > kMostWorkers) {
    throw std::invalid_argument("ExecutorSettings::workers is " + std::to_string(settings.workers) +
                                "; it must be 0 (automatic) to " + std::to_string(kMostWorkers));
  }
  if (!(settings.wait.spin_us >= 0)) {
    throw std::invalid_argument("WaitPolicy::spin_us must be 0 or more");
  }
  if (kind == ExecutorKind::host_pool && !settings.pool) {
    throw std::invalid_argument("ExecutorKind::host_pool needs ExecutorSettings::pool");
  }
}

// The caller and as many helpers as there can be.
int wanted_workers(ExecutorKind kind, const ExecutorSettings& settings) {
  if (kind == ExecutorKind::serial) return 1;
  if (kind != ExecutorKind::host_pool) {
    return settings.workers > 0 ? settings.workers : automatic_worker_count();
  }
  const int most = std::clamp(settings.pool->worker_count(), 0, kMostWorkers - 1) + 1;
  return settings.workers > 0 ? std::min(settings.workers, most) : most;
}

}  // namespace

std::unique_ptr<Executor> make_executor(ExecutorKind kind, const ExecutorSettings& settings) {
  check(kind, settings);
  const auto workers = static_cast<std::uint32_t>(wanted_workers(kind, settings));
  if (workers == 1) return make_serial_executor();
  if (kind == ExecutorKind::fork_join) return make_tbb_fork_join_executor(workers, settings);

  const std::vector<int> processors = allowed_processors();
  const auto run = std::make_shared<GraphRun>(workers, settings.wait);
  std::unique_ptr<Helpers> helpers;
  if (kind == ExecutorKind::job_system) helpers = make_tbb_helpers(run, settings, processors);
  if (kind == ExecutorKind::threads) helpers = make_thread_helpers(*run, settings, processors);
  if (kind == ExecutorKind::host_pool) helpers = make_pool_helpers(*run, *settings.pool);
  if (!helpers) throw std::invalid_argument("unknown ExecutorKind");
  return make_ticket_executor(run, std::move(helpers), settings.affinity, processors);
}

}  // namespace skerry::jobs
