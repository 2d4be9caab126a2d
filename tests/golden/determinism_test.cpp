// The same bits in every mode, for every worker count, whatever order and delay tasks meet.
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "pipeline/threading_mode.h"
#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"
#include "tests/support/shuffling_executor.h"

namespace skerry::test {
namespace {

constexpr int kSteps = 600;

// Debug builds and sanitizers take the first part of the same run.
int steps() {
  const char* given = std::getenv("SKERRY_TEST_STEPS");
  return given ? std::atoi(given) : kSteps;
}

std::vector<std::uint64_t> hashes_of(World& world, int count) {
  BusyScene scene(world);
  std::vector<std::uint64_t> hashes;
  for (int n = 0; n < count; ++n) {
    scene.advance(world, n);
    hashes.push_back(world.state_hash());
  }
  return hashes;
}

const std::vector<std::uint64_t>& serial_hashes() {
  static const std::vector<std::uint64_t> hashes = [] {
    World world;
    return hashes_of(world, steps());
  }();
  return hashes;
}

// Index of the first step that differs, or -1.
int first_difference(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b) {
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (a[i] != b[i]) return static_cast<int>(i);
  }
  return -1;
}

void expect_serial_hashes(World& world, int count) {
  const int step = first_difference(hashes_of(world, count), serial_hashes());
  EXPECT_EQ(step, -1) << "the first step that differs";
}

// What the scene of the determinism rows ends in, after so many steps. The same for gcc and clang,
// debug and release, every SIMD width. Changes only in a commit that says why.
const std::map<int, std::uint64_t> kGolden = {
#include "tests/golden/golden_hashes.inc"
};

TEST(Golden, busy_scene_reaches_the_recorded_hash) {
  const auto& hashes = serial_hashes();
  int checked = 0;
  for (const auto& [step, hash] : kGolden) {
    if (step > static_cast<int>(hashes.size())) continue;
    EXPECT_EQ(hashes[static_cast<std::size_t>(step - 1)], hash) << "after step " << step;
    ++checked;
  }
  EXPECT_GT(checked, 0);
}

TEST_P(EveryMode, gives_the_serial_bits_at_every_step) {
  World world = make_world(GetParam());
  expect_serial_hashes(world, steps());
}
INSTANTIATE_TEST_SUITE_P(Determinism, EveryMode, testing::ValuesIn(every_mode()), name_of);

class ShuffledSeed : public testing::TestWithParam<std::uint32_t> {};

TEST_P(ShuffledSeed, order_of_tasks_changes_no_bit) {
  const pipeline::ExecutorOverride shuffled([](const WorldSettings&) {
    return std::make_unique<ShufflingExecutor>(
        Shuffle{.seed = GetParam(), .workers = 1 + GetParam() % 5});
  });
  World world;
  expect_serial_hashes(world, steps() / 2);
}
INSTANTIATE_TEST_SUITE_P(Determinism, ShuffledSeed, testing::Range(1u, 7u));

TEST(Determinism, stress_random_delays_in_tasks_change_no_bit) {
  const char* given = std::getenv("SKERRY_TEST_DELAY_RUNS");
  const int runs = given ? std::atoi(given) : 6;
  for (int run = 0; run < runs; ++run) {
    const pipeline::ExecutorOverride delayed([run](const WorldSettings&) {
      return std::make_unique<ShufflingExecutor>(Shuffle{
          .seed = 1000u + static_cast<std::uint32_t>(run), .workers = 4, .longest_sleep_us = 200});
    });
    World world;
    expect_serial_hashes(world, std::min(steps(), 200));
  }
}

// Real threads, all of them ours: what ThreadSanitizer can see.
TEST(Determinism, std_thread_workers_give_the_serial_bits) {
  const pipeline::ExecutorOverride threads([](const WorldSettings&) {
    return jobs::make_executor(jobs::ExecutorKind::threads, {.workers = 3});
  });
  World world;
  expect_serial_hashes(world, std::min(steps(), 150));
}

TEST(Determinism, a_far_pile_changes_no_bit_of_another) {
  const auto run = [](bool with_far_pile, bool far_first) {
    World world;
    add_floor(world, 0.6, 0, 400);
    const auto pile = [&](double x) {
      std::vector<BodyId> bodies;
      for (int i = 0; i < 40; ++i) {
        bodies.push_back(add_box(world, {x + 0.07 * (i % 3), 0.6 + i * 1.05, 0.05 * (i % 4)}));
      }
      return bodies;
    };
    if (with_far_pile && far_first) pile(300);
    const std::vector<BodyId> watched = pile(0);
    if (with_far_pile && !far_first) pile(300);
    for (int n = 0; n < 240; ++n) world.step(1.0 / 60);
    std::vector<double> state;
    for (const BodyId body : watched) {
      const Pose pose = world.pose(body);
      for (const double v :
           {pose.position.x(), pose.position.y(), pose.position.z(), pose.orientation.x(),
            pose.orientation.w(), world.angular_velocity(body).x()}) {
        state.push_back(v);
      }
    }
    return state;
  };
  const std::vector<double> alone = run(false, false);
  EXPECT_EQ(alone, run(true, false));
  EXPECT_EQ(alone, run(true, true));
}

TEST(Determinism, chains_between_piles_change_no_bit_of_them) {
  const auto run = [](bool with_chains) {
    World world;
    add_floor(world, 0.6, 0, 400);
    std::vector<BodyId> watched;
    for (int p = 0; p < 6; ++p) {
      if (with_chains) {  // its bodies, hence its island, lie between those of the piles
        const Vec3 anchor(10.0 * p + 5, 4, 0);
        const BodyId link = add_box(world, anchor, {0.2, 0.2, 0.2});
        world.add_joint(BallJoint{.a = link,
                                  .b = add_box(world, anchor + Vec3(0.6, 0, 0)),
                                  .anchor = anchor + Vec3(0.3, 0, 0)});
      }
      for (int k = 0; k < 4; ++k) {
        watched.push_back(add_box(world, {10.0 * p + 0.1 * k, 0.5 + 1.01 * k, 0.07 * k}));
      }
    }
    for (int n = 0; n < 120; ++n) world.step(1.0 / 60);
    std::vector<double> state;
    for (const BodyId body : watched) {
      const Vec3 position = world.pose(body).position, spin = world.angular_velocity(body);
      for (int k = 0; k < 3; ++k) {
        state.push_back(position[k]);
        state.push_back(spin[k]);
      }
    }
    return state;
  };
  EXPECT_EQ(run(false), run(true));
}

}  // namespace
}  // namespace skerry::test
