#include <fmt/core.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "apps/report/trace_events.h"
#include "apps/skerry/json_output.h"

namespace skerry::app {
namespace {

// Shorter times without a task are the scheduler's own.
constexpr std::int64_t kLeastWaitNs = 3000;

class RunTrace {
 public:
  RunTrace(const RunIdentity& identity, const measure::RunResult& result)
      : workers_(static_cast<std::uint32_t>(identity.workers)),
        events_(fmt::format("skerry: {}, {}", identity.scene, to_string(identity.mode))) {
    if (!result.tasks.empty()) origin_ns_ = result.tasks.front().begin_ns;
    events_.name_track(workers_, "steps");
    for (std::uint32_t worker = 0; worker < workers_; ++worker) {
      events_.name_track(
          worker, worker == 0 ? "worker 0 (makes the step)" : "worker " + std::to_string(worker));
    }
    for (const measure::StepTasks& step : result.tasks) add_step(step);
  }

  report::TraceEvents& events() { return events_; }

 private:
  void add_step(const measure::StepTasks& step) {
    add("step " + std::to_string(step.step), "step", workers_, step.begin_ns, step.end_ns, nullptr);
    std::vector<std::int64_t> free_since(workers_, step.begin_ns);  // [worker]
    for (const jobs::TaskRecord& task : step.tasks) {               // by begin time
      add_wait(task.worker, free_since[task.worker], task.begin_ns);
      free_since[task.worker] = std::max(free_since[task.worker], task.end_ns);
      add(task.name, "task", task.worker, task.begin_ns, task.end_ns,
          {{"first_item", task.first_item}, {"item_count", task.item_count}});
    }
    for (std::uint32_t worker = 0; worker < workers_; ++worker) {
      add_wait(worker, free_since[worker], step.end_ns);
    }
  }

  void add_wait(std::uint32_t worker, std::int64_t begin_ns, std::int64_t end_ns) {
    if (end_ns - begin_ns < kLeastWaitNs) return;
    add("wait", "wait", worker, begin_ns, end_ns, nullptr);
  }

  void add(const std::string& name, const char* category, std::uint32_t track,
           std::int64_t begin_ns, std::int64_t end_ns, Json args) {
    events_.add(name, category, track, begin_ns - origin_ns_, end_ns - origin_ns_, std::move(args));
  }

  std::uint32_t workers_;
  std::int64_t origin_ns_ = 0;
  report::TraceEvents events_;
};

}  // namespace

Json to_trace(const RunIdentity& identity, const measure::RunResult& result) {
  return RunTrace(identity, result)
      .events()
      .take({{"scene", identity.scene}, {"mode", to_string(identity.mode)}});
}

}  // namespace skerry::app
