#include "jobs/recorder.h"

#include <algorithm>

namespace skerry::jobs {

void Recorder::begin_run(const TaskGraph& graph, RunReport* report) {
  report_ = report;
  graph_ = &graph;
  blocked_ns_ = 0;
  if (!on()) return;
  const auto stages = graph.stages();
  for (Log& log : logs_) {
    log.totals.assign(stages.size(), Total{});
    log.tasks.clear();
    log.last_program = 0;
    log.waited_ns = 0;
  }
  report_->stages.assign(stages.size(), StageTiming{});
  for (std::size_t i = 0; i < stages.size(); ++i) report_->stages[i].name = stages[i].name;
  report_->tasks.clear();
  report_->begin_ns = core::now_ns();
}

void Recorder::add(Log& log, std::uint32_t stage, std::int64_t begin_ns, std::int64_t end_ns) {
  Total& total = log.totals[stage];
  if (total.begin_ns == 0) total.begin_ns = begin_ns;
  total.end_ns = end_ns;
  total.busy_ns += end_ns - begin_ns;
}

void Recorder::kernel(std::uint32_t worker, std::uint32_t stage, IndexRange items,
                      std::int64_t begin_ns, std::int64_t end_ns, std::int64_t spared_ns) {
  if (!on()) return;
  Log& log = logs_[worker];
  add(log, stage, begin_ns, end_ns);
  ++log.totals[stage].tasks;
  if (!report_->record_tasks) return;
  log.tasks.push_back({graph_->stages()[stage].name, begin_ns, end_ns, worker, items.begin,
                       items.size(), end_ns - begin_ns - spared_ns});
  log.last_program = 0;
}

void Recorder::joined(std::uint32_t worker, std::uint32_t stage, std::uint32_t first_item,
                      std::uint64_t program, std::int64_t begin_ns, std::int64_t end_ns) {
  if (!on()) return;
  Log& log = logs_[worker];
  add(log, stage, begin_ns, end_ns);
  if (!report_->record_tasks) return;
  if (log.last_program == program) {
    log.tasks.back().end_ns = end_ns;
    log.tasks.back().critical_ns = end_ns - log.tasks.back().begin_ns;
    return;
  }
  log.tasks.push_back(
      {graph_->stages()[stage].name, begin_ns, end_ns, worker, first_item, 0, end_ns - begin_ns});
  log.last_program = program;
}

void Recorder::merge_totals(std::uint32_t stage) {
  StageTiming& timing = report_->stages[stage];
  for (const Log& log : logs_) {
    const Total& total = log.totals[stage];
    if (total.begin_ns == 0) continue;
    if (timing.begin_ns == 0 || total.begin_ns < timing.begin_ns) timing.begin_ns = total.begin_ns;
    timing.end_ns = std::max(timing.end_ns, total.end_ns);
    timing.busy_ns += total.busy_ns;
    timing.tasks += total.tasks;
  }
}

void Recorder::merge_tasks() {
  for (const Log& log : logs_) {
    report_->tasks.insert(report_->tasks.end(), log.tasks.begin(), log.tasks.end());
  }
  std::sort(report_->tasks.begin(), report_->tasks.end(),
            [](const TaskRecord& a, const TaskRecord& b) {
              return a.begin_ns != b.begin_ns ? a.begin_ns < b.begin_ns : a.worker < b.worker;
            });
}

void Recorder::end_run() {
  if (!on()) return;
  for (std::uint32_t i = 0; i < report_->stages.size(); ++i) merge_totals(i);
  if (report_->record_tasks) merge_tasks();
  report_->blocked_ns = blocked_ns_;
  report_->phase_wait_ns = 0;
  for (const Log& log : logs_) report_->phase_wait_ns += log.waited_ns;
  report_->helped_ns = 0;
  for (const Total& total : logs_[0].totals) report_->helped_ns += total.busy_ns;
  report_->end_ns = core::now_ns();
  report_ = nullptr;
}

}  // namespace skerry::jobs
