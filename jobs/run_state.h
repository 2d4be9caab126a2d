// Refuses calls out of turn: two runs at once, end() without begin().
#pragma once

#include <atomic>
#include <stdexcept>

namespace skerry::jobs {

class RunState {
 public:
  // Throws std::logic_error if a run is in progress.
  void enter() {
    if (in_run_.exchange(true, std::memory_order_acquire)) {
      throw std::logic_error(
          "executor: a run is in progress (one run at a time; nested work needs its own executor)");
    }
  }
  void check_begun() const {
    if (!in_run()) throw std::logic_error("executor: end() without begin()");
  }
  void leave() { in_run_.store(false, std::memory_order_release); }
  bool in_run() const { return in_run_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> in_run_{false};
};

// Leaves when a run ends, by return or by exception.
class LeaveRun {
 public:
  explicit LeaveRun(RunState& state) : state_(state) {}
  ~LeaveRun() { state_.leave(); }
  LeaveRun(const LeaveRun&) = delete;
  LeaveRun& operator=(const LeaveRun&) = delete;

 private:
  RunState& state_;
};

// A run that was begun and is all done in end(). Keeps what it needs.
struct Pending {
  const TaskGraph* graph = nullptr;
  void* context = nullptr;
  RunOptions options;
};

}  // namespace skerry::jobs
