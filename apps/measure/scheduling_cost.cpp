#include "apps/measure/scheduling_cost.h"

#include <memory>

#include "apps/measure/compare_parts.h"
#include "apps/measure/process_meter.h"

namespace skerry::measure {
namespace {

constexpr int kTurns = 5, kStepsPerTurn = 100, kRunsPerTurn = 20;

double us_since(std::int64_t begin_ns) { return 1e-3 * static_cast<double>(now_ns() - begin_ns); }

jobs::TaskGraph empty_tasks() {
  jobs::TaskGraph graph;
  for (int i = 0; i < kEmptyStages; ++i) {
    graph.stage({.name = "nothing",
                 .domain = static_cast<jobs::Domain>(1 + i),
                 .kernel = [](void*, jobs::IndexRange, jobs::Task&) {},
                 .count = [](void*) { return std::uint32_t{kEmptyChunks}; },
                 .chunk = 1,
                 .writes = 1});
  }
  return graph;
}

std::unique_ptr<jobs::Executor> executor_of(const Strategy& row) {
  const jobs::ExecutorSettings settings = {
      .workers = row.workers, .wait = row.wait, .affinity = row.affinity};
  if (row.scheduler != schedulers::OtherScheduler::none) {
    return schedulers::make_executor(row.scheduler, settings);
  }
  switch (row.mode) {
    case ThreadingMode::serial:
      return jobs::make_executor(jobs::ExecutorKind::serial, settings);
    case ThreadingMode::fork_join:
      return jobs::make_executor(jobs::ExecutorKind::fork_join, settings);
    case ThreadingMode::job_system:
      return jobs::make_executor(jobs::ExecutorKind::job_system, settings);
    default:
      return nullptr;
  }
}

std::vector<double> time_steps(const scenes::SceneDesc& nothing, const CompareOptions& options,
                               const Strategy& row) {
  const double dt = 1.0 / 60;
  Session session(nothing, base_settings(nothing, options, dt), dt, row);
  std::vector<double> us;
  for (int i = 0; i < kStepsPerTurn; ++i) {
    const std::int64_t begin_ns = now_ns();
    session.advance();
    us.push_back(us_since(begin_ns));
  }
  return us;
}

std::vector<double> time_tasks(const jobs::TaskGraph& graph, const Strategy& row) {
  std::vector<double> us;
  const auto executor = executor_of(row);
  for (int i = 0; executor && i < kRunsPerTurn; ++i) {
    const std::int64_t begin_ns = now_ns();
    executor->run(graph, nullptr);
    us.push_back(us_since(begin_ns));
  }
  return us;
}

void append(std::vector<double>& to, const std::vector<double>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

std::vector<SchedulingCost> scheduling_costs(const CompareOptions& options) {
  std::vector<Strategy> rows = strategies(options.axes);
  if (options.other_schedulers) {
    for (const Strategy& row : other_schedulers(options.axes)) rows.push_back(row);
  }
  const scenes::SceneDesc nothing;
  const jobs::TaskGraph graph = empty_tasks();
  std::vector<std::vector<double>> steps(rows.size()), tasks(rows.size());
  for (int turn = 0; turn < kTurns; ++turn) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      append(steps[i], time_steps(nothing, options, rows[i]));
      append(tasks[i], time_tasks(graph, rows[i]));
    }
  }
  std::vector<SchedulingCost> costs;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SchedulingCost& cost = costs.emplace_back();
    cost.strategy = rows[i];
    cost.empty_step_us = summarize(steps[i]);
    if (!tasks[i].empty()) cost.empty_tasks_us = summarize(tasks[i]);
  }
  return costs;
}

}  // namespace skerry::measure
