#include "apps/measure/compare.h"

#include <algorithm>
#include <cmath>

#include "apps/measure/compare_parts.h"
#include "apps/measure/plan.h"
#include "apps/measure/verdict.h"

namespace skerry::measure {

WorldSettings base_settings(const scenes::SceneDesc& scene, const CompareOptions& options,
                            double dt) {
  WorldSettings settings = scenes::world_settings(scene);
  settings.rate_hz = 1 / dt;
  settings.sleep.enabled = options.sleep;
  if (options.substeps) settings.solver.substeps = *options.substeps;
  return settings;
}

double frame_dt(double dt) {
  return 1 / (std::abs(std::round(1 / dt) * dt - 1) < 1e-9 ? std::round(1 / dt) : 1 / dt);
}

std::vector<bool> repetitions_that_count(const std::vector<bool>& disturbed) {
  const auto quiet =
      static_cast<std::size_t>(std::count(disturbed.begin(), disturbed.end(), false));
  std::vector<bool> counts(disturbed.size(), true);
  if (quiet < 3 || 2 * quiet <= disturbed.size()) return counts;
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = !disturbed[i];
  return counts;
}

Repetitions FrameRow::values(std::vector<double> FrameSamples::*member) const {
  Repetitions all;
  for (const FrameSamples& rep : reps) all.push_back(rep.*member);
  return all;
}

std::uint64_t FrameRow::frames() const {
  std::uint64_t sum = 0;
  for (const FrameSamples& rep : reps) sum += rep.frames();
  return sum;
}

double FrameRow::missed_share() const {
  double missed = 0;
  for (const FrameSamples& rep : reps) missed += static_cast<double>(rep.missed);
  return frames() > 0 ? missed / static_cast<double>(frames()) : 0;
}

bool SceneComparison::equal() const {
  return !frame_difference && std::none_of(throughput.begin(), throughput.end(),
                                           [](const ThroughputRow& row) { return row.difference; });
}

SceneComparison compare_scene(const scenes::SceneDesc& scene, const CompareOptions& options,
                              HostLoad& host, const Watcher& watcher) {
  SceneComparison result;
  result.scene = scene.name;
  result.dt = frame_dt(options.dt.value_or(scene.defaults.dt));
  result.substeps = options.substeps.value_or(scene.defaults.solver.substeps);
  result.warmup = options.warmup;
  result.steps = options.steps;
  result.host_shape = options.host_shape;

  const SceneCost cost = watcher.progress ? probe(scene, options) : SceneCost{};
  const SceneSeconds seconds = estimate(cost, options);
  const double share = seconds.total() > 0 ? seconds.throughput / seconds.total() : 0.5;
  measure_throughput(scene, options, result, watcher.part(0, share));
  if (options.frames > 0 && !options.host_ms.empty() && !watcher.stopped()) {
    measure_frames(scene, options, host, result, watcher.part(share, 1));
  }
  result.verdict = verdict_of(result);
  return result;
}

}  // namespace skerry::measure
