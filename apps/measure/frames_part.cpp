#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/measure/compare_parts.h"
#include "apps/measure/process_meter.h"
#include "apps/measure/step_log.h"

namespace skerry::measure {
namespace {

// At the beginning of a loop workers are cold and caches full of another world.
constexpr std::uint64_t kWarmupFrames = 3;

// One world per strategy goes through all repetitions.
struct FrameWorld {
  Strategy strategy;
  StepLog log;  // outlives the session
  std::unique_ptr<Session> session;
  std::unique_ptr<HostPool> pool;
};

// No mode has more threads than `most` that run at once, but for dedicated_thread_jobs, whose
// workers come on top of the main thread.
int host_threads(const Strategy& strategy, int most) {
  switch (strategy.mode) {
    case ThreadingMode::serial:
      return most;
    case ThreadingMode::dedicated_thread:
      return std::max(1, most - 1);
    default:
      return strategy.workers;
  }
}

class Frames {
 public:
  Frames(const scenes::SceneDesc& scene, const CompareOptions& options, HostLoad& host,
         SceneComparison& result)
      : scene_(scene), options_(options), host_(host), result_(result) {
    scene_.events.clear();
  }

  // All rows at all loads; a repetition of a load is a set of loops next to each other in time.
  void run(const std::vector<Strategy>& strategies, const std::vector<double>& host_ms,
           std::vector<FrameRow>& rows, bool timelines, const Watcher& watcher) {
    prepare(strategies, watcher);
    std::vector<std::vector<std::vector<FrameSamples>>> samples(  // [load][row][repetition]
        host_ms.size(), std::vector<std::vector<FrameSamples>>(strategies.size()));
    std::vector<std::vector<bool>> disturbed(host_ms.size());
    const double units = double(options_.reps) * double(host_ms.size());
    for (int rep = 0; rep < options_.reps; ++rep) {
      for (std::size_t load = 0; load < host_ms.size(); ++load) {
        const double done = double(rep) * double(host_ms.size()) + double(load);
        const Watcher part = watcher.part(done / units, (done + 1) / units);
        const bool keep = timelines && host_ms[load] == detail_load();
        if (!level(part)) return keep_rows(samples, disturbed, host_ms, rows);
        const MachineLoad machine;
        std::vector<FrameSamples> of_rep = run_load(rep, host_ms[load], keep, part);
        if (watcher.stopped()) return keep_rows(samples, disturbed, host_ms, rows);
        for (std::size_t row = 0; row < of_rep.size(); ++row) {
          samples[load][row].push_back(std::move(of_rep[row]));
        }
        disturbed[load].push_back(machine.disturbing());
        result_.frame_reps.steal = std::max(result_.frame_reps.steal, machine.steal());
        result_.frame_reps.others = std::max(result_.frame_reps.others, machine.others());
      }
    }
    level(watcher);
    keep_rows(samples, disturbed, host_ms, rows);
  }

  double detail_load() const {
    return *std::min_element(
        options_.host_ms.begin(), options_.host_ms.end(), [&](double a, double b) {
          return std::abs(a - options_.detail_host_ms) < std::abs(b - options_.detail_host_ms);
        });
  }

 private:
  void prepare(const std::vector<Strategy>& strategies, const Watcher& watcher) {
    worlds_.clear();
    int most = 1;
    for (const Strategy& strategy : strategies) most = std::max(most, strategy.workers);
    for (const Strategy& strategy : strategies) {
      auto& world = *worlds_.emplace_back(std::make_unique<FrameWorld>());
      world.strategy = strategy;
      WorldSettings settings = base_settings(scene_, options_, result_.dt);
      settings.record_tasks = true;
      settings.after_step = world.log.after_step();
      world.session = std::make_unique<Session>(scene_, settings, result_.dt, strategy);
      world.pool = std::make_unique<HostPool>(host_threads(strategy, most), strategy.wait,
                                              strategy.affinity);
      for (std::uint64_t i = 0; i < options_.warmup && !watcher.stopped(); ++i) {
        world.session->advance();
      }
    }
  }

