#include <utility>

#include "apps/measure/host_load.h"

namespace skerry::measure {

const char* to_string(HostShape shape) {
  switch (shape) {
    case HostShape::serial:
      return "serial";
    case HostShape::jobs:
      return "jobs";
    case HostShape::mixed:
      break;
  }
  return "mixed";
}

HostPool::HostPool(int threads, const jobs::WaitPolicy& wait, jobs::Affinity affinity)
    : threads_(threads),
      executor_(jobs::make_executor(jobs::ExecutorKind::job_system,
                                    {.workers = threads, .wait = wait, .affinity = affinity})) {}

HostPool::~HostPool() = default;

void HostPool::parallel_for(std::uint32_t count, std::uint32_t chunk,
                            const std::function<void(std::uint32_t, std::uint32_t)>& job) {
  Loop loop{count, &job};
  jobs::TaskGraph graph;
  graph.stage(
      {.name = "host job",
       .domain = 1,
       .kernel = [](void* context, jobs::IndexRange items,
                    jobs::Task&) { (*static_cast<Loop*>(context)->job)(items.begin, items.end); },
       .count = [](void* context) { return static_cast<Loop*>(context)->count; },
       .chunk = chunk});
  executor_->run(graph, &loop, {.stop = {}, .report = report_.record_tasks ? &report_ : nullptr});
  if (report_.record_tasks) {
    tasks_.insert(tasks_.end(), report_.tasks.begin(), report_.tasks.end());
  }
}

std::vector<jobs::TaskRecord> HostPool::take_tasks() { return std::exchange(tasks_, {}); }

}  // namespace skerry::measure
