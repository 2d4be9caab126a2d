// The accuracy tasks of SimBenchmark and benchmark/boxes (scenes/sim_benchmark.cpp), with what other
// engines reached in print beside them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "apps/measure/accuracy_tasks.h"
#include "scenes/scene.h"

int main(int argc, char** argv) {
  std::vector<std::string> scenes;
  std::vector<std::string> solvers = {"soft_step_tgs"};
  std::uint64_t steps = 0;
  CLI::App app("Runs public accuracy tasks and prints published figures beside.");
  app.add_option("--scenes", scenes, "names, separated by commas; default: all")->delimiter(',');
  app.add_option("--solvers", solvers, "soft_step_tgs, pgs, penalty")
      ->delimiter(',')
      ->check(CLI::IsMember({"soft_step_tgs", "pgs", "penalty"}));
  app.add_option("--steps", steps, "at most so many; 0: as many as the task has");
  CLI11_PARSE(app, argc, argv);
  fmt::print("{:<16} {:>8} {:<14} {:>12} {:<8} {:>8}  {}\n", "task", "dt", "solver", "error",
             "unit", "ms/step", "published");
  for (const auto& task : skerry::measure::accuracy_tasks()) {
    if (!scenes.empty() && std::find(scenes.begin(), scenes.end(), task.scene) == scenes.end())
      continue;
    for (const skerry::SolverKind solver : skerry::scenes::kSolverKinds) {
      if (std::find(solvers.begin(), solvers.end(), to_string(solver)) == solvers.end()) continue;
      const auto result = skerry::measure::run_accuracy_task(task, solver, steps);
      fmt::print("{:<16} {:>8g} {:<14} {:>12.4g} {:<8} {:>8.4f}  {}\n", task.scene, task.dt,
                 to_string(solver), result.error, task.unit, result.step_ms, task.others);
      std::fflush(stdout);
    }
  }
}
