#include "tests/support/bodies.h"

#include <cmath>

namespace skerry::test {

BodyId add_floor(World& world, double friction, double restitution, double half) {
  return world.add_body({.type = BodyType::fixed,
                         .shapes = {Box{.half_extents = {half, 1, half}}},
                         .position = {0, -1, 0},
                         .friction = friction,
                         .restitution = restitution});
}

BodyId add_incline(World& world, double angle, double friction) {
  return world.add_body(
      {.type = BodyType::fixed,
       .shapes = {Plane{.normal = {-std::sin(angle), std::cos(angle), 0}, .offset = 0}},
       .friction = friction});
}

BodyId add_box(World& world, const Vec3& position, const Vec3& half_extents, double friction,
               double density) {
  return world.add_body({.shapes = {Box{.half_extents = half_extents}},
                         .position = position,
                         .density = density,
                         .friction = friction});
}

BodyId add_sphere(World& world, const Vec3& position, double radius, double friction,
                  double restitution, double density) {
  return world.add_body({.shapes = {Sphere{.radius = radius}},
                         .position = position,
                         .density = density,
                         .friction = friction,
                         .restitution = restitution});
}

namespace {

constexpr double kDt = 1.0 / 60;

Shape shape_of(int i) {
  switch (i % 6) {
    case 0:
      return Box{.half_extents = {0.3, 0.3, 0.3}};
    case 1:
      return Sphere{.radius = 0.3};
    case 2:
      return Capsule{.radius = 0.2, .half_height = 0.25};
    case 3:
      return Box{.half_extents = {0.2, 0.3, 0.4}};
    case 4:
      return Cylinder{.radius = 0.25, .half_height = 0.25};
    default:
      break;
  }
  return ConvexHull{.points = {{0.3, -0.2, 0.3}, {-0.3, -0.2, 0.3}, {0, -0.2, -0.4}, {0, 0.4, 0}}};
}

void add_chain(World& world, const Vec3& top) {
  BodyId above = world.add_body({.type = BodyType::fixed, .position = top});
  for (int i = 0; i < 6; ++i) {
    const Vec3 center = top - Vec3(0, 0.5 + i, 0);
    const BodyId link = world.add_body(
        {.shapes = {Capsule{.radius = 0.1, .half_height = 0.35}}, .position = center});
    const Vec3 anchor = center + Vec3(0, 0.5, 0);
    if (i % 2 == 0) {
      world.add_joint(BallJoint{.a = above, .b = link, .anchor = anchor});
    } else {
      world.add_joint(HingeJoint{
          .a = above, .b = link, .anchor = anchor, .lower_angle = -1.0, .upper_angle = 1.0});
    }
    above = link;
  }
}

}  // namespace

BusyScene::BusyScene(World& world) {
  add_floor(world);
  for (int i = 0; i < 512; ++i) {
    const int x = i % 8, z = i / 8 % 8, y = i / 64;
    bodies_.push_back(world.add_body({.shapes = {shape_of(i)},
                                      .position = {(x - 3.5) * 0.75 + 0.01 * (i % 7), 1.0 + y * 0.8,
                                                   (z - 3.5) * 0.75 - 0.01 * (i % 5)},
                                      .restitution = i % 9 == 0 ? 0.5 : 0.0}));
  }
  for (int i = 0; i < 3; ++i) add_chain(world, {7.0 + i, 8, 0});
  world.add_body({.type = BodyType::fixed,
                  .shapes = {{Box{.half_extents = {2, 1, 2}}, {.sensor = true}}},
                  .position = {3, 1, 3}});
  world.add_body({.type = BodyType::kinematic,
                  .shapes = {Box{.half_extents = {0.2, 0.5, 4}}},
                  .position = {-6, 0.6, 0},
                  .linear_velocity = {0.5, 0, 0}});
}

void BusyScene::advance(World& world, int n) {
  if (n == 60) world.remove_body(bodies_[77]);
  if (n == 100) world.apply_impulse(bodies_[300], {400, 300, 0});
  if (n == 150) world.post(Spawn{{.shapes = {Sphere{.radius = 0.6}}, .position = {0, 12, 0}}});
  world.run_steps(1, kDt);
}

}  // namespace skerry::test
