// The threading modes side by side on one scene: same scene, same seed, same work, proved by hashes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/measure/frame_loop.h"
#include "apps/measure/statistics.h"

namespace skerry::measure {

struct CompareOptions {
  int workers = 0;  // 0: automatic
  std::vector<double> host_ms = {0, 2, 4, 8};
  int reps = 3;                          // of the throughput part, modes interleaved
  std::uint64_t steps = 60;              // timed, per repetition
  std::uint64_t warmup = 30;             // simulated first, so that a typical state is timed
  std::uint64_t frames = 90;             // of the frame part, per mode and host load; 0: leave out
  Affinity affinity = Affinity::spread;  // or the kernel's choice of core decides, not the mode
  WaitPolicy wait = {};
  bool sleep = false;
  std::optional<int> substeps = std::nullopt;
  std::optional<double> dt = std::nullopt;
};

struct ThroughputRow {
  ThreadingMode mode = ThreadingMode::serial;
  int workers = 1;
  Summary step_ms;             // over all repetitions
  std::vector<double> rep_ms;  // mean step of each repetition
  double speed_up = 0;         // of the median repetition, over serial
  double cpu_ms_per_step = 0;
  double allocations_per_step = 0;
  std::vector<StageTime> stages;  // of the last step
  std::uint64_t state_hash = 0;
  // The first step whose hash is not serial's; none: all are equal.
  std::optional<std::uint64_t> first_difference = std::nullopt;
};

struct FrameRow {
  ThreadingMode mode = ThreadingMode::serial;
  double host_ms = 0;
  FrameSamples samples;
};

struct SceneComparison {
  std::string scene;
  std::size_t bodies = 0, joints = 0;
  std::uint32_t contacts = 0, islands = 0, largest_island = 0;  // after the last timed step
  double dt = 0;
  int substeps = 0;
  std::uint64_t warmup = 0, steps = 0;
  int reps = 0;  // complete ones
  std::vector<ThroughputRow> throughput;
  std::vector<FrameRow> frames;
  // Of the worlds after the frame part, all brought to the same step: hashes equal, or which modes'
  // are not.
  std::vector<ThreadingMode> frame_differences;
  std::vector<std::string> verdict;  // plain sentences

  bool equal() const;
};

// Scene events happen in the throughput part only: a dedicated thread steps when it is time, not
// when it is told.
SceneComparison compare_scene(const scenes::SceneDesc& scene, const CompareOptions& options,
                              HostWork& host, const Watcher& watcher = {});

}  // namespace skerry::measure
