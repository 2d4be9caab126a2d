// Who sleeps, who wakes, and with whom: islands as a user sees them.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/bodies.h"

namespace skerry::test {
namespace {

constexpr double kDt = 1.0 / 60;

void run(World& world, int steps) {
  for (int n = 0; n < steps; ++n) world.step(kDt);
}

// A stack of three on a floor, and one far away; all asleep.
struct Asleep {
  World world;
  BodyId floor, low, middle, top, far;

  Asleep() {
    floor = add_floor(world);
    low = add_box(world, {0, 0.5, 0});
    middle = add_box(world, {0, 1.5, 0});
    top = add_box(world, {0, 2.5, 0});
    far = add_box(world, {20, 0.5, 0});
    run(world, 150);
    for (const BodyId body : {low, middle, top, far}) EXPECT_FALSE(world.awake(body));
  }
  bool stack_awake() const {
    EXPECT_EQ(world.awake(low), world.awake(top)) << "an island wakes as a unit";
    EXPECT_EQ(world.awake(low), world.awake(middle));
    return world.awake(low);
  }
};

// -- What wakes

struct Waker {
  const char* name;
  std::function<void(Asleep&)> make;
  bool wakes_far = false;
  int steps = 0;  // until they are awake
};

const std::vector<Waker>& wakers() {
  static const std::vector<Waker> all = {
      {"a_call", [](Asleep& a) { a.world.wake(a.middle); }},
      {"an_impulse",
       [](Asleep& a) {
         a.world.apply_impulse(a.top, {0, 0, 1});
       }},
      {"a_force",
       [](Asleep& a) {
         a.world.apply_force(a.low, {1, 0, 0});
       }},
      {"a_velocity",
       [](Asleep& a) {
         a.world.set_velocity(a.top, {0.1, 0, 0}, {0, 0, 0});
       }},
      {"a_pose",
       [](Asleep& a) {
         a.world.set_pose(a.middle, {{0, 1.5, 0.01}});
       }},
      {"removal_of_the_supporter", [](Asleep& a) { a.world.remove_body(a.floor); }, true},
      {"removal_of_one_of_it",
       [](Asleep& a) {
         a.world.remove_body(a.middle);
         a.middle = a.low;
       }},
      {"moving_the_floor",
       [](Asleep& a) {
         a.world.set_pose(a.floor, {{0, -1.1, 0}});
       },
       true},
      {"moving_a_wall_into_it",
       [](Asleep& a) {
         const BodyId wall = a.world.add_body(
             {.type = BodyType::fixed, .shapes = {Box{}}, .position = {5, 0.5, 0}});
         run(a.world, 2);
         EXPECT_FALSE(a.stack_awake());
         a.world.set_pose(wall, {{0.999, 0.5, 0}});
       },
       false, 1},
      {"a_body_that_is_put_on_it",
       [](Asleep& a) {
         add_box(a.world, {0, 3.49, 0});
       },
       false, 1},
      {"gravity",
       [](Asleep& a) {
         a.world.set_gravity({0.1, -9.81, 0});
       },
       true},
      {"a_force_field",
       [](Asleep& a) { a.world.add_force_field([](const FieldSample&) { return FieldForce{}; }); },
       true},
      {"a_new_joint", [](Asleep& a) { a.world.add_joint(BallJoint{.a = a.floor, .b = a.low}); }},
      {"its_own_filter", [](Asleep& a) { a.world.set_filter(a.top, 0, {.mask = 1}); }},
      {"the_floors_filter", [](Asleep& a) { a.world.set_filter(a.floor, 0, {.category = 3}); },
       true},
      {"its_own_material", [](Asleep& a) { a.world.set_material(a.low, 0, {.friction = 0}); }},
      {"the_floors_material", [](Asleep& a) { a.world.set_material(a.floor, 0, {.friction = 0}); },
       true},
      {"its_sensor_flag", [](Asleep& a) { a.world.set_sensor(a.top, 0, true); }},
      {"its_type",
       [](Asleep& a) {
         a.world.set_type(a.middle, BodyType::kinematic);
         a.middle = a.low;
         a.top = a.low;
       }},
      {"the_floors_type", [](Asleep& a) { a.world.set_type(a.floor, BodyType::kinematic); }, true},
      {"a_command",
       [](Asleep& a) {
         a.world.post(Impulse{a.top, {0, 0, 1}});
       },
       false, 1},
  };
  return all;
}

class Wakes : public testing::TestWithParam<std::size_t> {};

TEST_P(Wakes, the_island_and_nobody_else) {
  const Waker& waker = wakers()[GetParam()];
  Asleep asleep;
  waker.make(asleep);
  run(asleep.world, waker.steps);
  EXPECT_TRUE(asleep.stack_awake());
  EXPECT_EQ(asleep.world.awake(asleep.far), waker.wakes_far);
}
INSTANTIATE_TEST_SUITE_P(SleepWake, Wakes, testing::Range(std::size_t{0}, wakers().size()),
                         [](const auto& param) { return std::string(wakers()[param.param].name); });

TEST(SleepWake, a_joints_removal_and_its_changes_wake) {
  World world;
  const BodyId box = add_box(world, {0, 5, 0});
  const auto hang = [&] {
    return world.add_joint(SliderJoint{
        .b = box, .anchor = {0, 5, 0}, .axis = {0, 1, 0}, .limits = {.lower = 0, .upper = 1}});
  };
  JointId joint = hang();
  const auto asleep = [&] {
    run(world, 200);
    return !world.awake(box);
  };
  ASSERT_TRUE(asleep());
  world.set_joint_limits(joint, JointCoordinate::z, {.lower = -0.1, .upper = 1});
  EXPECT_TRUE(world.awake(box));
  ASSERT_TRUE(asleep());
  world.remove_joint(joint);
  EXPECT_TRUE(world.awake(box));
}

TEST(SleepWake, a_kinematic_body_slower_than_the_sleep_threshold_wakes_and_keeps_awake) {
  World world;
  add_floor(world);
  const BodyId box = add_box(world, {0, 0.5, 0});
  const BodyId pusher =
      world.add_body({.type = BodyType::kinematic, .shapes = {Box{}}, .position = {-1.03, 0.5, 0}});
  run(world, 120);
  ASSERT_FALSE(world.awake(box));
  world.set_velocity(pusher, {0.02, 0, 0}, {0, 0, 0});
  run(world, 240);
  EXPECT_TRUE(world.awake(box));
  EXPECT_NEAR(world.pose(box).position.x(), -1.03 + 0.02 * 4 + 1, 2e-3) << "it is pushed along";
  world.set_velocity(pusher, {0, 0, 0}, {0, 0, 0});
  run(world, 120);
  EXPECT_FALSE(world.awake(box)) << "and may sleep when the pusher stops";
}

// -- What is slow but not at rest

TEST(SleepWake, what_gathers_speed_slowly_is_not_stopped) {
  const double angle = 0.1, g = 1.62;
  for (const double friction : {0.09, 0.6}) {  // the box slides, the ball rolls
    World world({.gravity = {0, -g, 0}});
    add_incline(world, angle, friction);
    const Vec3 normal(-std::sin(angle), std::cos(angle), 0);
    const Shape shape = friction < 0.1 ? Shape(Box{}) : Shape(Sphere{.radius = 0.5});
    const BodyId body =
        world.add_body({.shapes = {shape},
                        .position = 0.5 * normal,
                        .orientation = Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ())),
                        .friction = friction});
    run(world, 300);
    const double expected = friction < 0.1 ? g * (std::sin(angle) - friction * std::cos(angle))
                                           : 5 / 7.0 * g * std::sin(angle);
    EXPECT_TRUE(world.awake(body));
    EXPECT_NEAR(world.linear_velocity(body).norm(), 5 * expected, 0.02 * 5 * expected);
  }
}

