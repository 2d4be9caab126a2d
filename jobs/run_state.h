// Refuses calls out of turn: two runs at once, end() without begin().
#pragma once

#include <atomic>
#include <stdexcept>
#include <utility>

#include <skerry/jobs/executor.h>

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

// What end() needs of a run that was begun.
struct Pending {
  const TaskGraph* graph = nullptr;
  void* context = nullptr;
  RunOptions options;
};

// An executor whose begin() does nothing: the whole run is made in end(), on the caller and whom it
// asks there.
class MadeInEnd : public Executor {
 public:
  void run(const TaskGraph& graph, void* context, const RunOptions& options) final {
    begin(graph, context, options);
    end();
  }
  void begin(const TaskGraph& graph, void* context, const RunOptions& options) final {
    state_.enter();
    pending_ = {&graph, context, options};
  }
  void end() final {
    state_.check_begun();
    const LeaveRun leave(state_);
    const Pending run = std::exchange(pending_, {});
    make_run(run);
  }

 protected:
  virtual void make_run(const Pending& run) = 0;
  bool in_run() const { return state_.in_run(); }

 private:
  RunState state_;
  Pending pending_;
};

}  // namespace skerry::jobs
