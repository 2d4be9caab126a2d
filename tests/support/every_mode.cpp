#include "tests/support/every_mode.h"

namespace skerry::test {

std::vector<ModeAndWorkers> every_mode() {
  std::vector<ModeAndWorkers> all = {{ThreadingMode::serial, 1},
                                     {ThreadingMode::dedicated_thread, 1}};
  for (const ThreadingMode mode : {ThreadingMode::fork_join, ThreadingMode::job_system,
                                   ThreadingMode::dedicated_thread_jobs}) {
    for (const int workers : {1, 2, 3, 4, 8}) all.push_back({mode, workers});
  }
  return all;
}

std::string name_of(const testing::TestParamInfo<ModeAndWorkers>& info) {
  return std::string(to_string(info.param.mode)) + "_" + std::to_string(info.param.workers);
}

World make_world(const ModeAndWorkers& param, WorldSettings settings) {
  settings.mode = param.mode;
  settings.workers = param.workers;
  return World(settings);
}

StepReport step(World& world, double dt) { return world.run_steps(1, dt); }

}  // namespace skerry::test
