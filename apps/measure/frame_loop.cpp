#include "apps/measure/frame_loop.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "apps/measure/process_meter.h"

namespace skerry::measure {
namespace {

double ms_since(std::int64_t begin_ns) { return 1e-6 * static_cast<double>(now_ns() - begin_ns); }

void sleep_until_ns(std::int64_t due_ns) {
  const std::int64_t left = due_ns - now_ns();
  if (left > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left));
}

// What one frame says beyond its latency; age < 0: the same as the latency.
struct FrameTimes {
  double blocked_ms = 0, helped_ms = 0, age_ms = -1;
};

class FrameLoop {
 public:
  FrameLoop(Session& session, HostWork& host, const FrameOptions& options)
      : session_(session),
        host_(host),
        options_(options),
        mode_(session.world().settings().mode),
        wake_ns_(static_cast<std::int64_t>(options.wake_ahead_ms * 1e6)) {}

  FrameSamples run(const Watcher& watcher) {
    const auto period_ns = static_cast<std::int64_t>(session_.dt() * 1e9);
    reserve();
    if (is_dedicated(mode_)) session_.world().start();
    const double cpu_before = cpu_ms();
    const std::int64_t start = now_ns();
    for (std::uint64_t frame = 1; frame <= options_.frames; ++frame) {
      if (watcher.stopped() || ms_since(start) > 1e3 * options_.max_seconds) break;
      make_frame(start + static_cast<std::int64_t>(frame) * period_ns, period_ns);
    }
    samples_.cpu_ms = cpu_ms() - cpu_before;
    if (is_dedicated(mode_)) {
      session_.world().stop();
      samples_.dropped_steps = session_.world().dropped_steps();
    }
    return std::move(samples_);
  }

 private:
  void reserve() {
    for (auto* values : {&samples_.latency_ms, &samples_.state_age_ms, &samples_.blocked_ms,
                         &samples_.helped_ms}) {
      values->reserve(options_.frames);
    }
  }

  void make_frame(std::int64_t due_ns, std::int64_t period_ns) {
    if (mode_ == ThreadingMode::job_system) {  // its step begins with the frame
      sleep_until_ns(due_ns - wake_ns_);
      session_.world().wake_workers();
    }
    sleep_until_ns(due_ns);
    const FrameTimes times = work();
    const double latency = ms_since(due_ns);
    samples_.latency_ms.push_back(latency);
    samples_.state_age_ms.push_back(times.age_ms < 0 ? latency : times.age_ms);
    samples_.blocked_ms.push_back(times.blocked_ms);
    samples_.helped_ms.push_back(times.helped_ms);
    if (latency > 1e-6 * static_cast<double>(period_ns)) ++samples_.missed;
  }

  FrameTimes work() {
    if (is_dedicated(mode_)) return frame_of_dedicated();
    if (mode_ == ThreadingMode::job_system) return frame_of_job_system();
    return frame_of_caller();
  }

  FrameTimes frame_of_caller() {
    const double before_wake = std::max(0.0, options_.host_ms - options_.wake_ahead_ms);
    host_.run(before_wake);
    session_.world().wake_workers();
    host_.run(options_.host_ms - before_wake);
    const StepReport report = session_.advance();
    show();
    const double helped = mode_ == ThreadingMode::serial ? report.step_ms : report.helped_ms;
    return {mode_ == ThreadingMode::serial ? 0 : report.blocked_ms, helped};
  }

  FrameTimes frame_of_job_system() {
    PendingStep pending = session_.begin();
    host_.run(options_.host_ms);
    const StepReport report = session_.end(pending);
    show();
    return {report.blocked_ms, report.helped_ms};
  }

  FrameTimes frame_of_dedicated() {
    host_.run(options_.host_ms);
    const std::int64_t asked = now_ns();
    const Snapshot snapshot = session_.world().latest(interpolated);
    const std::int64_t taken = now_ns();
    double sum = 0;
    for (std::size_t i = 0; i < snapshot.bodies().size(); ++i) sum += snapshot.pose(i).position.y();
    shown_ = sum;
    return {1e-6 * static_cast<double>(taken - asked), 0, 1e3 * snapshot.age() + ms_since(taken)};
  }

  void show() {
    double sum = 0;
    for (const Pose& pose : session_.world().transforms()) sum += pose.position.y();
    shown_ = sum;
  }

  Session& session_;
  HostWork& host_;
  const FrameOptions& options_;
  ThreadingMode mode_;
  std::int64_t wake_ns_;
  FrameSamples samples_;
  volatile double shown_ = 0;  // nobody looks at it, but the poses have been read
};

}  // namespace

void FrameSamples::append(const FrameSamples& other) {
  const auto add = [](std::vector<double>& to, const std::vector<double>& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  add(latency_ms, other.latency_ms);
  add(state_age_ms, other.state_age_ms);
  add(blocked_ms, other.blocked_ms);
  add(helped_ms, other.helped_ms);
  cpu_ms += other.cpu_ms;
  missed += other.missed;
  dropped_steps += other.dropped_steps;
}

FrameSamples run_frames(Session& session, HostWork& host, const FrameOptions& options,
                        const Watcher& watcher) {
  return FrameLoop(session, host, options).run(watcher);
}

}  // namespace skerry::measure
