// The dedicated thread: makes steps at a fixed rate, or a given number as fast as it can.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include <skerry/settings.h>

namespace skerry::pipeline {

// Threads: start(), stop(), run() from one controlling thread; wait_for_due() and the counters from
// any. The step function runs on the dedicated thread only.
class SimulationThread {
 public:
  // `step` makes one step; if it throws, the thread stops and stop() rethrows.
  SimulationThread(double rate_hz, BlockPolicy policy, std::function<void()> step);
  ~SimulationThread();  // stops; what the step threw is lost

  // `time`: s simulated so far.
  void start(double time);
  void stop();
  bool running() const;

  // Makes `count` steps and returns; rethrows what a step threw. Not while running.
  void run(std::uint64_t count);

  // Blocks until as many of the steps that are due by now have been made as the policy asks for.
  void wait_for_due();

  std::uint64_t dropped() const;
  // Monotonic clock when simulated time is or would have been zero, dropped steps considered.
  std::int64_t epoch_ns() const;

 private:
  void work();
  void keep_rate(std::unique_lock<std::mutex>& lock);
  bool make_step(std::unique_lock<std::mutex>& lock);
  std::uint64_t due(std::int64_t now_ns) const;

  const double rate_hz_;
  const BlockPolicy policy_;
  const std::function<void()> step_;

  mutable std::mutex mutex_;
  std::condition_variable wake_, progress_;
  // All guarded by mutex_.
  bool running_ = false, quit_ = false, stepping_ = false;
  std::uint64_t requested_ = 0;  // steps to make at once (run)
  std::uint64_t made_ = 0;       // steps made or dropped since start()
  std::uint64_t dropped_ = 0;
  std::int64_t start_ns_ = 0;
  std::int64_t epoch_ns_ = 0;
  std::exception_ptr error_;

  std::thread thread_;  // last: it uses all of the above
};

}  // namespace skerry::pipeline
