// The threading modes side by side on one scene: same scene, same seed, same work, proved by hashes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/measure/difference.h"
#include "apps/measure/frame_loop.h"
#include "apps/measure/statistics.h"
#include "apps/measure/step_analysis.h"
#include "apps/measure/strategy.h"

namespace skerry::measure {

struct CompareOptions {
  Axes axes;
  std::vector<double> host_ms = {0, 2, 4, 8, 12};
  HostShape host_shape = HostShape::serial;
  int reps = 5;               // of the frames, rows interleaved
  std::uint64_t steps = 30;   // timed, per repetition
  std::uint64_t warmup = 30;  // simulated first, so that a typical state is timed
  std::uint64_t frame_warmup =
      120;                       // steps before the frames: falling and the first impact are over
  std::uint64_t frames = 15;     // per repetition, row and host load; 0: no frame part
  bool other_schedulers = true;  // rows of the throughput part
  bool one_at_a_time = false;    // also frames with one setting changed at a time
  double detail_host_ms = 4;     // the nearest host load is shown in detail: timelines, settings
  bool sleep = false;
  // Repetitions of the steps: nearly twice as many, as they are short; odd, so that a median of
  // them is one that was seen.
  int step_reps() const { return 2 * reps - 1; }
  std::optional<int> substeps = std::nullopt;
  std::optional<double> dt = std::nullopt;
};

struct StageMeans {
  std::string name;
  double wall_ms = 0, cpu_ms = 0, tasks = 0;
};

// Means over the repetitions that count.
struct ThroughputRow {
  Strategy strategy;
  std::vector<double> rep_ms;      // mean step of each repetition, all of them
  Summary step_ms;                 // over the repetitions that count
  Estimate typical_ms;             // of a step: bootstrap_typical()
  Estimate speed_up;               // typical step of serial over this row's: bootstrap_ratio()
  double cpu_ms_per_step = 0;      // of the process
  double idle_ms_per_step = 0;     // of all workers: at barriers, for work, for wake-ups
  double blocked_ms_per_step = 0;  // of the caller
  double switches_per_step = 0, forced_switches_per_step = 0;
  double allocations_per_step = 0;
  double peak_mb = 0;    // that the world, its threads and its steps added
  double imbalance = 1;  // busiest worker over the mean
  double idle_cpu = 0;   // of one processor, with the world alive and no step running
  std::vector<StageMeans> stages;
  std::uint64_t state_hash = 0;
  std::optional<Difference> difference = std::nullopt;  // none: all hashes are serial's
};

struct FrameRow {
  Strategy strategy;
  double host_ms = 0;
  std::vector<FrameSamples> reps;  // those that count
  bool gave_up = false;            // a loop could not keep up and was ended early

  Repetitions values(std::vector<double> FrameSamples::*member) const;
  std::uint64_t frames() const;
  double missed_share() const;
};

// Repetitions in which others took part of the machine are left out of the figures as long as enough
// are left.
struct RepetitionCount {
  int made = 0;       // complete ones
  int disturbed = 0;  // among them
  int counted = 0;
  double steal = 0, others = 0;  // largest share of the machine in one repetition
};

struct SceneComparison {
  std::string scene;
  std::size_t bodies = 0, joints = 0;
  std::uint32_t contacts = 0, islands = 0, largest_island = 0;  // after the last timed step
  double dt = 0;
  int substeps = 0;
  std::uint64_t warmup = 0, steps = 0;
  HostShape host_shape = HostShape::serial;
  RepetitionCount throughput_reps;
  GraphBound bound;                       // of a step
  std::vector<ThroughputRow> throughput;  // serial first
  RepetitionCount frame_reps;             // a repetition and host load counts as one
  std::vector<FrameRow> frames;           // by host load
  std::vector<FrameRow> one_at_a_time;    // at one host load
  // The first that was seen in the frame part, if any.
  std::optional<Difference> frame_difference = std::nullopt;
  std::string frame_difference_row;
  std::vector<std::string> verdict;  // plain sentences

  bool equal() const;
};

// Scene events happen in the throughput part only: a dedicated thread steps when it is time, not
// when it is told.
SceneComparison compare_scene(const scenes::SceneDesc& scene, const CompareOptions& options,
                              HostLoad& host, const Watcher& watcher = {});

// The dedicated thread makes steps of 1/rate, so dt must be the reciprocal of a rate, to the bit.
double frame_dt(double dt);

}  // namespace skerry::measure