TEST(SleepWake, what_drifts_in_empty_space_drifts_on) {
  World world({.gravity = {0, 0, 0}});
  const auto ball = [&world](const Vec3& at, double damping) {
    return world.add_body({.shapes = {Sphere{.radius = 0.5}},
                           .position = at,
                           .linear_velocity = {0.02, 0, 0},
                           .linear_damping = damping,
                           .angular_damping = damping});
  };
  const BodyId alone = ball({0, 0, 0}, 0), damped = ball({0, 5, 0}, 0.1);
  const BodyId left = ball({0, 10, 0}, 0), right = ball({0.999, 10, 0}, 0);  // they touch
  const BodyId still = world.add_body({.shapes = {Sphere{}}, .position = {0, 15, 0}});
  run(world, 300);
  EXPECT_NEAR(world.pose(alone).position.x(), 0.1, 1e-9);
  EXPECT_NEAR((world.pose(left).position + world.pose(right).position).x(), 1.199, 1e-6);
  EXPECT_FALSE(world.awake(damped));
  EXPECT_FALSE(world.awake(still));
}

TEST(SleepWake, a_kinematic_floor_that_begins_to_move_takes_sleepers_along) {
  World world;
  const BodyId floor = world.add_body({.type = BodyType::kinematic,
                                       .shapes = {Box{.half_extents = {5, 1, 5}}},
                                       .position = {0, -1, 0}});
  const BodyId box = add_box(world, {0, 0.5, 0});
  run(world, 120);
  ASSERT_FALSE(world.awake(box));
  world.move_kinematic(floor, {{0.01, -1, 0}}, kDt);
  run(world, 30);
  EXPECT_TRUE(world.awake(box));
  EXPECT_GT(world.pose(box).position.x(), 0.1);
}

