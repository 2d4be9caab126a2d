// A step in a steady state takes no memory, in any mode.
#include <gtest/gtest.h>

#include "apps/measure/process_meter.h"
#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

constexpr double kDt = 1.0 / 60;
constexpr int kSteps = 30;

// Many islands for groups, and one pile large enough to be solved wide; awake but at rest.
void add_piles(World& world) {
  add_floor(world);
  for (int i = 0; i < 60; ++i) {
    for (int k = 0; k < 3; ++k) add_box(world, {-40.0 + 1.3 * i, 0.5 + k, -20});
  }
  for (int i = 0; i < 1000; ++i) {
    add_box(world, {-12.5 + (i % 25), 0.5 + i / 250, 0.999 * (i / 25 % 10)});
  }
}

std::uint64_t allocations_in(World& world, int steps) {
  const std::uint64_t before = measure::allocation_count();
  for (int n = 0; n < steps; ++n) step(world, kDt);
  return measure::allocation_count() - before;
}

// Which worker meets which group is chance, and each brings buffers of its own: the state is steady
// once a round takes nothing. Without workers the first round must be.
class SteadyStep : public EveryMode {};

TEST_P(SteadyStep, a_resting_pile_is_stepped_without_allocations) {
  if (!measure::counts_allocations()) GTEST_SKIP() << "operator new is the sanitizer's";
  World world = make_world(GetParam(), {.sleep = {.enabled = false}});
  add_piles(world);
  allocations_in(world, 60);
  ASSERT_GT(world.last_report().contacts, 1000u);
  ASSERT_EQ(world.last_report().awake_bodies, 1180u);
  const int rounds = GetParam().workers == 1 ? 1 : 20;
  std::uint64_t allocated = 1;
  for (int round = 0; round < rounds && allocated > 0; ++round) {
    allocated = allocations_in(world, kSteps);
  }
  EXPECT_EQ(allocated, 0u) << "in the last of " << rounds << " rounds";
}
INSTANTIATE_TEST_SUITE_P(Allocations, SteadyStep, testing::ValuesIn(every_mode()), name_of);

TEST(Allocations, publishing_snapshots_takes_none) {
  if (!measure::counts_allocations()) GTEST_SKIP() << "operator new is the sanitizer's";
  World world({.mode = ThreadingMode::dedicated_thread, .sleep = {.enabled = false}});
  add_piles(world);
  Snapshot held = world.latest();
  const auto step_and_look = [&](int steps) {
    for (int n = 0; n < steps; ++n) {
      world.run_steps(1, kDt);
      held = world.latest();
    }
  };
  step_and_look(60);
  const std::uint64_t before = measure::allocation_count();
  step_and_look(kSteps);
  EXPECT_EQ(measure::allocation_count(), before);
}

}  // namespace
}  // namespace skerry::test
