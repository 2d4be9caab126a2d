#include "apps/measure/compare.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/measure/process_meter.h"
#include "apps/measure/verdict.h"

namespace skerry::measure {
namespace {

WorldSettings settings_for(const scenes::SceneDesc& scene, const CompareOptions& options,
                           ThreadingMode mode, double dt) {
  WorldSettings settings = scenes::world_settings(scene);
  settings.mode = mode;
  settings.workers = options.workers;
  settings.rate_hz = 1 / dt;
  settings.affinity = options.affinity;
  settings.wait = options.wait;
  settings.sleep.enabled = options.sleep;
  if (options.substeps) settings.solver.substeps = *options.substeps;
  return settings;
}

// -- Throughput -------------------------------------------------------------------------------------

// What one mode has gathered over its repetitions.
struct ModeSamples {
  std::vector<double> step_ms;
  double cpu_ms = 0;
  std::uint64_t allocations = 0;
};

class Throughput {
 public:
  Throughput(const scenes::SceneDesc& scene, const CompareOptions& options, SceneComparison& result)
      : scene_(scene), options_(options), result_(result) {
    for (const ThreadingMode mode : kAllModes) {
      result.throughput.push_back(
          {.mode = mode, .workers = effective_workers(mode, options.workers)});
    }
  }

  void run(const Watcher& watcher) {
    for (int rep = 0; rep < options_.reps; ++rep) {
      for (std::size_t i = 0; i < kAllModes.size(); ++i) {
        const double done = rep + double(i) / double(kAllModes.size());
        watcher.report(done / options_.reps, std::string("throughput, ") + to_string(kAllModes[i]));
        if (!run_mode(i, watcher)) return finish();
      }
      ++result_.reps;
    }
    finish();
  }

 private:
  // False if it was stopped: the repetition then does not count.
  bool run_mode(std::size_t i, const Watcher& watcher) {
    ThroughputRow& row = result_.throughput[i];
    Session session(scene_, settings_for(scene_, options_, row.mode, result_.dt), result_.dt);
    for (std::uint64_t step = 0; step < options_.warmup; ++step) {
      if (watcher.stopped()) return false;
      session.advance();
      check_hash(session.world(), row);
    }
    ModeSamples rep;
    for (std::uint64_t step = 0; step < options_.steps; ++step) {
      if (watcher.stopped()) return false;
      time_step(session, rep);
      check_hash(session.world(), row);
    }
    keep(session.world(), rep, i);
    return true;
  }

  static void time_step(Session& session, ModeSamples& rep) {
    const double cpu_before = cpu_ms();
    const std::uint64_t allocations_before = allocation_count();
    const StepReport report = session.advance();
    rep.allocations += allocation_count() - allocations_before;
    rep.cpu_ms += cpu_ms() - cpu_before;
    rep.step_ms.push_back(report.step_ms);
  }

  // The first serial run writes the reference, every other run is held against it.
  void check_hash(const World& world, ThroughputRow& row) {
    const std::uint64_t step = world.step_count();
    const std::uint64_t hash = world.state_hash();
    if (step > reference_.size()) {
      reference_.push_back(hash);
    } else if (reference_[step - 1] != hash && !row.first_difference) {
      row.first_difference = step;
    }
  }

  void keep(World& world, const ModeSamples& rep, std::size_t i) {
    ThroughputRow& row = result_.throughput[i];
    ModeSamples& all = samples_[i];
    all.step_ms.insert(all.step_ms.end(), rep.step_ms.begin(), rep.step_ms.end());
    all.cpu_ms += rep.cpu_ms;
    all.allocations += rep.allocations;
    row.rep_ms.push_back(mean(rep.step_ms));
    row.state_hash = world.state_hash();
    const StepReport& last = world.last_report();
    row.stages.assign(last.stages().begin(), last.stages().end());
    result_.bodies = world.body_count();
    result_.joints = world.joint_count();
    result_.contacts = last.contacts;
    result_.islands = last.islands;
    result_.largest_island = last.largest_island;
  }

  void finish() {
    for (std::size_t i = 0; i < kAllModes.size(); ++i) {
      ThroughputRow& row = result_.throughput[i];
      const auto count = static_cast<double>(std::max<std::size_t>(1, samples_[i].step_ms.size()));
      row.step_ms = summarize(samples_[i].step_ms);
      row.cpu_ms_per_step = samples_[i].cpu_ms / count;
      row.allocations_per_step = static_cast<double>(samples_[i].allocations) / count;
      const double own = median(row.rep_ms);
      row.speed_up = own > 0 ? median(result_.throughput[0].rep_ms) / own : 0;
    }
  }

