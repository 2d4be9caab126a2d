// Scenes of the catalogue give the serial bits: the common ones in every mode with 1, 2 and 4 workers,
// jointed and stirred ones in every kind of mode. Short runs.
#include <gtest/gtest.h>

#include "scenes/catalogue.h"
#include "tests/support/every_mode.h"
#include "tests/support/rounds.h"

namespace skerry::test {
namespace {

struct Run {
  const char* scene;
  int steps;
};

std::vector<std::uint64_t> hashes_of(const Run& run, const ModeAndWorkers& mode) {
  const scenes::SceneDesc scene = scenes::make_scene(run.scene);
  World world = make_world(mode, scenes::world_settings(scene));
  scenes::BuiltScene built = scenes::build(scene, world);
  std::vector<std::uint64_t> hashes;
  const int steps = rounds(run.steps);
  for (int n = 1; n <= steps; ++n) {
    scenes::apply_events(scene, built, world, world.step_count() + 1);
    step(world, scene.defaults.dt);
    if (n % 5 == 0 || n == steps) hashes.push_back(world.state_hash());
  }
  return hashes;
}

class CommonScene : public testing::TestWithParam<Run> {};

TEST_P(CommonScene, gives_the_serial_bits_with_1_2_and_4_workers) {
  const std::vector<std::uint64_t> serial = hashes_of(GetParam(), {});
  for (const ModeAndWorkers& mode : every_mode()) {
    if (mode.mode == ThreadingMode::serial || mode.workers == 3 || mode.workers == 8) continue;
    EXPECT_EQ(hashes_of(GetParam(), mode), serial) << to_string(mode.mode) << ' ' << mode.workers;
  }
}
INSTANTIATE_TEST_SUITE_P(Determinism, CommonScene,
                         testing::Values(Run{"large_pyramid", 30}, Run{"many_pyramids", 20},
                                         Run{"islands", 20}, Run{"box_pile", 60},
                                         Run{"box_bricks", 60}, Run{"sphere_rain", 60},
                                         Run{"convex_pile", 60}),
                         [](const auto& given) { return std::string(given.param.scene); });

class SceneInEveryMode : public testing::TestWithParam<Run> {};

TEST_P(SceneInEveryMode, gives_the_serial_bits) {
  const std::vector<std::uint64_t> serial = hashes_of(GetParam(), {});
  for (const ModeAndWorkers& mode :
       {ModeAndWorkers{ThreadingMode::fork_join, 2}, ModeAndWorkers{ThreadingMode::job_system, 3},
        ModeAndWorkers{ThreadingMode::dedicated_thread_jobs, 2}}) {
    EXPECT_EQ(hashes_of(GetParam(), mode), serial) << to_string(mode.mode);
  }
}
INSTANTIATE_TEST_SUITE_P(Determinism, SceneInEveryMode,
                         testing::Values(Run{"ragdoll_rain", 130}, Run{"bridge", 120},
                                         Run{"joint_grid", 10}, Run{"washer", 20},
                                         Run{"junkyard", 20}),
                         [](const auto& given) { return std::string(given.param.scene); });

}  // namespace
}  // namespace skerry::test
