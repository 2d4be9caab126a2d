#include "apps/measure/frame_loop.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "apps/measure/process_meter.h"
#include "apps/measure/statistics.h"
#include "apps/measure/step_log.h"

namespace skerry::measure {
namespace {

double ms_between(std::int64_t begin_ns, std::int64_t end_ns) {
  return 1e-6 * static_cast<double>(end_ns - begin_ns);
}

void sleep_until_ns(std::int64_t due_ns) {
  const std::int64_t left = due_ns - now_ns();
  if (left > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(left));
}

struct MainSpan {
  FrameSpan::Kind kind;
  const char* name;
  std::int64_t begin_ns, end_ns;
};

// What one frame says.
struct Frame {
  std::int64_t due_ns = 0, begin_ns = 0, end_ns = 0;
  double blocked_ms = 0, helped_ms = 0;
  double age_ms = -1;     // below 0: the same as the latency
  double shown_time = 0;  // s, simulated
  std::vector<MainSpan> spans;
  std::vector<jobs::TaskRecord> host_tasks;
};

class FrameLoop {
 public:
  FrameLoop(Session& session, StepLog& log, HostLoad& host, HostPool& pool,
            const FrameOptions& options)
      : session_(session),
        log_(log),
        host_(host),
        pool_(pool),
        options_(options),
        mode_(session.world().settings().mode),
        wake_ns_(static_cast<std::int64_t>(options.wake_ahead_ms * 1e6)),
        period_ns_(static_cast<std::int64_t>(session.dt() * 1e9)) {}

  FrameSamples run(const Watcher& watcher) {
    const std::uint64_t total = options_.warmup + options_.frames;
    frames_.reserve(total);
    pool_.record(options_.keep_typical);
    log_.start(options_.keep_typical);
    const std::uint64_t dropped_before = session_.world().dropped_steps();
    if (is_dedicated(mode_)) session_.world().start();
    const std::int64_t start =
        now_ns() + static_cast<std::int64_t>(options_.phase * static_cast<double>(period_ns_));
    for (std::uint64_t i = 1; i <= total; ++i) {
      if (watcher.stopped() || ms_between(start, now_ns()) > 1e3 * options_.max_seconds) break;
      if (i == options_.warmup + 1) begin_count();
      make_frame(start + static_cast<std::int64_t>(i) * period_ns_);
    }
    end_count();
    if (is_dedicated(mode_)) session_.world().stop();
    samples_.dropped_steps = session_.world().dropped_steps() - dropped_before;
    evaluate(log_.stop());
    return std::move(samples_);
  }

 private:
  void begin_count() {
    cpu_before_ = cpu_ms();
    switches_before_ = context_switches();
  }

  void end_count() {
    if (frames_.size() <= options_.warmup) return;
    samples_.cpu_ms = cpu_ms() - cpu_before_;
    const ContextSwitches switches = context_switches();
    samples_.voluntary_switches = switches.voluntary - switches_before_.voluntary;
    samples_.involuntary_switches = switches.involuntary - switches_before_.involuntary;
  }

  void make_frame(std::int64_t due_ns) {
    if (mode_ == ThreadingMode::job_system && wake_ns_ > 0) {  // its step begins with the frame
      sleep_until_ns(due_ns - wake_ns_);
      session_.world().wake_workers();
    }
    sleep_until_ns(due_ns);
    frame_ = {};
    frame_.due_ns = due_ns;
    frame_.begin_ns = now_ns();
    work();
    frame_.end_ns = now_ns();
    if (options_.keep_typical) frame_.host_tasks = pool_.take_tasks();
    frames_.push_back(std::move(frame_));
  }

  void work() {
    if (is_dedicated(mode_)) return frame_of_dedicated();
    if (mode_ == ThreadingMode::job_system) return frame_of_job_system();
    frame_of_caller();
  }

  template <class Work>
  void span(FrameSpan::Kind kind, const char* name, const Work& work) {
    const std::int64_t begin_ns = now_ns();
    work();
    if (options_.keep_typical) frame_.spans.push_back({kind, name, begin_ns, now_ns()});
  }

  double serial_ms() const {
    if (options_.host_shape == HostShape::serial) return options_.host_ms;
    return options_.host_shape == HostShape::jobs ? 0 : options_.host_ms / 2;
  }