  const scenes::SceneDesc& scene_;
  const CompareOptions& options_;
  SceneComparison& result_;
  std::array<ModeSamples, kAllModes.size()> samples_;
  std::vector<std::uint64_t> reference_;  // [step - 1]
};

// -- Frames -----------------------------------------------------------------------------------------

class Frames {
 public:
  Frames(const scenes::SceneDesc& scene, const CompareOptions& options, SceneComparison& result)
      : scene_(scene), options_(options), result_(result) {
    scene_.events.clear();
  }

  void run(HostWork& host, const Watcher& watcher) {
    prepare(watcher);
    const std::size_t modes = sessions_.size();
    const std::size_t cells = modes * options_.host_ms.size();
    for (std::size_t cell = 0; cell < cells && !watcher.stopped(); ++cell) {
      Session& session = *sessions_[cell % modes];
      const double host_ms = options_.host_ms[cell / modes];
      const ThreadingMode mode = session.world().settings().mode;
      watcher.report(double(cell) / double(cells), std::string("frames, ") + to_string(mode));
      FrameOptions frame_options = {.host_ms = host_ms, .frames = options_.frames};
      frame_options.max_seconds = 2 * result_.dt * static_cast<double>(options_.frames);
      FrameSamples samples = run_frames(session, host, frame_options, watcher);
      if (!watcher.stopped()) result_.frames.push_back({mode, host_ms, std::move(samples)});
    }
    if (!watcher.stopped()) compare_states();
  }

 private:
  // One world per mode goes through all host loads, so that the modes see the same phase of the
  // scene at each.
  void prepare(const Watcher& watcher) {
    for (const ThreadingMode mode : kAllModes) {
      const WorldSettings settings = settings_for(scene_, options_, mode, result_.dt);
      sessions_.push_back(std::make_unique<Session>(scene_, settings, result_.dt));
      for (std::uint64_t i = 0; i < options_.warmup && !watcher.stopped(); ++i) {
        sessions_.back()->advance();
      }
    }
  }

  // Loops that were given up and dedicated threads made fewer or more steps than others: those
  // behind catch up, then all must be equal.
  void compare_states() {
    std::uint64_t furthest = 0;
    for (const auto& session : sessions_) {
      furthest = std::max(furthest, session->world().step_count());
    }
    for (const auto& session : sessions_) {
      while (session->world().step_count() < furthest) session->advance();
    }
    const std::uint64_t expected = sessions_.front()->world().state_hash();
    for (const auto& session : sessions_) {
      if (session->world().state_hash() == expected) continue;
      result_.frame_differences.push_back(session->world().settings().mode);
    }
  }

  scenes::SceneDesc scene_;
  const CompareOptions& options_;
  SceneComparison& result_;
  std::vector<std::unique_ptr<Session>> sessions_;
};

// The dedicated thread makes steps of 1/rate, so dt must be the reciprocal of a rate, to the bit.
double frame_dt(double dt) {
  return 1 / (std::abs(std::round(1 / dt) * dt - 1) < 1e-9 ? std::round(1 / dt) : 1 / dt);
}

}  // namespace

bool SceneComparison::equal() const {
  return frame_differences.empty() &&
         std::none_of(throughput.begin(), throughput.end(),
                      [](const ThroughputRow& row) { return row.first_difference.has_value(); });
}

SceneComparison compare_scene(const scenes::SceneDesc& scene, const CompareOptions& options,
                              HostWork& host, const Watcher& watcher) {
  SceneComparison result;
  result.scene = scene.name;
  result.dt = frame_dt(options.dt.value_or(scene.defaults.dt));
  result.substeps = options.substeps.value_or(scene.defaults.substeps);
  result.warmup = options.warmup;
  result.steps = options.steps;

  constexpr double kThroughputShare = 0.4;  // of the time, about
  Watcher first = watcher;
  first.progress = [&](double share, const std::string& what) {
    watcher.report(kThroughputShare * share, what);
  };
  Throughput(scene, options, result).run(first);
  if (options.frames > 0 && !options.host_ms.empty() && !watcher.stopped()) {
    Watcher second = watcher;
    second.progress = [&](double share, const std::string& what) {
      watcher.report(kThroughputShare + (1 - kThroughputShare) * share, what);
    };
    Frames(scene, options, result).run(host, second);
  }
  result.verdict = verdict_of(result);
  return result;
}

}  // namespace skerry::measure
