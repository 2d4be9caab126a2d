#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include <skerry/world.h>

namespace skerry::measure {

struct LoggedStep {
  std::uint64_t step = 0;
  std::int64_t begin_ns = 0;
  double step_ms = 0;
  double time = 0;  // s simulated, after it
  std::vector<jobs::TaskRecord> tasks;
};

// The steps of a world, from whatever thread makes them.
class StepLog {
 public:
  // For WorldSettings::after_step; the log must outlive the world.
  auto after_step() {
    return [this](const StepReport& report, std::span<const jobs::TaskRecord> tasks) {
      const std::lock_guard lock(mutex_);
      if (!on_) return;
      steps_.push_back({report.step, report.begin_ns, report.step_ms, report.time, {}});
      if (keep_tasks_) steps_.back().tasks.assign(tasks.begin(), tasks.end());
    };
  }

  void start(bool keep_tasks) {
    const std::lock_guard lock(mutex_);
    on_ = true;
    keep_tasks_ = keep_tasks;
    steps_.clear();
  }
  std::vector<LoggedStep> stop() {
    const std::lock_guard lock(mutex_);
    on_ = false;
    return std::exchange(steps_, {});
  }

 private:
  std::mutex mutex_;
  bool on_ = false, keep_tasks_ = false;
  std::vector<LoggedStep> steps_;
};

}  // namespace skerry::measure