TEST(SleepWake, a_floor_that_becomes_dynamic_falls_with_what_slept_on_it) {
  World world;
  const BodyId floor = world.add_body({.type = BodyType::fixed,
                                       .shapes = {Box{.half_extents = {2, 0.2, 2}}},
                                       .position = {0, -0.2, 0}});
  const BodyId box = add_box(world, {0, 0.5, 0});
  run(world, 120);
  ASSERT_FALSE(world.awake(box));
  world.set_type(floor, BodyType::dynamic);
  run(world, 60);
  EXPECT_TRUE(world.awake(box));
  EXPECT_LT(world.pose(floor).position.y(), -4);
  EXPECT_LT(world.pose(box).position.y(), -3.5);
}

TEST(SleepWake, what_becomes_fixed_stays_and_carries) {
  World world;
  const BodyId low = add_box(world, {0, 5, 0});
  const BodyId high = add_box(world, {0, 6.2, 0});
  run(world, 10);
  world.set_type(low, BodyType::fixed);
  const Vec3 place = world.pose(low).position;
  run(world, 240);
  EXPECT_EQ(world.pose(low).position, place);
  EXPECT_NEAR(world.pose(high).position.y(), place.y() + 1, 5e-3);
  EXPECT_FALSE(world.awake(high));
}

// -- Islands

// Ten that touch, each asleep by itself, hit from the side.
class HitRow : public testing::TestWithParam<std::tuple<double, bool>> {};

TEST_P(HitRow, wakes_in_the_step_of_the_blow) {
  const double speed = std::get<0>(GetParam());
  const bool bullet_first = std::get<1>(GetParam());
  World world({.gravity = {0, 0, 0}});
  std::vector<BodyId> row;
  BodyId bullet;
  const auto add_bullet = [&] {
    bullet = world.add_body(
        {.shapes = {Box{}}, .position = {-5, 0, 0}, .linear_velocity = {speed, 0, 0}});
  };
  if (bullet_first) add_bullet();
  for (int i = 0; i < 10; ++i)
    row.push_back(world.add_body({.shapes = {Box{}}, .position = {1.0 * i, 0, 0}, .awake = false}));
  if (!bullet_first) add_bullet();
  for (int n = 0; n < 60; ++n) {
    run(world, 1);
    for (const BodyId body : row) ASSERT_EQ(world.awake(body), world.awake(row[0])) << n;
    double x = world.pose(bullet).position.x();
    for (const BodyId body : row) {
      // Ten in a row share a blow by few passes of the solver: beyond this they go into each other.
      if (speed <= 50) {
        ASSERT_GT(world.pose(body).position.x(), x + 0.9) << "step " << n;
      }
      x = world.pose(body).position.x();
    }
  }
  EXPECT_TRUE(world.awake(row[9]));
  EXPECT_GT(world.linear_velocity(row[9]).x(), 0.02 * speed);
  EXPECT_NEAR(world.measure().momentum[0], 1000 * speed, 1e-6 * 1000 * speed);
}
INSTANTIATE_TEST_SUITE_P(SleepWake, HitRow,
                         testing::Combine(testing::Values(50.0, 500.0), testing::Bool()));

// Three bodies in a row, neighbours touching or joined: only dynamic ones connect.
struct Three {
  World world{{.gravity = {0, 0, 0}, .sleep = {.time = 0.1}}};
  std::vector<BodyId> bodies;
  std::vector<int> run_of;  // of neighbouring dynamic bodies, 0 for others
  std::uint32_t runs = 0, longest = 0;

