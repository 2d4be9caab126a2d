// Joints of scene files: every field arrives, wherever a prefab is placed, and acts.
#include <gtest/gtest.h>

#include "scenes/rigid_maths.h"
#include "scenes/scene_file.h"
#include "tests/scenes/cases.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

using scenes::kPi;
using scenes::kWorldFrame;
using scenes::SceneDesc;
using scenes::SceneJoint;

SceneDesc read(const std::string& text) {
  return scenes::read_scene_text(text, "right.json", source_dir() / "tests/scenes/meshes");
}
double degrees(double angle) { return angle * 180 / kPi; }

// The n-th joint of the top level of the full scene; the five before are those of prefabs.
template <class Joint>
const Joint& joint_of(const SceneDesc& scene, std::size_t n) {
  return std::get<Joint>(scene.joints.at(5 + n).joint);
}

TEST(JointFile, hinges_and_balls_arrive_in_full) {
  const SceneDesc scene = read(full_scene());
  const auto& driven = joint_of<HingeJoint>(scene, 0);
  EXPECT_NEAR(degrees(*driven.lower_angle), -30, 1e-13);
  EXPECT_NEAR(degrees(*driven.upper_angle), 45, 1e-13);
  EXPECT_EQ(driven.drive.motor.mode, JointMotorMode::velocity);
  EXPECT_EQ(driven.drive.motor.target, 1);
  EXPECT_EQ(driven.drive.motor.max_force, 10);
  EXPECT_EQ(driven.drive.spring.frequency, 0);
  EXPECT_FALSE(driven.collide);

  const auto& sprung = joint_of<HingeJoint>(scene, 1);
  EXPECT_EQ(scene.joints.at(6).a, kWorldFrame);
  EXPECT_EQ(scene.joints.at(6).b, scene.names.at("thing"));
  EXPECT_EQ(sprung.anchor, Vec3(0, 6, 0));
  EXPECT_EQ(sprung.axis, Vec3(0, 0, 1));
  EXPECT_FALSE(sprung.lower_angle);
  EXPECT_NEAR(degrees(*sprung.upper_angle), 90, 1e-13);
  EXPECT_EQ(sprung.limit_frequency, 3);
  EXPECT_EQ(sprung.limit_damping_ratio, 0.5);
  EXPECT_EQ(sprung.drive.spring.frequency, 1);
  EXPECT_EQ(sprung.drive.spring.damping_ratio, 0.7);
  EXPECT_NEAR(degrees(sprung.drive.spring.rest), 30, 1e-13);
  EXPECT_EQ(sprung.drive.motor.mode, JointMotorMode::off);
  EXPECT_EQ(sprung.drive.friction, 2);
  EXPECT_EQ(sprung.breaks.force, 5000);
  EXPECT_EQ(sprung.breaks.torque, 400);

  EXPECT_EQ(joint_of<BallJoint>(scene, 2).friction_torque, 3);
}

TEST(JointFile, sliders_fixed_joints_and_ropes_arrive_in_full) {
  const SceneDesc scene = read(full_scene());
  const auto& slider = joint_of<SliderJoint>(scene, 3);
  EXPECT_EQ(slider.limits.lower, -1);
  EXPECT_EQ(slider.limits.upper, 2);
  EXPECT_EQ(slider.limits.frequency, 4);
  EXPECT_EQ(slider.limits.damping_ratio, 0.6);
  EXPECT_EQ(slider.drive.spring.frequency, 2);
  EXPECT_EQ(slider.drive.spring.damping_ratio, 0.3);
  EXPECT_EQ(slider.drive.spring.rest, 0.5);
  EXPECT_EQ(slider.drive.motor.mode, JointMotorMode::position);
  EXPECT_EQ(slider.drive.motor.target, 1);
  EXPECT_EQ(slider.drive.motor.max_force, 30);
  EXPECT_EQ(slider.drive.motor.frequency, 5);
  EXPECT_EQ(slider.drive.motor.damping_ratio, 0.8);
  EXPECT_EQ(slider.drive.friction, 6);

  EXPECT_TRUE(joint_of<FixedJoint>(scene, 4).collide);

  const auto& rope = joint_of<DistanceJoint>(scene, 5);
  EXPECT_EQ(rope.anchor_a, Vec3(4, 5, 0));
  EXPECT_EQ(rope.anchor_b, Vec3(5, 5, 0));
  EXPECT_FALSE(rope.limits.lower);
  EXPECT_EQ(rope.limits.upper, 3);
  EXPECT_EQ(rope.drive.motor.target, -2);
}

