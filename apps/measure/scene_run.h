// One scene, one mode: every step timed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/measure/session.h"

namespace skerry::measure {

struct RunOptions {
  WorldSettings settings = {};   // complete: scenes::world_settings() and what the user changed
  double dt = 1.0 / 60;          // s
  std::uint64_t warmup = 0;      // steps made first, not timed
  std::uint64_t steps = 0;       // timed
  std::uint64_t hash_every = 0;  // 0: only at the end
  bool keep_tasks = false;       // for a trace; needs WorldSettings::record_tasks
};

struct StepHash {
  std::uint64_t step = 0;  // counted from the beginning of the world
  std::uint64_t hash = 0;
};

struct StageMean {
  std::string name;
  double wall_ms = 0;
};

struct StepTasks {
  std::uint64_t step = 0;
  std::int64_t begin_ns = 0, end_ns = 0;  // of the step; monotonic clock
  std::vector<jobs::TaskRecord> tasks;
};

// Over the timed steps, with WorldSettings::measure_steps.
struct RunMeasures {
  std::uint64_t steps = 0;
  double penetration_mean = 0, penetration_max = 0;  // m: mean of the steps' means, worst of all
  double energy_first = 0, energy_last = 0;          // J, kinetic and potential
  double energy_lost = 0;                            // J, in contacts, all steps together
  ContactLaw law = {};  // means of the steps that had contacts, worst of all
  std::uint64_t law_steps = 0;
};

struct RunResult {
  std::vector<double> step_ms;    // [timed steps]
  std::vector<StageMean> stages;  // in step order
  double cpu_ms = 0;              // of the process, over the timed steps
  std::uint64_t allocations = 0;  // over the timed steps
  StepReport last = {};
  std::size_t bodies = 0;
  Measures measures = {};  // at the end
  RunMeasures measured = {};
  std::uint64_t state_hash = 0;  // at the end, so after warmup + steps
  std::vector<StepHash> hashes;
  std::vector<std::string> warnings;  // each once, with how often it came
  std::vector<StepTasks> tasks;
  bool interrupted = false;
};

RunResult run_scene(const scenes::SceneDesc& scene, const RunOptions& options,
                    const Watcher& watcher = {});

}  // namespace skerry::measure