  Three(int combination, bool joined) {
    constexpr BodyType kTypes[] = {BodyType::fixed, BodyType::kinematic, BodyType::dynamic};
    std::vector<BodyType> types;
    for (int i = 0, c = combination; i < 3; ++i, c /= 3) types.push_back(kTypes[c % 3]);
    const double pitch = joined ? 3 : 0.999;
    for (int i = 0; i < 3; ++i)
      bodies.push_back(world.add_body(
          {.type = types[std::size_t(i)], .shapes = {Box{}}, .position = {pitch * i, 0, 0}}));
    std::uint32_t length = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const bool dynamic = types[i] == BodyType::dynamic;
      if (dynamic && length == 0) ++runs;
      length = dynamic ? length + 1 : 0;
      longest = std::max(longest, length);
      run_of.push_back(dynamic ? static_cast<int>(runs) : 0);
      if (joined && i > 0 && (dynamic || types[i - 1] == BodyType::dynamic))
        world.add_joint(BallJoint{
            .a = bodies[i - 1], .b = bodies[i], .anchor = {pitch * (double(i) - 0.5), 0, 0}});
    }
  }
};

class IslandsOfThree : public testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(IslandsOfThree, are_the_runs_of_dynamic_bodies) {
  const auto [combination, joined] = GetParam();
  Three three(combination, joined);
  const StepReport report = three.world.step(kDt);
  EXPECT_EQ(report.islands, three.runs);
  EXPECT_EQ(report.largest_island, three.longest);
  run(three.world, 60);
  for (std::size_t i = 0; i < 3; ++i) {
    for (const BodyId body : three.bodies) ASSERT_FALSE(three.world.awake(body));
    if (three.run_of[i] == 0) continue;
    three.world.wake(three.bodies[i]);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(three.world.awake(three.bodies[k]), three.run_of[k] == three.run_of[i]);
    run(three.world, 60);
  }
}
INSTANTIATE_TEST_SUITE_P(SleepWake, IslandsOfThree,
                         testing::Combine(testing::Range(0, 27), testing::Bool()));

TEST(SleepWake, islands_merge_on_touch_and_split_on_parting_removal_and_type_change) {
  World world({.gravity = {0, 0, 0}, .sleep = {.enabled = false}});
  std::vector<BodyId> row;
  for (int i = 0; i < 5; ++i) row.push_back(add_box(world, {0.999 * i, 0, 0}));
  const auto islands = [&] { return world.step(1e-6).islands; };
  EXPECT_EQ(islands(), 1u);
  world.set_type(row[2], BodyType::kinematic);
  EXPECT_EQ(islands(), 2u) << "a kinematic body does not connect";
  world.set_type(row[2], BodyType::dynamic);
  EXPECT_EQ(islands(), 1u);
  world.remove_body(row[2]);
  EXPECT_EQ(islands(), 2u);
  world.set_pose(row[3], {{50, 0, 0}});
  EXPECT_EQ(islands(), 1u) << "those two are free now";
  world.set_pose(row[3], {{0.999 * 2, 0, 0}});
  EXPECT_EQ(islands(), 1u) << "it fills the gap";
  EXPECT_EQ(world.last_report().largest_island, 3u);
}

// -- Isolation

std::vector<double> state_of(const World& world, const std::vector<BodyId>& bodies) {
  std::vector<double> state;
  for (const BodyId body : bodies) {
    const Pose pose = world.pose(body);
    for (int k = 0; k < 3; ++k) {
      state.push_back(pose.position[k]);
      state.push_back(world.linear_velocity(body)[k]);
      state.push_back(world.angular_velocity(body)[k]);
    }
    state.push_back(pose.orientation.w());
  }
  return state;
}

TEST(SleepWake, sleepers_change_no_bit_of_those_awake_and_the_other_way_round) {
  const auto pile = [](World& world, double x, bool asleep) {
    std::vector<BodyId> bodies;
    for (int i = 0; i < 12; ++i)
      bodies.push_back(world.add_body({.shapes = {Box{}},
                                       .position = {x + 0.1 * (i % 3), 0.5 + 1.01 * i, 0.03 * i},
                                       .awake = !asleep}));
    return bodies;
  };
  const auto run_awake = [&](bool with_sleepers) {
    World world;
    add_floor(world);
    const std::vector<BodyId> sleepers =
        with_sleepers ? pile(world, -20, true) : std::vector<BodyId>{};
    const std::vector<BodyId> watched = pile(world, 0, false);
    const std::vector<double> before = state_of(world, sleepers);
    run(world, 120);
    EXPECT_EQ(state_of(world, sleepers), before);
    for (const BodyId body : sleepers) EXPECT_FALSE(world.awake(body));
    return state_of(world, watched);
  };
  EXPECT_EQ(run_awake(true), run_awake(false));
}

}  // namespace
}  // namespace skerry::test
