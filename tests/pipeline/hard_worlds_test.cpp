// Whole worlds of the kind that broke other engines.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/bodies.h"

namespace skerry::test {
namespace {

constexpr double kDt = 1.0 / 60;

void expect_finite(const World& world) {
  for (const Pose& pose : world.transforms()) {
    ASSERT_TRUE(std::isfinite(pose.position.squaredNorm()));
    ASSERT_NEAR(pose.orientation.norm(), 1, 1e-9);
  }
}

Shape sized(int kind, double size) {
  switch (kind % 7) {
    case 0:
      return Sphere{.radius = size};
    case 1:
      return Capsule{.radius = 0.5 * size, .half_height = size};
    case 2:
      return Box{.half_extents = {size, 0.5 * size, size}};
    case 3:
      return Cylinder{.radius = size, .half_height = size};
    case 4:
      return Cone{.radius = size, .half_height = size};
    case 5:
      return Ellipsoid{.semi_axes = {size, 0.7 * size, 0.5 * size}};
    default:
      return ConvexHull{.points = {size * Vec3(1, -1, 1), size * Vec3(-1, -1, 1),
                                   size * Vec3(0, -1, -1), size * Vec3(0, 1, 0)}};
  }
}

TEST(HardWorlds, of_shapes_from_a_millimetre_to_a_kilometre_stay_finite) {
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
  int kind = 0;
  for (const double size : {1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3})
    for (int i = 0; i < 7; ++i, ++kind)
      world.add_body({.shapes = {sized(kind, size)},
                      .position = {size * 2.5 * i, size * (1 + 0.2 * (i % 3)), 0.3 * size}});
  for (int n = 0; n < 90; ++n) {
    EXPECT_TRUE(world.step(kDt).warnings.empty());
    expect_finite(world);
  }
}

TEST(HardWorlds, of_bodies_all_in_one_place_come_apart_without_exploding) {
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
  for (int i = 0; i < 42; ++i) world.add_body({.shapes = {sized(i, 0.5)}, .position = {0, 1, 0}});
  for (int n = 0; n < 240; ++n) {
    EXPECT_TRUE(world.step(kDt).warnings.empty());
    expect_finite(world);
  }
  for (const Pose& pose : world.transforms()) EXPECT_LT(pose.position.norm(), 60);
}

TEST(HardWorlds, quaternions_a_little_off_unit_are_made_unit_before_the_first_contact) {
  World world;
  add_floor(world);
  const Quat off(1.0009, 0, 0, 0);
  const BodyId box =
      world.add_body({.shapes = {Box{}}, .position = {0, 0.5, 0}, .orientation = off});
  world.step(kDt);
  EXPECT_NEAR(world.pose(box).orientation.norm(), 1, 1e-12);
  expect_finite(world);
}

TEST(HardWorlds, hulls_of_points_closer_than_any_length_are_refused) {
  World world;
  for (const double size : {1e-23, 1e-12, 1e-38, 0.0}) {
    ConvexHull hull;
    for (int i = 0; i < 8; ++i)
      hull.points.push_back(size * Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
    EXPECT_THROW(world.add_body({.shapes = {hull}}), InputError) << size;
    EXPECT_THROW(world.add_body({.type = BodyType::fixed, .shapes = {hull}}), InputError) << size;
  }
  EXPECT_EQ(world.body_count(), 0u);
}

// Nothing in an engine without fixed buffers may be left out when there is much of it.
TEST(HardWorlds, with_many_contacts_in_one_step_lose_none_of_them) {
  World world({.sleep = {.enabled = false}});
  world.add_body({.type = BodyType::fixed,
                  .shapes = {Box{.half_extents = {200, 1, 200}}},
                  .position = {0, -1, 0}});
  std::vector<BodyId> boxes;
  for (int i = 0; i < 2500; ++i)
    boxes.push_back(add_box(world, {2.0 * (i % 50) - 50, 0.499, 2.0 * (i / 50) - 50}));
  StepReport report;
  for (int n = 0; n < 15; ++n) report = world.step(kDt);
  EXPECT_EQ(report.contacts, 2500u);
  for (const BodyId box : boxes) ASSERT_GT(world.pose(box).position.y(), 0.49);
}

// 981 m/s^2 and restitution: the order in which bodies were made must not decide, and there is rest.
TEST(HardWorlds, at_a_hundred_g_bounce_alike_in_both_orders_and_sink_by_no_more_than_a_steps_fall) {
  const auto run = [](bool floor_first) {
    World world({.gravity = {0, -981, 0}});
    if (floor_first) add_floor(world, 0.6, 0.4);
    std::vector<BodyId> bodies;
    for (int i = 0; i < 3; ++i)
      bodies.push_back(add_sphere(world, {3.0 * i, 1.0 + i, 0}, 0.5, 0.6, 0.4));
    bodies.push_back(
        world.add_body({.shapes = {Box{}}, .position = {-3, 1, 0}, .restitution = 0.4}));
    if (!floor_first) add_floor(world, 0.6, 0.4);
    std::vector<double> heights;
    for (int n = 0; n < 300; ++n) {
      world.step(kDt);
      for (const BodyId body : bodies) {
        heights.push_back(world.pose(body).position.y());
        EXPECT_GT(heights.back(), 0.5 - 0.5 * 981 * kDt * kDt) << "step " << n;
      }
    }
    for (const BodyId body : bodies) {
      EXPECT_LT(world.linear_velocity(body).norm(), 0.01);
      EXPECT_NEAR(world.pose(body).position.y(), 0.5, 0.015);  // g / (2 pi 42 Hz)^2 at most
    }
    return heights;
  };
  const std::vector<double> first = run(true), last = run(false);
  for (std::size_t i = 0; i < first.size(); ++i) ASSERT_NEAR(first[i], last[i], 2e-3) << i;
}

// Restitution 1, no gravity, random aims at free boxes: no step may add energy.
TEST(HardWorlds, of_balls_and_boxes_at_any_speed_gain_no_energy_in_any_step) {
  std::mt19937 random(9);
  const auto number = [&] { return double(random() % 10000) / 10000 - 0.5; };
  for (int aim = 0; aim < 150; ++aim) {
    World world({.gravity = {0, 0, 0}});
    world.add_body({.shapes = {Box{.half_extents = {0.5, 0.3, 0.4}}},
                    .orientation = Quat(1, number(), number(), number()).normalized(),
                    .friction = 0,
                    .restitution = 1});
    const double speed = std::pow(10, 1 + 2 * (number() + 0.5));
    world.add_body({.shapes = {Sphere{.radius = 0.1}},
                    .position = {-3, 0.6 * number(), 0.6 * number()},
                    .linear_velocity = {speed, 0, 0},
                    .friction = 0,
                    .restitution = 1});
    double energy = world.measure().kinetic_energy;
    const double start = energy;
    for (int n = 0; n < 40; ++n) {
      world.step(kDt);
      const double now = world.measure().kinetic_energy;
      ASSERT_LT(now, energy + 0.02 * start) << "aim " << aim << " speed " << speed << " step " << n;
      energy = now;
    }
    EXPECT_LT(energy, 1.02 * start) << "aim " << aim;
  }
}

// Four points of contact micrometres apart.
TEST(HardWorlds, of_hulls_that_stand_on_blunt_tips_keep_them_above_the_ground) {
  for (const double tip : {1e-3, 1e-4, 3e-5, 1e-5}) {
    World world;
    world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
    ConvexHull top;
    for (const double x : {-1.0, 1.0})
      for (const double z : {-1.0, 1.0}) {
        top.points.emplace_back(tip * x, 0, tip * z);
        top.points.emplace_back(0.6 * x, 0.7, 0.4 * z);
      }
    const BodyId body = world.add_body({.shapes = {top}, .position = {0, 0.001, 0}});
    for (int n = 0; n < 240; ++n) {
      EXPECT_TRUE(world.step(kDt).warnings.empty());
      ASSERT_GT(world.pose(body).position.y(), -0.02) << "tip " << tip << " step " << n;
    }
  }
}

std::shared_ptr<const MeshData> bumpy_ground(int cells, double side, double amplitude) {
  auto mesh = std::make_shared<MeshData>();
  const auto row = static_cast<std::uint32_t>(cells + 1);
  for (int k = 0; k <= cells; ++k)
    for (int i = 0; i <= cells; ++i) {
      const double x = (i - 0.5 * cells) * side, z = (k - 0.5 * cells) * side;
      mesh->vertices.emplace_back(x, amplitude * std::sin(5.1 * x + 1) * std::cos(4.3 * z), z);
    }
  for (std::uint32_t k = 0; k + 1 < row; ++k)
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t v = k * row + i;
      mesh->triangles.push_back({v, v + row, v + 1});
      mesh->triangles.push_back({v + 1, v + row, v + row + 1});
    }
  return mesh;
}

TEST(HardWorlds, of_boxes_and_hulls_on_bumpy_ground_come_to_rest_on_top_of_it) {
  constexpr int kBodies = 36;
  World world({.sleep = {.enabled = false}});
  world.add_body({.type = BodyType::fixed,
                  .shapes = {TriangleMesh{.data = bumpy_ground(80, 0.25, 0.03)}},
                  .friction = 0.8});
  std::mt19937 random(5);
  const auto draw = [&] { return double(random()) * 0x1p-31 - 1; };
  std::vector<BodyId> bodies;
  for (int i = 0; i < kBodies; ++i) {
    const double w = draw(), x = draw(), y = draw(), z = draw();
    Shape shape = Box{.half_extents = {0.5, 0.4, 0.6}};
    if (i % 2 == 1) {
      ConvexHull hull;
      for (int k = 0; k < 20; ++k) {
        const double px = draw(), py = draw(), pz = draw();
        hull.points.push_back(0.6 * Vec3(px, py, pz).normalized());
      }
      shape = hull;
    }
    bodies.push_back(world.add_body({.shapes = {shape},
                                     .position = {2.5 * (i % 6 - 2.5), 1.5, 2.5 * (i / 6 - 2.5)},
                                     .orientation = Quat(w, x, y, z).normalized(),
                                     .friction = 0.8}));
  }
  for (int n = 0; n < 600; ++n) EXPECT_TRUE(world.step(kDt).warnings.empty());
  double squared_speeds = 0;
  constexpr int kWatched = 60;
  for (int n = 0; n < kWatched; ++n) {
    world.step(kDt);
    for (const BodyId body : bodies) {
      ASSERT_GT(world.pose(body).position.y(), 0.1);
      squared_speeds += world.linear_velocity(body).squaredNorm();
    }
  }
  // With contacts that lie about how near the ground is, 0.2 m/s and more for ever.
  EXPECT_LT(std::sqrt(squared_speeds / (kWatched * kBodies)), 0.03);
}

}  // namespace
}  // namespace skerry::test
