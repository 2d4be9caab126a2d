// Limits, motors, friction, and what the coordinates say.
#include <gtest/gtest.h>

#include "tests/joints/joint_worlds.h"

namespace skerry::test {
namespace {

World still_world() { return World({.gravity = {0, 0, 0}, .sleep = {.enabled = false}}); }

TEST(Joints, hinge_limits_hold_a_falling_door) {
  World world;
  const BodyId door = add_point(world, {1, 0, 0}, 5, 0.5);
  const JointId hinge = world.add_joint(
      HingeJoint{.b = door, .axis = {0, 0, 1}, .lower_angle = -0.6, .upper_angle = 0.4});
  double lowest = 0;
  for (int n = 0; n < 300; ++n) {
    world.step(kDt);
    lowest = std::min(lowest, world.hinge_angle(hinge));
  }
  EXPECT_GT(lowest, -0.6 - 0.01);
  EXPECT_NEAR(world.hinge_angle(hinge), -0.6, 1e-3);
}

TEST(Joints, slider_limits_hold_and_can_be_moved) {
  World world;
  const BodyId bob = add_point(world, {0, 0, 0}, 2, 0.1);
  const JointId slider = world.add_joint(
      SliderJoint{.b = bob, .axis = {0, 1, 0}, .limits = {.lower = -0.5, .upper = 1}});
  run(world, 3);
  EXPECT_NEAR(world.joint_position(slider, JointCoordinate::z), -0.5, 1e-3);
  world.set_joint_limits(slider, JointCoordinate::z, {.lower = -0.8});
  EXPECT_TRUE(world.awake(bob));
  run(world, 3);
  EXPECT_NEAR(world.joint_position(slider, JointCoordinate::z), -0.8, 1e-3);
  EXPECT_NEAR(world.joint_force(slider).y(), 2 * kG, 2 * kG * 1e-3);
}

TEST(Joints, a_rope_is_slack_up_to_its_length_and_holds_there) {
  World world;
  const BodyId bob = add_point(world, {0.3, 0, 0}, 2, 0.1);
  const JointId rope =
      world.add_joint(DistanceJoint{.b = bob, .anchor_b = {0.3, 0, 0}, .limits = {.upper = 1}});
  double longest = 0;
  for (int n = 0; n < 600; ++n) {
    world.step(kDt);
    longest = std::max(longest, world.joint_position(rope, JointCoordinate::distance));
  }
  EXPECT_LT(longest, 1.01);
  EXPECT_GT(longest, 0.99);
}

TEST(Joints, a_rod_keeps_its_length_in_push_and_pull) {
  World world;
  const BodyId bob = add_point(world, {0.6, 0.8, 0}, 2, 0.1);
  const JointId rod = world.add_joint(
      DistanceJoint{.b = bob, .anchor_b = {0.6, 0.8, 0}, .limits = {.lower = 1, .upper = 1}});
  for (int n = 0; n < 300; ++n) {
    world.step(kDt);
    EXPECT_NEAR(world.joint_position(rod, JointCoordinate::distance), 1, 1e-4);
  }
}

TEST(Joints, a_cone_holds_the_swing_and_twist_limits_the_twist) {
  World world;
  const BodyId arm = add_rod(world, {0, 0, 0}, {1, 0, 0}, 2);
  const JointId shoulder = world.add_joint(ConeTwistJoint{
      .b = arm, .axis = {1, 0, 0}, .swing_limit = 0.7, .lower_twist = -0.3, .upper_twist = 0.5});
  world.set_velocity(arm, {0, 0, 0}, {12, 1, 2});
  double swing = 0, lower = 0, upper = 0;
  for (int n = 0; n < 600; ++n) {
    world.step(kDt);
    swing = std::max(swing, world.joint_position(shoulder, JointCoordinate::swing));
    const double twist = world.joint_position(shoulder, JointCoordinate::twist);
    lower = std::min(lower, twist);
    upper = std::max(upper, twist);
  }
  EXPECT_LT(swing, 0.72);
  EXPECT_GT(swing, 0.65);
  EXPECT_GT(lower, -0.32);
  EXPECT_LT(upper, 0.52);
  EXPECT_GT(upper, 0.4);
}

TEST(Joints, a_velocity_motor_speeds_up_with_its_exact_torque_and_then_holds_the_speed) {
  World world = still_world();
  const BodyId wheel = add_point(world, {0.5, 0, 0}, 2, 0.3);
  const JointId hinge = world.add_joint(HingeJoint{
      .b = wheel,
      .axis = {0, 0, 1},
      .drive = {.motor = {.mode = JointMotorMode::velocity, .target = 4, .max_force = 1.6}}});
  constexpr double kMoment = 0.3 + 2 * 0.5 * 0.5;  // about the hinge: 2 rad/s^2
  run(world, 1);
  EXPECT_NEAR(world.angular_velocity(wheel).z(), 1.6 / kMoment, 2e-3);
  EXPECT_NEAR(world.joint_torque(hinge).z(), 1.6, 1e-9);
  run(world, 2);
  EXPECT_NEAR(world.angular_velocity(wheel).z(), 4, 1e-6);
}

TEST(Joints, a_position_motor_reaches_its_target_and_follows_a_new_one) {
  World world;
  const BodyId cart = add_point(world, {0, 0, 0}, 2, 0.1);
  const JointId slider = world.add_joint(SliderJoint{
      .b = cart,
      .axis = {1, 0, 0},
      .drive = {.motor = {.mode = JointMotorMode::position, .target = 0.7, .max_force = 50}}});
  run(world, 4);
  EXPECT_NEAR(world.joint_position(slider, JointCoordinate::z), 0.7, 1e-3);
  run(world, 5);
  world.set_joint_drive(
      slider, JointCoordinate::z,
      {.motor = {.mode = JointMotorMode::position, .target = -0.2, .max_force = 50}});
  run(world, 4);
  EXPECT_NEAR(world.joint_position(slider, JointCoordinate::z), -0.2, 1e-3);
}

TEST(Joints, friction_holds_below_its_limit_and_slips_with_it_above) {
  for (const double load : {0.99, 1.5}) {
    World world = still_world();
    const BodyId bob = add_point(world, {0, 0, 0}, 2, 0.1);
    world.add_joint(SliderJoint{.b = bob, .axis = {0, 1, 0}, .drive = {.friction = 10}});
    for (int n = 0; n < 60; ++n) {
      world.apply_force(bob, {0, -load * 10, 0});
      world.step(kDt);
    }
    const double slipped = load < 1 ? 0 : -(load - 1) * 10 / 2;
    EXPECT_NEAR(world.linear_velocity(bob).y(), slipped, 1e-6 + 1e-3 * std::abs(slipped));
  }
  World world;  // a hinge: 2 kg at 0.5 m is 9.81 N m
  const BodyId door = add_point(world, {0.5, 0, 0}, 2, 0.1);
  const JointId hinge =
      world.add_joint(HingeJoint{.b = door, .axis = {0, 0, 1}, .drive = {.friction = 9.9}});
  run(world, 5);
  EXPECT_NEAR(world.hinge_angle(hinge), 0, 1e-4);
}

TEST(Joints, six_axes_are_free_locked_or_limited_one_by_one) {
  World world;
  const BodyId bob = add_point(world, {0, 0, 0}, 2, 0.1);
  SixDofJoint joint = {.b = bob};
  joint.axes[1] = {.mode = JointAxisMode::limited, .limits = {.lower = -0.25}};
  joint.axes[2].mode = JointAxisMode::free;
  joint.axes[4] = {.mode = JointAxisMode::limited, .limits = {.lower = -0.2, .upper = 0.2}};
  const JointId id = world.add_joint(joint);
  world.set_velocity(bob, {1, 0, 0.5}, {3, 2, 1});
  run(world, 1);
  const Vec3 p = world.pose(bob).position;
  EXPECT_NEAR(p.x(), 0, 1e-6);
  EXPECT_NEAR(p.y(), -0.25, 2e-3);
  EXPECT_NEAR(p.z(), 0.5, 0.02);
  EXPECT_NEAR(world.joint_position(id, JointCoordinate::swing_x), 0, 1e-4);
  EXPECT_NEAR(world.joint_position(id, JointCoordinate::twist), 0, 1e-4);
  EXPECT_LT(std::abs(world.joint_position(id, JointCoordinate::swing_y)), 0.21);
}

TEST(Joints, a_fixed_joint_makes_one_body_of_two) {
  World world;
  const BodyId a = add_point(world, {0, 0, 0}, 1, 0.1), b = add_point(world, {1, 0, 0}, 1, 0.1);
  world.add_joint(FixedJoint{.a = a, .b = b, .anchor = {0.5, 0, 0}});
  world.set_velocity(a, {0, 0, 0}, {0, 5, 2});
  run(world, 3);
  const Vec3 between =
      world.pose(a).orientation.conjugate() * (world.pose(b).position - world.pose(a).position);
  EXPECT_LT((between - Vec3(1, 0, 0)).norm(), 1e-5);
  EXPECT_LT(world.pose(a).orientation.angularDistance(world.pose(b).orientation), 1e-5);
}

TEST(Joints, a_ball_turns_through_any_angle) {
  World world = still_world();
  const BodyId bob = add_point(world, {0, 0, 0}, 1, 0.1);
  world.add_joint(BallJoint{.b = bob});
  world.set_velocity(bob, {0, 0, 0}, {0, 0, 20});
  run(world, 2);
  EXPECT_NEAR(world.angular_velocity(bob).z(), 20, 1e-9);
  EXPECT_LT(world.pose(bob).position.norm(), 1e-9);
}

TEST(Joints, changes_wake_the_bodies_and_bad_ones_are_refused) {
  World world = World({.gravity = {0, 0, 0}});
  const BodyId door = add_point(world, {1, 0, 0}, 1, 0.1);
  const JointId hinge = world.add_joint(HingeJoint{.b = door});
  run(world, 2);
  ASSERT_FALSE(world.awake(door));
  EXPECT_THROW(world.set_joint_limits(hinge, JointCoordinate::twist, {.lower = 1, .upper = 0}),
               InputError);
  EXPECT_THROW(
      world.set_joint_drive(hinge, JointCoordinate::twist, {.motor = {.target = std::nan("")}}),
      InputError);
  EXPECT_THROW(world.set_joint_limits(hinge, JointCoordinate::x, {}), UsageError);
  EXPECT_FALSE(world.awake(door));
  world.set_joint_drive(
      hinge, JointCoordinate::twist,
      {.motor = {.mode = JointMotorMode::velocity, .target = 1, .max_force = 10}});
  EXPECT_TRUE(world.awake(door));
  run(world, 1);
  EXPECT_NEAR(world.angular_velocity(door).z(), 1, 1e-6);
}

}  // namespace
}  // namespace skerry::test
