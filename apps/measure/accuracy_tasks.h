// The accuracy tasks of scenes/sim_benchmark.cpp, run and judged as their authors did.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <skerry/settings.h>

namespace skerry::measure {

struct AccuracyTask {
  const char* scene = "";
  double dt = 0;            // s
  const char* unit = "";    // of the error
  const char* others = "";  // what published engines reach at this dt, best first
};

// Every task at the time steps that were published.
std::span<const AccuracyTask> accuracy_tasks();

struct AccuracyResult {
  // rolling: mean over the steps of |dv of the plate|^2 + |dv of the balls|^2 (mean of the balls),
  // (m/s)^2, against the closed form. bouncing, 666_elastic: root mean square of the energy's error,
  // % of its true value. 666: mean over the steps of the sum of squared overlaps, m^2. boxes: greatest
  // |change of L| / |L|. kapla: steps until the last brick lies below 1 m, or all of them.
  double error = 0;
  double step_ms = 0;  // mean wall time
};

// `steps` 0: as many as the task has. Default settings but for the solver; one worker.
AccuracyResult run_accuracy_task(const AccuracyTask& task,
                                 SolverKind solver = SolverKind::soft_step_tgs,
                                 std::uint64_t steps = 0);

}  // namespace skerry::measure
