// How long a comparison will take, and how it is cut to fit a limit.
#pragma once

#include <string>
#include <vector>

#include "apps/measure/compare.h"

namespace skerry::measure {

// What a scene costs on this machine, found by trying (a few steps of the serial mode).
struct SceneCost {
  double build_s = 0;
  double step_s = 0;
  double hash_s = 0;
};
SceneCost probe(const scenes::SceneDesc& scene, const CompareOptions& options);

struct SceneSeconds {
  double throughput = 0, frames = 0;
  double total() const { return throughput + frames; }
};
SceneSeconds estimate(const SceneCost& cost, const CompareOptions& options, double dt = 1.0 / 60);

// What the user has fixed is not cut.
struct Fixed {
  bool reps = false, steps = false, frames = false;
};

struct Plan {
  std::vector<CompareOptions> options;  // [scene]
  std::vector<double> seconds;          // [scene], estimated
  double total_s = 0;
  // "repetitions cut from 5 to 4 to stay below 230 s"; empty: nothing was cut.
  std::string cut;
};

// Options for each scene. If the whole would take longer than `limit_s`: fewer frames, then fewer
// repetitions (three at least), then fewer steps, the same for all scenes.
Plan make_plan(const std::vector<SceneCost>& costs, std::vector<CompareOptions> options,
               const Fixed& fixed, double limit_s);

}  // namespace skerry::measure