  void host_work() {
    if (serial_ms() > 0) host_serial(serial_ms());
    host_jobs();
  }

  void host_serial(double ms) {
    span(FrameSpan::Kind::host, "host work", [&] { host_.run(ms); });
  }

  void host_jobs() {
    const double ms = options_.host_ms - serial_ms();
    if (ms <= 0) return;
    span(FrameSpan::Kind::wait, "host jobs", [&] { host_.run_jobs(ms, pool_); });
  }

  // Host jobs keep the workers warm; after serial work they are woken a little before it ends.
  void host_work_then_wake() {
    if (options_.host_shape == HostShape::jobs || wake_ns_ == 0 || mode_ == ThreadingMode::serial) {
      host_work();
    } else if (options_.host_shape == HostShape::mixed) {
      host_work();
      session_.world().wake_workers();
    } else {
      const double before = std::max(0.0, options_.host_ms - options_.wake_ahead_ms);
      span(FrameSpan::Kind::host, "host work", [&] {
        host_.run(before);
        session_.world().wake_workers();
        host_.run(options_.host_ms - before);
      });
    }
  }

  void frame_of_caller() {
    host_work_then_wake();
    StepReport report;
    span(FrameSpan::Kind::wait, "step", [&] { report = session_.advance(); });
    const bool serial = mode_ == ThreadingMode::serial;
    frame_.blocked_ms = serial ? 0 : report.blocked_ms;
    frame_.helped_ms = serial ? report.step_ms : report.helped_ms;
    show();
  }

  void frame_of_job_system() {
    PendingStep pending = session_.begin();
    host_work();
    StepReport report;
    span(FrameSpan::Kind::wait, "wait for step", [&] { report = session_.end(pending); });
    frame_.blocked_ms = report.blocked_ms;
    frame_.helped_ms = report.helped_ms;
    show();
  }

  void frame_of_dedicated() {
    host_work();
    const std::int64_t asked = now_ns();
    Snapshot snapshot;
    span(FrameSpan::Kind::wait, "wait for snapshot",
         [&] { snapshot = session_.world().latest(interpolated); });
    const std::int64_t taken = now_ns();
    span(FrameSpan::Kind::show, "show", [&] {
      double sum = 0;
      for (std::size_t i = 0; i < snapshot.bodies().size(); ++i) {
        sum += snapshot.pose(i).position.y();
      }
      shown_ = sum;
    });
    frame_.blocked_ms = ms_between(asked, taken);
    frame_.age_ms = 1e3 * snapshot.age() + ms_between(taken, now_ns());
    frame_.shown_time = snapshot.time();
  }

  void show() {
    span(FrameSpan::Kind::show, "show", [&] {
      double sum = 0;
      for (const Pose& pose : session_.world().transforms()) sum += pose.position.y();
      shown_ = sum;
    });
    frame_.shown_time = session_.world().time();
  }

  // ---- after the loop

  void evaluate(std::vector<LoggedStep> steps) {
    for (std::size_t i = options_.warmup; i < frames_.size(); ++i) {
      const Frame& frame = frames_[i];
      const double latency = ms_between(frame.due_ns, frame.end_ns);
      samples_.latency_ms.push_back(latency);
      samples_.state_age_ms.push_back(frame.age_ms < 0 ? latency : frame.age_ms);
      samples_.blocked_ms.push_back(frame.blocked_ms);
      samples_.helped_ms.push_back(frame.helped_ms);
      if (latency > ms_between(0, period_ns_)) ++samples_.missed;
    }
    if (samples_.frames() == 0) return;
    const std::int64_t from_ns = frames_[options_.warmup].begin_ns;
    for (const LoggedStep& step : steps) {
      if (step.begin_ns >= from_ns) samples_.step_ms.push_back(step.step_ms);
    }
    follow_inputs(steps);
    if (options_.keep_typical) samples_.typical = timeline_of(typical_frame(), steps);
  }

