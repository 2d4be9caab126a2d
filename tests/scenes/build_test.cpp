#include <gtest/gtest.h>

#include "scenes/builders.h"
#include "scenes/catalogue.h"
#include "scenes/scene.h"

namespace skerry::test {
namespace {

using namespace scenes;

TEST(Build, a_scene_that_is_refused_leaves_the_world_as_it_was) {
  World world;
  const BodyId before = world.add_body({.shapes = {Sphere{1}}});
  SceneDesc scene;
  scene.bodies = {dynamic_body(Sphere{1}, {5, 0, 0}), dynamic_body(Sphere{1}, {9, 0, 0}),
                  dynamic_body(Sphere{-1}, {7, 0, 0})};
  try {
    build(scene, world);
    FAIL();
  } catch (const BuildError& error) {
    EXPECT_EQ(error.part(), BuildError::Part::body);
    EXPECT_EQ(error.number(), 2u);
    EXPECT_EQ(error.field(), "bodies[2].shapes[0].radius");
  }
  EXPECT_EQ(world.body_count(), 1u);
  EXPECT_EQ(world.joint_count(), 0u);
  EXPECT_TRUE(world.contains(before));
}

TEST(Build, events_happen_before_their_step) {
  SceneDesc scene;
  scene.defaults.gravity = Vec3::Zero();
  scene.bodies = {dynamic_body(Sphere{0.5}, {0, 0, 0}), dynamic_body(Sphere{0.5}, {5, 0, 0})};
  scene.events = {{2, ImpulseEvent{0, {0, 100, 0}}},
                  {3, SpawnEvent{{dynamic_body(Sphere{0.5}, {9, 0, 0})}, {}}},
                  {3, RemoveEvent{1}},
                  {4, RemoveEvent{2}}};
  World world(world_settings(scene));
  BuiltScene built = build(scene, world);
  const auto step = [&] {
    const std::size_t events = apply_events(scene, built, world, world.step_count() + 1);
    world.step(scene.defaults.dt);
    return events;
  };
  EXPECT_EQ(step(), 0u);
  EXPECT_EQ(world.linear_velocity(built.bodies[0]), Vec3::Zero());
  EXPECT_EQ(step(), 1u);
  EXPECT_GT(world.linear_velocity(built.bodies[0]).y(), 0);
  EXPECT_EQ(step(), 2u);
  EXPECT_FALSE(world.contains(built.bodies[1]));
  ASSERT_EQ(built.bodies.size(), 3u);
  EXPECT_TRUE(world.contains(built.bodies[2]));
  EXPECT_EQ(step(), 1u);
  EXPECT_FALSE(world.contains(built.bodies[2]));
}

// Falls for a second under each field; what is expected is the closed form.
double speed_after_a_second(FieldDesc field) {
  SceneDesc scene;
  scene.defaults.gravity = Vec3::Zero();
  scene.bodies = {dynamic_body(Sphere{0.5}, {0, 0, 0})};
  scene.bodies[0].mass = MassOverride{.mass = 2};
  scene.bodies[0].linear_velocity = {1, 0, 0};
  scene.fields = {std::move(field)};
  World world(world_settings(scene));
  const BuiltScene built = build(scene, world);
  for (int i = 0; i < 60; ++i) world.step(1.0 / 60);
  return world.linear_velocity(built.bodies[0]).x();
}

TEST(ForceFields, act_as_their_formulas_say) {
  EXPECT_NEAR(speed_after_a_second({UniformField{.acceleration = {3, 0, 0}}}), 4, 1e-9);
  EXPECT_NEAR(speed_after_a_second({UniformField{.force = {3, 0, 0}}}), 2.5, 1e-9);
  EXPECT_NEAR(speed_after_a_second({DragField{.linear = 2}}), std::exp(-1.0), 0.01);
  EXPECT_NEAR(speed_after_a_second({WindField{.velocity = {5, 0, 0}, .drag = 2}}),
              5 - 4 * std::exp(-1.0), 0.04);
  EXPECT_NEAR(speed_after_a_second({SpringField{.stiffness = 8}}), std::cos(2.0), 0.05);
}

TEST(ForceFields, act_on_the_named_bodies_only) {
  SceneDesc scene;
  scene.defaults.gravity = Vec3::Zero();
  scene.bodies = {dynamic_body(Sphere{0.5}, {0, 0, 0}), dynamic_body(Sphere{0.5}, {5, 0, 0})};
  scene.fields = {{UniformField{.acceleration = {0, 1, 0}}, {1}}};
  World world(world_settings(scene));
  const BuiltScene built = build(scene, world);
  world.step(0.01);
  EXPECT_EQ(world.linear_velocity(built.bodies[0]).y(), 0);
  EXPECT_GT(world.linear_velocity(built.bodies[1]).y(), 0);
}

}  // namespace
}  // namespace skerry::test
