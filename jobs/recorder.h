// Gathers what a run took, per worker without sharing, and fills the caller's RunReport.
#pragma once

#include <cstdint>
#include <vector>

#include <skerry/jobs/executor.h>

#include "core/clock.h"

namespace skerry::jobs {

class Recorder {
 public:
  explicit Recorder(std::uint32_t workers) : logs_(workers) {}

  // `report` may be null: then nothing is recorded and no clock is read.
  void begin_run(const TaskGraph& graph, RunReport* report);
  bool on() const { return report_ != nullptr; }
  bool keeps_tasks() const { return on() && report_->record_tasks; }
  std::int64_t now() const { return on() ? core::now_ns() : 0; }

  // Worker `worker` ran the kernel of `stage` on `items`. From the thread that holds the index.
  // `spared_ns`: how much sooner it would have ended with helpers without end.
  void kernel(std::uint32_t worker, std::uint32_t stage, IndexRange items, std::int64_t begin_ns,
              std::int64_t end_ns, std::int64_t spared_ns = 0);
  // Worker `worker` waited within a kernel. From the thread that holds the index.
  void waited(std::uint32_t worker, std::int64_t ns) { logs_[worker].waited_ns += ns; }
  // Worker `worker` ran blocks of a phase program that the kernel of `stage` on the item
  // `first_item` runs; `program` tells programs apart. One record per program and stretch.
  void joined(std::uint32_t worker, std::uint32_t stage, std::uint32_t first_item,
              std::uint64_t program, std::int64_t begin_ns, std::int64_t end_ns);

  // The number of items of a stage; by whoever starts it.
  void items(std::uint32_t stage, std::uint32_t count) {
    if (on()) report_->stages[stage].items = count;
  }
  // The caller had nothing to run.
  void blocked(std::int64_t ns) { blocked_ns_ += ns; }

  // All workers are done with the run.
  void end_run();

 private:
  struct Total {
    std::int64_t begin_ns = 0;  // 0: none ran
    std::int64_t end_ns = 0;
    std::int64_t busy_ns = 0;
    std::uint32_t tasks = 0;
  };
  struct alignas(64) Log {
    std::vector<Total> totals;  // [stage]
    std::vector<TaskRecord> tasks;
    std::uint64_t last_program = 0;  // the program of the last record in `tasks`, 0: a kernel
    std::int64_t waited_ns = 0;
  };
  void add(Log& log, std::uint32_t stage, std::int64_t begin_ns, std::int64_t end_ns);
  void merge_totals(std::uint32_t stage);
  void merge_tasks();

  std::vector<Log> logs_;  // [worker]
  const TaskGraph* graph_ = nullptr;
  RunReport* report_ = nullptr;
  std::int64_t blocked_ns_ = 0;
};

}  // namespace skerry::jobs