  void follow_inputs(const std::vector<LoggedStep>& steps) {
    std::size_t step = 0;
    std::size_t shown = options_.warmup;
    for (std::size_t i = options_.warmup; i < frames_.size(); ++i) {
      while (step < steps.size() && steps[step].begin_ns < frames_[i].begin_ns) ++step;
      if (step == steps.size()) return;
      shown = std::max(shown, i);
      while (shown < frames_.size() && frames_[shown].shown_time < steps[step].time - 1e-9) ++shown;
      if (shown == frames_.size()) return;
      samples_.input_ms.push_back(ms_between(frames_[i].due_ns, frames_[shown].end_ns));
    }
  }

  const Frame& typical_frame() const {
    const double middle = median(samples_.latency_ms);
    std::size_t best = 0;
    for (std::size_t i = 1; i < samples_.frames(); ++i) {
      if (std::abs(samples_.latency_ms[i] - middle) < std::abs(samples_.latency_ms[best] - middle))
        best = i;
    }
    return frames_[options_.warmup + best];
  }

  FrameTimeline timeline_of(const Frame& frame, const std::vector<LoggedStep>& steps) const {
    FrameTimeline timeline;
    timeline.latency_ms = ms_between(frame.due_ns, frame.end_ns);
    timeline.period_ms = ms_between(0, period_ns_);
    add_tracks(steps, timeline);
    for (const MainSpan& span : frame.spans) {
      timeline.spans.push_back({0, span.kind, span.name, ms_between(frame.due_ns, span.begin_ns),
                                ms_between(frame.due_ns, span.end_ns)});
    }
    const auto add = [&](const jobs::TaskRecord& task, FrameSpan::Kind kind, std::size_t track) {
      const double begin_ms = ms_between(frame.due_ns, task.begin_ns);
      const double end_ms = ms_between(frame.due_ns, task.end_ns);
      if (end_ms < 0 || begin_ms > std::max(timeline.period_ms, timeline.latency_ms)) return;
      timeline.spans.push_back(
          {track, kind, task.name, begin_ms, end_ms, task.first_item, task.item_count});
    };
    for (const jobs::TaskRecord& task : frame.host_tasks) {
      add(task, FrameSpan::Kind::host_job, task.worker);
    }
    for (const LoggedStep& step : steps) {
      for (const jobs::TaskRecord& task : step.tasks) {
        const bool on_thread = is_dedicated(mode_) && task.worker == 0;
        add(task, FrameSpan::Kind::physics, on_thread ? timeline.tracks.size() - 1 : task.worker);
      }
    }
    return timeline;
  }

  // Main, workers by index, and last the simulation thread.
  void add_tracks(const std::vector<LoggedStep>& steps, FrameTimeline& timeline) const {
    std::uint32_t workers = static_cast<std::uint32_t>(pool_.threads());
    if (options_.host_shape == HostShape::serial) workers = 1;
    for (const LoggedStep& step : steps) {
      for (const jobs::TaskRecord& task : step.tasks) {
        workers = std::max(workers, task.worker + 1);
      }
    }
    timeline.tracks.emplace_back("main thread");
    for (std::uint32_t i = 1; i < workers; ++i) {
      timeline.tracks.push_back("worker " + std::to_string(i));
    }
    if (is_dedicated(mode_)) timeline.tracks.emplace_back("simulation thread");
  }

  Session& session_;
  StepLog& log_;
  HostLoad& host_;
  HostPool& pool_;
  const FrameOptions& options_;
  ThreadingMode mode_;
  std::int64_t wake_ns_;
  std::int64_t period_ns_;
  double cpu_before_ = 0;
  ContextSwitches switches_before_;
  Frame frame_;
  std::vector<Frame> frames_;
  FrameSamples samples_;
  volatile double shown_ = 0;  // nobody looks at it, but the poses have been read
};

}  // namespace

const char* to_string(FrameSpan::Kind kind) {
  switch (kind) {
    case FrameSpan::Kind::host:
      return "host";
    case FrameSpan::Kind::host_job:
      return "host_job";
    case FrameSpan::Kind::physics:
      return "physics";
    case FrameSpan::Kind::wait:
      return "wait";
    case FrameSpan::Kind::show:
      break;
  }
  return "show";
}

FrameSamples run_frames(Session& session, StepLog& log, HostLoad& host, HostPool& pool,
                        const FrameOptions& options, const Watcher& watcher) {
  return FrameLoop(session, log, host, pool, options).run(watcher);
}

}  // namespace skerry::measure
