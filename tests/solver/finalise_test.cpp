// Flags, sleep timers, falling asleep and waking as a unit.
#include "solver/finalise.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/solver/hand_made_world.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;

// Lays out islands and free bodies by hand, runs the two stages.
struct SleepWorld : HandMadeWorld {
  void island(const std::vector<BodyIndex>& members) {
    core::Island row;
    row.first_body = static_cast<std::uint32_t>(islands.bodies.size());
    row.body_count = static_cast<std::uint32_t>(members.size());
    row.first_contact = static_cast<std::uint32_t>(islands.contacts.size());
    islands.bodies.insert(islands.bodies.end(), members.begin(), members.end());
    islands.islands.push_back(row);
  }
  // Appends a contact to the last island.
  void contact(BodyIndex a, BodyIndex b) {
    core::ContactPair pair;
    pair.body_a = a;
    pair.body_b = b;
    islands.contacts.push_back({0, static_cast<std::uint32_t>(contacts.pairs.size())});
    contacts.pairs.push_back(pair);
    ++islands.islands.back().contact_count;
  }
  void steps(int count) {
    LoneTask task;
    for (int i = 0; i < count; ++i) {
      const auto island_count = static_cast<std::uint32_t>(islands.islands.size());
      const auto free_count = static_cast<std::uint32_t>(islands.free_bodies.size());
      islands.groups = {{core::GroupKind::packed, 0, island_count},
                        {core::GroupKind::free, 0, free_count}};
      finalise_bodies(context(), {0, 2}, task);
      update_sleep(context(), {0, 1}, task);
      forget_sleepers();
    }
  }
  // As build_islands does: what sleeps is in no island.
  void forget_sleepers() {
    std::erase_if(islands.islands, [this](const core::Island& island) {
      return bodies.sleep_island[islands.bodies[island.first_body]] != core::kNone;
    });
    std::erase_if(islands.free_bodies,
                  [this](BodyIndex body) { return bodies.sleep_island[body] != core::kNone; });
  }
  bool awake(BodyIndex body) const { return bodies.is(body, core::kAwake); }
};

TEST(Sleep, an_island_sleeps_as_a_unit_after_the_set_time) {
  SleepWorld world;
  const BodyIndex a = world.add({.linear = {0.04, 0, 0}});
  const BodyIndex b = world.add({.linear = {-0.04, 0, 0}, .angular = {0, 0.04, 0}});
  const BodyIndex c = world.add({.linear = {0, 1, 0}});
  world.island({a, b});
  world.island({c});
  world.steps(29);
  EXPECT_TRUE(world.awake(a));
  world.steps(2);
  EXPECT_FALSE(world.awake(a));
  EXPECT_FALSE(world.awake(b));
  EXPECT_TRUE(world.awake(c));
  EXPECT_TRUE(world.bodies.motion[a].linear.isZero(0));
  EXPECT_TRUE(world.bodies.motion[b].angular_momentum.isZero(0));
  EXPECT_TRUE(world.bodies.awake_stale);
  ASSERT_EQ(world.bodies.sleep_island[a], 0u);
  EXPECT_EQ(world.sleepers.islands[0], (std::vector<BodyIndex>{a, b}));
}

TEST(Sleep, a_small_body_may_turn_faster_as_long_as_its_surface_is_slow) {
  SleepWorld world;
  const BodyIndex slow = world.add({.angular = {0, 0.45, 0}});
  const BodyIndex fast = world.add({.angular = {0, 0.55, 0}});
  world.bodies.mass[slow].radius = world.bodies.mass[fast].radius = 0.1;
  world.island({slow});
  world.island({fast});
  world.steps(40);
  EXPECT_FALSE(world.awake(slow));
  EXPECT_TRUE(world.awake(fast));
}

TEST(Sleep, one_restless_member_keeps_the_island_awake) {
  SleepWorld world;
  const BodyIndex a = world.add({});
  const BodyIndex fast = world.add({.linear = {0.06, 0, 0}});
  const BodyIndex b = world.add({});
  const BodyIndex never = world.add({.flags = core::kDynamic | core::kAwake});
  world.island({a, fast});
  world.island({b, never});
  world.steps(100);
  for (const BodyIndex body : {a, fast, b, never}) EXPECT_TRUE(world.awake(body)) << body;
}

