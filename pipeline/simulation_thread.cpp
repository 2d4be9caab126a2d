#include "pipeline/simulation_thread.h"

#include <chrono>
#include <utility>

#include "core/clock.h"

namespace skerry::pipeline {

SimulationThread::SimulationThread(double rate_hz, BlockPolicy policy, std::function<void()> step)
    : rate_hz_(rate_hz), policy_(policy), step_(std::move(step)), thread_([this] { work(); }) {}

SimulationThread::~SimulationThread() {
  {
    const std::lock_guard lock(mutex_);
    running_ = false;
    quit_ = true;
    requested_ = 0;
  }
  wake_.notify_all();
  thread_.join();
}

void SimulationThread::start(double time) {
  {
    const std::lock_guard lock(mutex_);
    running_ = true;
    made_ = 0;
    start_ns_ = core::now_ns();
    epoch_ns_ = start_ns_ - static_cast<std::int64_t>(time * 1e9);
  }
  wake_.notify_all();
}

void SimulationThread::stop() {
  std::unique_lock lock(mutex_);
  running_ = false;
  wake_.notify_all();
  progress_.notify_all();
  progress_.wait(lock, [this] { return !stepping_; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

bool SimulationThread::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

void SimulationThread::run(std::uint64_t count) {
  std::unique_lock lock(mutex_);
  requested_ = count;
  wake_.notify_all();
  progress_.wait(lock, [this] { return requested_ == 0 && !stepping_; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

std::uint64_t SimulationThread::due(std::int64_t now_ns) const {
  return static_cast<std::uint64_t>(static_cast<double>(now_ns - start_ns_) * 1e-9 * rate_hz_);
}

void SimulationThread::wait_for_due() {
  if (policy_ == BlockPolicy::never) return;
  std::unique_lock lock(mutex_);
  const std::uint64_t target = due(core::now_ns());
  const std::uint64_t allowed_behind = policy_ == BlockPolicy::all ? 0 : 1;
  progress_.wait(lock, [&] { return !running_ || made_ + allowed_behind >= target; });
}

std::uint64_t SimulationThread::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::int64_t SimulationThread::epoch_ns() const {
  const std::lock_guard lock(mutex_);
  return epoch_ns_;
}

// Makes one step without the lock. False if it threw: the thread then rests.
bool SimulationThread::make_step(std::unique_lock<std::mutex>& lock) {
  stepping_ = true;
  lock.unlock();
  std::exception_ptr error;
  try {
    step_();
  } catch (...) {
    error = std::current_exception();
  }
  lock.lock();
  stepping_ = false;
  if (error) {
    error_ = error;
    running_ = false;
    requested_ = 0;
  }
  return !error;
}

void SimulationThread::keep_rate(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t due_now = due(core::now_ns());
  if (made_ >= due_now) {
    const auto next = static_cast<std::int64_t>(static_cast<double>(made_ + 1) / rate_hz_ * 1e9);
    wake_.wait_for(lock, std::chrono::nanoseconds(start_ns_ + next - core::now_ns()));
    return;
  }
  if (policy_ == BlockPolicy::never && due_now - made_ > 1) {
    // Late: the oldest steps that are due will never be made, and simulated time falls behind.
    const std::uint64_t late = due_now - made_ - 1;
    dropped_ += late;
    made_ += late;
    epoch_ns_ += static_cast<std::int64_t>(static_cast<double>(late) / rate_hz_ * 1e9);
  }
  if (make_step(lock)) ++made_;
  progress_.notify_all();
}

void SimulationThread::work() {
  std::unique_lock lock(mutex_);
  while (!quit_) {
    if (requested_ > 0) {
      if (make_step(lock) && requested_ > 0) --requested_;
      if (requested_ == 0) progress_.notify_all();
    } else if (running_) {
      keep_rate(lock);
    } else {
      progress_.notify_all();
      wake_.wait(lock, [this] { return quit_ || running_ || requested_ > 0; });
    }
  }
}

}  // namespace skerry::pipeline
