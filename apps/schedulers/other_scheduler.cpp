#include "apps/schedulers/other_scheduler.h"

#include <stdexcept>

#include "apps/schedulers/fork_join_regions.h"
#include "pipeline/threading_mode.h"

namespace skerry::schedulers {

const char* to_string(OtherScheduler scheduler) {
  switch (scheduler) {
    case OtherScheduler::none:
      return "own";
    case OtherScheduler::flow_graph:
      return "oneTBB flow graph";
    case OtherScheduler::std_threads:
      return "std::thread fork-join";
    case OtherScheduler::openmp:
      break;
  }
  return "OpenMP fork-join";
}

std::vector<OtherScheduler> available() {
  std::vector<OtherScheduler> all = {OtherScheduler::flow_graph, OtherScheduler::std_threads};
  if (make_openmp_regions({.workers = 2})) all.push_back(OtherScheduler::openmp);
  return all;
}

std::unique_ptr<jobs::Executor> make_executor(OtherScheduler scheduler,
                                              const jobs::ExecutorSettings& settings) {
  jobs::ExecutorSettings resolved = settings;
  if (resolved.workers == 0) resolved.workers = jobs::automatic_worker_count();
  switch (scheduler) {
    case OtherScheduler::flow_graph:
      return make_flow_graph(resolved);
    case OtherScheduler::std_threads:
      return make_fork_join(make_thread_regions(resolved), resolved);
    case OtherScheduler::openmp:
      return make_fork_join(make_openmp_regions(resolved), resolved);
    case OtherScheduler::none:
      break;
  }
  throw std::invalid_argument("no scheduler asked for");
}

struct Scope::Impl {
  explicit Impl(OtherScheduler scheduler)
      : override_([scheduler](const WorldSettings& settings) {
          return make_executor(
              scheduler,
              {.workers = settings.workers, .wait = settings.wait, .affinity = settings.affinity});
        }) {}
  pipeline::ExecutorOverride override_;
};

Scope::Scope(OtherScheduler scheduler)
    : impl_(scheduler == OtherScheduler::none ? nullptr : std::make_unique<Impl>(scheduler)) {}
Scope::~Scope() = default;

}  // namespace skerry::schedulers