  std::vector<FrameSamples> run_load(int rep, double host_ms, bool keep, const Watcher& watcher) {
    std::vector<FrameSamples> samples(worlds_.size());
    const double frames_s = result_.dt * static_cast<double>(options_.frames + kWarmupFrames);
    FrameOptions loop = {.host_ms = host_ms,
                         .host_shape = options_.host_shape,
                         .frames = options_.frames,
                         .warmup = kWarmupFrames,
                         .max_seconds = 2 * frames_s,
                         // Golden ratio: repetitions spread over the thread's period.
                         .phase = std::fmod(0.618034 * double(rep), 1.0),
                         .keep_typical = keep};
    for (std::size_t i = 0; i < worlds_.size() && !watcher.stopped(); ++i) {
      const std::size_t row = (i + static_cast<std::size_t>(rep)) % worlds_.size();
      FrameWorld& world = *worlds_[row];
      watcher.report(double(i) / double(worlds_.size()), "frames, " + world.strategy.label);
      loop.wake_ahead_ms = world.strategy.wake_ahead_ms;
      samples[row] = run_frames(*world.session, world.log, host_, *world.pool, loop, watcher);
    }
    return samples;
  }

  // Loops that were given up and dedicated threads made fewer or more steps than others: those
  // behind catch up, so that all see the same phase of the scene; then all must be equal. False if
  // it was stopped.
  bool level(const Watcher& watcher) {
    std::uint64_t furthest = 0;
    for (const auto& world : worlds_) {
      furthest = std::max(furthest, world->session->world().step_count());
    }
    for (const auto& world : worlds_) {
      while (world->session->world().step_count() < furthest) {
        if (watcher.stopped()) return false;
        world->session->advance();
      }
    }
    World& serial = worlds_.front()->session->world();
    for (const auto& world : worlds_) {
      World& other = world->session->world();
      if (result_.frame_difference || other.state_hash() == serial.state_hash()) continue;
      result_.frame_difference = {furthest, first_difference(other, serial)};
      result_.frame_difference_row = world->strategy.label;
    }
    return !watcher.stopped();
  }

  void keep_rows(std::vector<std::vector<std::vector<FrameSamples>>>& samples,
                 const std::vector<std::vector<bool>>& disturbed,
                 const std::vector<double>& host_ms, std::vector<FrameRow>& rows) {
    for (std::size_t load = 0; load < host_ms.size(); ++load) {
      const std::vector<bool> counts = repetitions_that_count(disturbed[load]);
      RepetitionCount& count = result_.frame_reps;
      count.made += static_cast<int>(counts.size());
      count.counted += static_cast<int>(std::count(counts.begin(), counts.end(), true));
      count.disturbed +=
          static_cast<int>(std::count(disturbed[load].begin(), disturbed[load].end(), true));
      if (counts.empty()) continue;
      for (std::size_t row = 0; row < worlds_.size(); ++row) {
        FrameRow& kept = rows.emplace_back();
        kept.strategy = worlds_[row]->strategy;
        kept.host_ms = host_ms[load];
        for (std::size_t rep = 0; rep < counts.size(); ++rep) {
          if (!counts[rep]) continue;
          FrameSamples& values = samples[load][row][rep];
          kept.gave_up = kept.gave_up || values.frames() < options_.frames;
          kept.reps.push_back(std::move(values));
        }
      }
    }
  }

  scenes::SceneDesc scene_;
  const CompareOptions& options_;
  HostLoad& host_;
  SceneComparison& result_;
  std::vector<std::unique_ptr<FrameWorld>> worlds_;
};

}  // namespace

void measure_frames(const scenes::SceneDesc& scene, const CompareOptions& options, HostLoad& host,
                    SceneComparison& result, const Watcher& watcher) {
  Frames frames(scene, options, host, result);
  const std::vector<Strategy> all = strategies(options.axes);
  const std::vector<Strategy> single = one_at_a_time(options.axes);
  const bool study = options.one_at_a_time && !single.empty();
  const double loads = static_cast<double>(options.host_ms.size()) * double(all.size());
  const double share = study ? loads / (loads + double(single.size())) : 1;
  frames.run(all, options.host_ms, result.frames, true, watcher.part(0, share));
  if (study && !watcher.stopped()) {
    frames.run(single, {frames.detail_load()}, result.one_at_a_time, false, watcher.part(share, 1));
  }
}

}  // namespace skerry::measure
