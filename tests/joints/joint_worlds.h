// What the joint tests build again and again.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include <skerry/world.h>

namespace skerry::test {

inline constexpr double kG = 9.81;
inline constexpr double kPi = std::numbers::pi;
inline constexpr double kDt = 1.0 / 60;

// A body of this mass and this one moment of inertia about every axis; it meets nothing.
inline BodyId add_point(World& world, const Vec3& at, double mass, double moment,
                        const Vec3& velocity = Vec3::Zero()) {
  return world.add_body(
      {.shapes = {{Sphere{.radius = 0.05}, {.filter = {.category = 2, .mask = 0}}}},
       .position = at,
       .linear_velocity = velocity,
       .mass = MassOverride{.mass = mass, .inertia = Mat3(Mat3::Identity() * moment)}});
}
// A slender rod of this mass from one end to another.
inline BodyId add_rod(World& world, const Vec3& from, const Vec3& to, double mass) {
  const double length = (to - from).norm();
  const Mat3 inertia =
      Vec3(mass * length * length / 12, 1e-4 * mass, mass * length * length / 12).asDiagonal();
  return world.add_body({.shapes = {{Capsule{.radius = 0.02, .half_height = 0.4 * length},
                                     {.filter = {.category = 2, .mask = 0}}}},
                         .position = 0.5 * (from + to),
                         .orientation = Quat::FromTwoVectors(Vec3::UnitY(), to - from),
                         .mass = MassOverride{.mass = mass, .inertia = inertia}});
}
inline void run(World& world, double seconds, double dt = kDt) {
  for (int n = static_cast<int>(std::lround(seconds / dt)); n > 0; --n) world.step(dt);
}
inline double energy(const World& world) {
  const Measures m = world.measure();
  return m.kinetic_energy + m.potential_energy;
}

}  // namespace skerry::test
