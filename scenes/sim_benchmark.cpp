// Tasks of the public accuracy comparisons: SimBenchmark (Kang and Hwangbo, ETH Zurich 2018) and the
// free box of "benchmark/boxes" (Peters and Hsu, "Comparison of rigid body dynamic simulators for
// robotic simulation in Gazebo", 2014). Their z axis is our y.
#include <cmath>

#include "scenes/builders.h"
#include "scenes/lcg.h"

namespace skerry::scenes {
namespace {

constexpr double kG = 9.81;

SceneDesc task(double dt, double seconds, double gravity = kG) {
  SceneDesc scene;
  scene.defaults.gravity = {0, -gravity, 0};
  scene.defaults.dt = dt;
  scene.defaults.steps = static_cast<std::uint64_t>(seconds / dt + 0.5);
  scene.defaults.sleep.enabled = false;
  return scene;
}

void add_ground(SceneDesc& scene, double friction, double restitution) {
  scene.bodies.push_back({.type = BodyType::fixed,
                          .shapes = {Plane{{0, 1, 0}, 0}},
                          .friction = friction,
                          .restitution = restitution});
}

void add_solid(SceneDesc& scene, Shape shape, const Vec3& at, double mass, double friction,
               double restitution) {
  scene.bodies.push_back({.shapes = {std::move(shape)},
                          .position = at,
                          .friction = friction,
                          .restitution = restitution,
                          .mass = MassOverride{.mass = mass}});
}

// Friction of a pair is the geometric mean: 0.4 under the plate, 0.8 on it.
SceneDesc rolling(const Vec3& direction) {
  SceneDesc scene = task(1e-3, 4);
  add_ground(scene, 0.4, 0);
  add_solid(scene, Box{{10, 0.5, 10}}, {0, 0.5, 0}, 10, 0.4, 0);
  for (int i = 0; i < 25; ++i) {
    add_solid(scene, Sphere{0.5}, {2.0 * (i % 5 - 2), 1.5, 2.0 * (i / 5 - 2)}, 1, 1.6, 0);
  }
  scene.fields.push_back({UniformField{.force = 150 * direction}, {1}});
  return scene;
}

SceneDesc cube_of_balls(std::uint64_t seed, double lowest, double restitution, double dt) {
  SceneDesc scene = task(dt, 10);
  add_ground(scene, 0, restitution);
  Lcg random(seed);
  for (int i = 0; i < 216; ++i) {
    const double x = 1e-3 * random.unit(), y = 1e-3 * random.unit(), z = 1e-3 * random.unit();
    const Vec3 at(0.21 * (i % 6) + x, lowest + 0.21 * (i / 36) + y, 0.21 * (i / 6 % 6) + z);
    add_solid(scene, Sphere{0.1}, at, 10, 0, restitution);
  }
  return scene;
}

}  // namespace

SceneDesc make_sim_rolling_y(std::uint64_t) { return rolling({0, 0, 1}); }
SceneDesc make_sim_rolling_xy(std::uint64_t) { return rolling({0.5, 0, std::sqrt(0.75)}); }

SceneDesc make_sim_bouncing(std::uint64_t) {
  SceneDesc scene = task(1e-2, 20);
  add_ground(scene, 0, 1);
  for (int i = 0; i < 49; ++i)
    add_solid(scene, Sphere{0.1}, {2.0 * (i % 7 - 3), 5, 2.0 * (i / 7 - 3)}, 10, 0, 1);
  return scene;
}

SceneDesc make_sim_666(std::uint64_t seed) { return cube_of_balls(seed, 0.101, 0, 1e-2); }
SceneDesc make_sim_666_elastic(std::uint64_t seed) { return cube_of_balls(seed, 1.101, 1, 4e-3); }

// Six storeys of eight cross pieces each and walls of nine bricks on them.
SceneDesc make_sim_kapla(std::uint64_t) {
  constexpr double kFriction = 0.8;
  SceneDesc scene = task(1e-2, 600);
  add_ground(scene, kFriction, 0);
  const auto add = [&](const Vec3& half, const Vec3& at) {
    add_solid(scene, Box{half}, at, 10, kFriction, 0);
  };
  for (int storey = 0; storey < 6; ++storey) {
    const double y = 0.2 * storey;
    for (int k = 0; k < 8; ++k) add({0.025, 0.05, 0.125}, {0.2 * k, y + 0.05, 0});
    const auto wall = [&](double x, double z) { add({0.1, 0.05, 0.025}, {x, y + 0.15, z}); };
    for (int k = 0; k < 4; ++k) wall(0.4 * k + 0.1, -0.1);
    for (int k = 0; k < 3; ++k) wall(0.4 * k + 0.3, 0.1);
    wall(0.1, 0.1);
    wall(1.3, 0.1);
  }
  return scene;
}

SceneDesc make_sim_boxes(std::uint64_t) {
  SceneDesc scene = task(1e-3, 10, 9.8);
  scene.bodies.push_back({.shapes = {Box{{0.05, 0.45, 0.2}}},
                          .linear_velocity = {-2, 8, 2},
                          .angular_velocity = {0.1, 0.1, 5},
                          .mass = MassOverride{.mass = 10}});
  return scene;
}

}  // namespace skerry::scenes