TEST(Sleep, contact_with_a_moving_kinematic_body_keeps_an_island_awake) {
  SleepWorld world;
  const BodyIndex still = world.add_kinematic(Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
  world.bodies.flags[still] &= ~core::kAwake;
  const BodyIndex moving = world.add_kinematic(Vec3::Zero(), {0.001, 0, 0}, Vec3::Zero());
  const BodyIndex a = world.add({}), b = world.add({});
  world.island({a});
  world.contact(a, still);
  world.island({b});
  world.contact(moving, b);
  world.steps(40);
  EXPECT_FALSE(world.awake(a));
  EXPECT_TRUE(world.awake(b));
}

TEST(Sleep, a_joint_to_a_moving_kinematic_body_keeps_an_island_awake) {
  SleepWorld world;
  const BodyIndex moving = world.add_kinematic(Vec3::Zero(), {0.001, 0, 0}, Vec3::Zero());
  const BodyIndex a = world.add({});
  world.joints.rows.push_back({.a = moving, .b = a});
  world.island({a});
  world.islands.joints.push_back(0);
  world.islands.islands.back().joint_count = 1;
  world.steps(40);
  EXPECT_TRUE(world.awake(a));
}

TEST(Sleep, nothing_sleeps_when_disabled) {
  SleepWorld world;
  world.settings.sleep.enabled = false;
  const BodyIndex a = world.add({});
  world.island({a});
  world.steps(100);
  EXPECT_TRUE(world.awake(a));
}

TEST(Sleep, free_bodies_sleep_one_by_one_but_never_in_the_air) {
  SleepWorld world;
  const BodyIndex hovering = world.add({});
  const BodyIndex drifting = world.add({.gravity_scale = 0});
  const BodyIndex held =
      world.add({.flags = core::kDynamic | core::kAwake | core::kAllowSleep | core::kLockY});
  world.islands.free_bodies = {hovering, drifting, held};
  world.steps(40);
  EXPECT_TRUE(world.awake(hovering));  // at rest for a moment only: gravity pulls
  EXPECT_FALSE(world.awake(drifting));
  EXPECT_FALSE(world.awake(held));
  EXPECT_NE(world.bodies.sleep_island[drifting], world.bodies.sleep_island[held]);
}

TEST(Sleep, fields_keep_free_bodies_awake) {
  SleepWorld world;
  world.fields.rows.push_back([](const FieldSample&) { return FieldForce{}; });
  const BodyIndex body = world.add({.gravity_scale = 0});
  world.islands.free_bodies = {body};
  world.steps(40);
  EXPECT_TRUE(world.awake(body));
}

TEST(Wake, wakes_the_whole_island_and_resets_its_timers) {
  SleepWorld world;
  const BodyIndex a = world.add({}), b = world.add({}), c = world.add({});
  world.island({a, b});
  world.island({c});
  world.steps(40);
  world.bodies.awake_stale = false;
  wake_island(world.bodies, world.sleepers, b);
  for (const BodyIndex body : {a, b}) {
    EXPECT_TRUE(world.awake(body));
    EXPECT_EQ(world.bodies.still_time[body], 0);
    EXPECT_EQ(world.bodies.sleep_island[body], core::kNone);
  }
  EXPECT_FALSE(world.awake(c));
  EXPECT_TRUE(world.bodies.awake_stale);
  world.bodies.still_time[a] = 0.3f;
  wake_island(world.bodies, world.sleepers, a);  // awake already: nothing
  EXPECT_EQ(world.bodies.still_time[a], 0.3f);
}

TEST(Wake, leaves_fixed_and_kinematic_bodies_alone) {
  SleepWorld world;
  const BodyIndex fixed = world.add_fixed(),
                  lift = world.add_kinematic(Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
  world.bodies.flags[lift] &= ~core::kAwake;
  wake_island(world.bodies, world.sleepers, fixed);
  wake_island(world.bodies, world.sleepers, lift);
  EXPECT_FALSE(world.awake(fixed));
  EXPECT_FALSE(world.awake(lift));
}

TEST(Wake, rows_of_sleepers_are_reused_lowest_first) {
  SleepWorld world;
  std::array<BodyIndex, 4> body;
  for (BodyIndex& b : body) {
    b = world.add({});
    put_to_sleep(world.bodies, world.sleepers, {&b, 1});
  }
  for (const int i : {2, 0, 3}) wake_island(world.bodies, world.sleepers, body[i]);
  put_to_sleep(world.bodies, world.sleepers, {&body[3], 1});
  put_to_sleep(world.bodies, world.sleepers, {&body[0], 1});
  EXPECT_EQ(world.bodies.sleep_island[body[3]], 0u);
  EXPECT_EQ(world.bodies.sleep_island[body[0]], 2u);
  EXPECT_EQ(world.bodies.sleep_island[body[1]], 1u);
  EXPECT_EQ(world.sleepers.islands.size(), 4u);
}

TEST(Finalise, clears_forces_and_marks_what_moves) {
  SleepWorld world;
  const BodyIndex a = world.add({}),
                  lift = world.add_kinematic(Vec3::Zero(), {1, 0, 0}, Vec3::Zero());
  const BodyIndex idle = world.add_kinematic(Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
  world.bodies.flags[idle] &= ~core::kAwake;
  core::add_force(world.bodies, a, {1, 2, 3}, {4, 5, 6});
  world.island({a});
  world.islands.free_bodies = {lift, idle};
  world.steps(1);
  EXPECT_TRUE(world.bodies.force[a].force.isZero(0));
  EXPECT_TRUE(world.bodies.force[a].torque.isZero(0));
  EXPECT_TRUE(world.bodies.is(a, core::kChanged));
  EXPECT_TRUE(world.bodies.is(lift, core::kChanged));
  EXPECT_FALSE(world.bodies.is(idle, core::kChanged));
}

TEST(Quarantine, a_body_set_aside_is_named_once_and_its_neighbours_may_sleep) {
  SleepWorld world;
  const BodyIndex bad = world.add({}), good = world.add({});
  world.bodies.flags[bad] |= core::kQuarantined;
  world.island({bad, good});
  world.steps(40);
  ASSERT_EQ(world.warnings.size(), 1u);
  EXPECT_NE(world.warnings[0].find("body 0"), std::string::npos);
  EXPECT_FALSE(world.awake(good));
  wake_island(world.bodies, world.sleepers, good);
  EXPECT_TRUE(world.awake(good));
  EXPECT_FALSE(world.awake(bad));
}

}  // namespace
}  // namespace skerry::solver