TEST(JointFile, cones_and_six_axes_arrive_in_full) {
  const SceneDesc scene = read(full_scene());
  const auto& cone = joint_of<ConeTwistJoint>(scene, 6);
  EXPECT_NEAR(degrees(*cone.swing_limit), 45, 1e-13);
  EXPECT_NEAR(degrees(*cone.lower_twist), -10, 1e-13);
  EXPECT_NEAR(degrees(*cone.upper_twist), 20, 1e-13);
  EXPECT_EQ(cone.limit_frequency, 6);
  EXPECT_EQ(cone.limit_damping_ratio, 0.7);
  EXPECT_EQ(cone.swing.spring.frequency, 1);
  EXPECT_EQ(cone.swing.friction, 4);
  EXPECT_EQ(cone.twist.motor.mode, JointMotorMode::position);
  EXPECT_NEAR(degrees(cone.twist.motor.target), 15, 1e-13);
  EXPECT_EQ(cone.twist.motor.max_force, 8);

  const auto& six = joint_of<SixDofJoint>(scene, 7);
  EXPECT_NEAR(six.frame.y(), std::sqrt(0.5), 1e-15);
  constexpr JointAxisMode kModes[] = {JointAxisMode::free,    JointAxisMode::locked,
                                      JointAxisMode::limited, JointAxisMode::limited,
                                      JointAxisMode::free,    JointAxisMode::free};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(six.axes[i].mode, kModes[i]) << i;
  EXPECT_EQ(six.axes[2].limits.upper, 1);
  EXPECT_EQ(six.axes[2].limits.frequency, 2);
  EXPECT_NEAR(degrees(*six.axes[3].limits.lower), -45, 1e-13);
  EXPECT_FALSE(six.axes[3].limits.upper);
  EXPECT_EQ(six.axes[4].drive.spring.frequency, 2);
}

TEST(JointFile, a_prefab_carries_its_joints_to_where_it_is_placed) {
  const SceneDesc scene = read(scene_with(R"(
    "prefabs": { "pair": {
      "bodies": [ { "name": "l", "position": [-1, 0, 0], "shapes": [{ "type": "sphere", "radius": 0.5 }] },
                  { "name": "r", "position": [1, 0, 0], "shapes": [{ "type": "sphere", "radius": 0.5 }] } ],
      "joints": [ { "type": "slider", "a": "l", "b": "r", "anchor": [0.5, 0, 0], "axis": [2, 0, 0] },
                  { "type": "distance", "a": "l", "b": "r", "anchor_a": [-1, 0, 0], "anchor_b": [1, 0, 0] },
                  { "type": "six_dof", "a": "l", "b": "r", "anchor": [1, 0, 0] } ] } },
    "bodies": [ { "prefab": "pair", "position": [10, 0, 0], "orientation": { "axis": [0, 1, 0], "degrees": 90 } } ])"));
  const auto& slider = std::get<SliderJoint>(scene.joints.at(0).joint);
  EXPECT_LT((slider.anchor - Vec3(10, 0, -0.5)).norm(), 1e-14);
  EXPECT_LT((slider.axis - Vec3(0, 0, -1)).norm(), 1e-14);
  const auto& rope = std::get<DistanceJoint>(scene.joints.at(1).joint);
  EXPECT_LT((rope.anchor_a - Vec3(10, 0, 1)).norm(), 1e-14);
  EXPECT_LT((rope.anchor_b - Vec3(10, 0, -1)).norm(), 1e-14);
  const auto& six = std::get<SixDofJoint>(scene.joints.at(2).joint);
  EXPECT_NEAR(six.frame.y(), std::sqrt(0.5), 1e-15);
}

// A pendulum on the world, a lift on a rail with a motor, a rod and a rope, all from text.
TEST(JointFile, joints_of_a_file_hold_and_drive_its_bodies) {
  const SceneDesc scene = read(scene_with(R"(
    "gravity": [0, -9.81, 0], "sleep": false,
    "bodies": [
      { "name": "bob", "position": [1, 0, 0], "shapes": [{ "type": "sphere", "radius": 0.1 }] },
      { "name": "lift", "position": [10, 0, 0], "shapes": [{ "type": "box", "half_extents": [0.5, 0.1, 0.5] }] },
      { "name": "rod", "position": [20, -1, 0], "linear_velocity": [1, 0, 0], "shapes": [{ "type": "sphere", "radius": 0.1 }] },
      { "name": "roped", "position": [30, 0, 0], "shapes": [{ "type": "sphere", "radius": 0.1 }] } ],
    "joints": [
      { "type": "ball", "b": "bob", "anchor": [0, 0, 0] },
      { "type": "slider", "b": "lift", "anchor": [10, 0, 0], "axis": [0, 1, 0], "motor": { "speed": 1, "max_force": 40000 }, "limits": [0, 1.5] },
      { "type": "distance", "b": "rod", "anchor_a": [20, 0, 0], "anchor_b": [20, -1, 0], "limits": [1, 1] },
      { "type": "distance", "b": "roped", "anchor_a": [30, 0, 0], "anchor_b": [30, 0, 0], "limits": [null, 2] } ])"));
  World world(scenes::world_settings(scene));
  const scenes::BuiltScene built = scenes::build(scene, world);
  const auto at = [&](const char* name) {
    return world.pose(built.bodies.at(scene.names.at(name))).position;
  };
  for (int n = 0; n < 60; ++n) world.step(1.0 / 60);
  EXPECT_NEAR(at("lift").y(), 1, 0.02);
  for (int n = 0; n < 540; ++n) {
    world.step(1.0 / 60);
    EXPECT_NEAR(at("bob").norm(), 1, 1e-3);
    EXPECT_NEAR((at("rod") - Vec3(20, 0, 0)).norm(), 1, 1e-3);
    EXPECT_LT((at("roped") - Vec3(30, 0, 0)).norm(), 2.01);
  }
  EXPECT_NEAR(at("lift").y(), 1.5, 5e-3);
  EXPECT_LT(at("roped").y(), -1.9);
}

}  // namespace
}  // namespace skerry::test
