// Fast bodies: none passes through anything, none is touched by what it passes.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"
#include "tests/support/rounds.h"

namespace skerry::test {
namespace {

constexpr double kDt = 1.0 / 60;
constexpr double kPi = std::numbers::pi;

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double in(double low, double high) {
    return low + (high - low) * (double(engine_()) / 4294967296.0);
  }
  Vec3 on_sphere() {
    Vec3 v;
    do v = {in(-1, 1), in(-1, 1), in(-1, 1)};
    while (v.squaredNorm() > 1 || v.squaredNorm() < 1e-4);
    return v.normalized();
  }
  Vec3 up_to(double length) {
    const double l = in(0, length);
    return l * on_sphere();
  }
  Quat rotation() {
    const Vec3 axis = on_sphere();
    return Quat(Eigen::AngleAxisd(in(0, 2 * kPi), axis));
  }

 private:
  std::mt19937 engine_;
};

double mechanical_energy(const World& world) {
  const Measures m = world.measure();
  return m.kinetic_energy + m.potential_energy;
}

double flat(double, double) { return 0; }

// A mesh of n x n squares of this side about the origin, facing +y.
template <class Height>
std::shared_ptr<const MeshData> mesh_of(int n, double side, const Height& height) {
  auto mesh = std::make_shared<MeshData>();
  for (int k = 0; k <= n; ++k)
    for (int i = 0; i <= n; ++i) {
      const double x = (i - 0.5 * n) * side, z = (k - 0.5 * n) * side;
      mesh->vertices.push_back({x, height(x, z), z});
    }
  const auto row = static_cast<std::uint32_t>(n + 1);
  for (std::uint32_t z = 0; z + 1 < row; ++z)
    for (std::uint32_t x = 0; x + 1 < row; ++x) {
      const std::uint32_t a = z * row + x, b = a + 1, c = a + row, d = c + 1;
      mesh->triangles.push_back({a, c, b});
      mesh->triangles.push_back({b, c, d});
    }
  return mesh;
}
std::shared_ptr<const MeshData> flat_mesh(int n, double side) { return mesh_of(n, side, flat); }

// Heights over n x n cells of this side about the origin of the shape that field_shape makes.
template <class Height>
Shape field_shape(int n, double side, const Height& height) {
  auto field = std::make_shared<HeightFieldData>();
  field->columns = field->rows = static_cast<std::uint32_t>(n + 1);
  for (int z = 0; z <= n; ++z)
    for (int x = 0; x <= n; ++x)
      field->heights.push_back(
          static_cast<float>(height((x - 0.5 * n) * side, (z - 0.5 * n) * side)));
  return {HeightField{.data = std::move(field), .scale = {side, 1, side}},
          {.local_pose = {{-0.5 * n * side, 0, -0.5 * n * side}, Quat::Identity()}}};
}

// -- A15: nothing passes.

struct Wall {
  const char* name;
  Shape (*make)();
};
Shape thin_box() { return Box{.half_extents = {0.0005, 3, 3}}; }
Shape thin_hull() {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.push_back({i & 1 ? 0.0005 : -0.0005, i & 2 ? 3.0 : -3.0, i & 4 ? 3.0 : -3.0});
  return ConvexHull{.points = points};
}
Shape thin_cylinder() {
  return {Cylinder{.radius = 4, .half_height = 0.0005},
          {.local_pose = {{0, 0, 0}, Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()))}}};
}
Shape sheet() {
  return {TriangleMesh{.data = flat_mesh(12, 0.5)},
          {.local_pose = {{0, 0, 0}, Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()))}}};
}

Shape flat_field() {
  const Quat upright(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()));
  Shape field = field_shape(12, 0.5, flat);
  field.options.local_pose = {upright * field.options.local_pose.position, upright};
  return field;
}

class ThinWall : public testing::TestWithParam<Wall> {};

TEST_P(ThinWall, stops_every_bullet_of_a_thousand_random_aims) {
  Random random(11);
  int passed = 0, unmoved = 0;
  for (int i = 0; i < rounds(1000); ++i) {
    World world({.gravity = {0, 0, 0}});
    world.add_body({.type = BodyType::fixed, .shapes = {GetParam().make()}});
    const Vec3 from{random.in(-7, -0.05), random.in(-2, 2), random.in(-2, 2)};
    const Vec3 to{0, random.in(-2, 2), random.in(-2, 2)};
    const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.01}},
                                        .position = from,
                                        .linear_velocity = 300 * (to - from).normalized()});
    for (int n = 0; n < 4; ++n) world.step(kDt);
    passed += world.pose(ball).position.x() > 0;
    unmoved += world.pose(ball).position.x() < -0.1;
  }
  EXPECT_EQ(passed, 0);
  EXPECT_EQ(unmoved, 0) << "stopped before the wall";
}
INSTANTIATE_TEST_SUITE_P(ContinuousCollision, ThinWall,
                         testing::Values(Wall{"box", thin_box}, Wall{"hull", thin_hull},
                                         Wall{"cylinder", thin_cylinder}, Wall{"mesh", sheet},
                                         Wall{"height_field", flat_field}),
                         [](const auto& given) { return given.param.name; });

// Where one of them meets the floor, what joints hold to it answers: it is neither torn off nor let through.
TEST(ContinuousCollision, a_chain_thrown_at_a_thin_floor_holds_together_above_it) {
  for (const double speed : {10.0, 20.0, 40.0, 80.0}) {
    World world;
    world.add_body({.type = BodyType::fixed,
                    .shapes = {Box{.half_extents = {500, 0.002, 500}}},
                    .position = {0, -0.002, 0}});
    std::vector<BodyId> links;
    std::vector<JointId> joints;
    for (int i = 0; i < 8; ++i) {
      const Vec3 at{0.1 * i, 3 + 0.4 * i, 0};
      links.push_back(world.add_body({.shapes = {Capsule{.radius = 0.08, .half_height = 0.12}},
                                      .position = at,
                                      .linear_velocity = {0.5 * speed, -speed, 0}}));
      const Vec3 anchor = at - Vec3(0.05, 0.2, 0);
      if (i > 0)
        joints.push_back(world.add_joint(
            BallJoint{.a = links[links.size() - 2], .b = links.back(), .anchor = anchor}));
    }
    for (int n = 0; n < 240; ++n) {
      world.step(kDt);
      for (const JointId joint : joints)
        EXPECT_LT(world.joint_position(joint, JointCoordinate::distance), 3e-3 * speed + 0.02)
            << "thrown at " << speed << " m/s, step " << n;
      for (const BodyId link : links)
        EXPECT_GT(world.pose(link).position.y(), 0.06) << speed << " m/s, step " << n;
    }
  }
}

TEST(ContinuousCollision, a_fast_arm_that_strikes_a_wall_stays_in_its_slow_shoulder) {
  for (const double spin : {5.0, 10.0, 20.0, 40.0}) {
    for (const double phase : {0.3, 0.6, 1.0, 1.5}) {
      World world({.gravity = {0, 0, 0}});
      world.add_body({.type = BodyType::fixed,
                      .shapes = {Box{.half_extents = {0.02, 0.2, 0.5}}},
                      .position = {0, 0.75, 0}});
      const BodyId torso = world.add_body({.shapes = {Box{.half_extents = Vec3::Constant(0.15)}}});
      const Vec3 along(std::sin(phase), std::cos(phase), 0), turn(0, 0, spin);
      const BodyId arm = world.add_body({.shapes = {Capsule{.radius = 0.05, .half_height = 0.3}},
                                         .position = 0.5 * along,
                                         .orientation = Quat::FromTwoVectors(Vec3::UnitY(), along),
                                         .linear_velocity = turn.cross(0.5 * along),
                                         .angular_velocity = turn});
      const JointId shoulder = world.add_joint(HingeJoint{.a = torso, .b = arm, .axis = {0, 0, 1}});
      const double start = world.measure().kinetic_energy;
      double torn = 0;
      for (int n = 0; n < 60; ++n) {
        world.step(kDt);
        torn = std::max(torn, world.joint_position(shoulder, JointCoordinate::distance));
      }
      EXPECT_LT(torn, 0.03) << spin << " rad/s from " << phase << " rad";
      EXPECT_LT(world.measure().kinetic_energy, 0.5 * start);  // it did strike
    }
  }
}

// Contacts foresee what jointed bodies will meet, but not what they will only pass.
TEST(ContinuousCollision, jointed_bodies_pass_a_corner_untouched) {
  for (const double speed : {20.0, 60.0, 200.0}) {
    for (const double ahead : {0.1, 0.3, 0.7}) {
      World world({.gravity = {0, 0, 0}});
      world.add_body({.type = BodyType::fixed, .shapes = {Box{.half_extents = {1, 1, 1}}}});
      const Vec3 at(-1 - ahead, 1.07, 0), velocity(speed, 0, 0);
      const auto ball = [&](const Vec3& position) {
        return world.add_body({.shapes = {Sphere{.radius = 0.05}},
                               .position = position,
                               .linear_velocity = velocity});
      };
      const BodyId first = ball(at), second = ball(at - Vec3(0.15, 0, 0));
      world.add_joint(FixedJoint{.a = first, .b = second, .anchor = at});
      for (int n = 0; n < 20; ++n) world.step(kDt);
      EXPECT_LT((world.linear_velocity(first) - velocity).norm(), 1e-9 * speed) << speed;
      EXPECT_LT((world.linear_velocity(second) - velocity).norm(), 1e-9 * speed) << speed;
    }
  }
}

// 320 boxes that fall into a shaft at this speed: the most, over its landing, of the mean and of the
// worst penetration (m).
struct Pressed {
  double mean = 0, worst = 0;
};
Pressed land_in_a_shaft(double speed, int seed) {
  World world;
  const auto fixed = [&](const Vec3& half, const Vec3& at) {
    world.add_body(
        {.type = BodyType::fixed, .shapes = {Box{.half_extents = half}}, .position = at});
  };
  fixed({50, 1, 50}, {0, -1, 0});
  for (const double side : {-2.0, 2.0}) {
    fixed({0.5, 10, 5}, {side, 10, 0});
    fixed({5, 10, 0.5}, {0, 10, side});
  }
  for (int i = 0; i < 320; ++i) {
    const int x = i % 4, z = i / 4 % 4, y = i / 16;
    const double shift = 0.03 * ((x * 7 + y * 5 + z * 3 + seed * (x + 2 * y + z)) % 5 - 2);
    world.add_body({.shapes = {Box{.half_extents = Vec3::Constant(0.25)}},
                    .position = {0.65 * (x - 1.5) + shift, 0.5 + 0.6 * y, 0.65 * (z - 1.5) - shift},
                    .linear_velocity = {0, -speed, 0}});
  }
  Pressed most;
  for (int n = 0; n < 90; ++n) {
    world.step(kDt);
    const Measures m = world.measure();
    most.mean = std::max(most.mean, m.penetration_mean);
    most.worst = std::max(most.worst, m.penetration_max);
  }
  return most;
}

// Who stops at a touch is in the way of those that come behind: a crowd is held up by contacts instead.
TEST(ContinuousCollision, a_crowd_of_boxes_that_lands_fast_is_not_pressed_into_itself) {
  for (const double speed : {10.0, 15.0}) {
    constexpr int kSeeds = 5;
    double mean = 0, worst = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const Pressed pressed = land_in_a_shaft(speed, seed);
      mean += pressed.mean / kSeeds;
      worst += pressed.worst / kSeeds;
    }
    EXPECT_LT(mean, 0.053) << speed << " m/s";
    EXPECT_LT(worst, 0.33) << speed << " m/s";
  }
}

Shape bullet_shape(int i) {
  switch (i % 7) {
    case 0:
      return Sphere{.radius = 0.05};
    case 1:
      return Box{.half_extents = {0.05, 0.08, 0.03}};
    case 2:
      return Capsule{.radius = 0.02, .half_height = 0.15};
    case 3:
      return Cylinder{.radius = 0.05, .half_height = 0.04};
    case 4:
      return Cone{.radius = 0.06, .half_height = 0.08};
    case 5:
      return Ellipsoid{.semi_axes = {0.03, 0.06, 0.1}};
    default:
      return ConvexHull{
          .points = {{0.08, -0.04, 0.06}, {-0.08, -0.04, 0.06}, {0, -0.04, -0.09}, {0, 0.09, 0}}};
  }
}

TEST(ContinuousCollision, tumbling_shapes_of_every_kind_do_not_pass_any_wall) {
  Random random(5);
  const auto walls = {thin_box, thin_hull, thin_cylinder, sheet};
  for (const auto& wall : walls) {
    int passed = 0;
    for (int i = 0; i < rounds(210); ++i) {
      World world;
      world.add_body({.type = BodyType::fixed, .shapes = {wall()}});
      const Vec3 from{random.in(-5, -0.3), random.in(-1, 1), random.in(-1, 1)};
      const Vec3 to{0, random.in(-1, 1), random.in(-1, 1)};
      const BodyId body = world.add_body({.shapes = {bullet_shape(i)},
                                          .position = from,
                                          .orientation = random.rotation(),
                                          .linear_velocity = 200 * (to - from).normalized(),
                                          .angular_velocity = 300 * random.on_sphere()});
      for (int n = 0; n < 6; ++n) world.step(kDt);
      const Vec3 at = world.center_of_mass(body);
      passed += at.x() > 0 && std::abs(at.y()) < 2.9 && std::abs(at.z()) < 2.9;
    }
    EXPECT_EQ(passed, 0);
  }
}

// The rod turns about a hinge at its middle; its tip strikes the wall in its way.
TEST(ContinuousCollision, a_spinning_rod_does_not_sweep_through_a_thin_wall) {
  for (const double spin : {20.0, 60.0, 170.0, 400.0}) {
    for (const double phase : {0.1, 0.7, 1.9, 2.6}) {
      World world({.gravity = {0, 0, 0}});
      world.add_body({.type = BodyType::fixed,
                      .shapes = {Box{.half_extents = {0.0005, 0.2, 0.2}}},
                      .position = {0, 0.9, 0}});
      const BodyId rod =
          world.add_body({.shapes = {Capsule{.radius = 0.005, .half_height = 0.95}},
                          .orientation = Quat(Eigen::AngleAxisd(phase, Vec3::UnitZ())),
                          .angular_velocity = {0, 0, spin}});
      bool hit = false;
      double turned = 0;
      for (int n = 0; n < 60 && !hit; ++n) {
        world.step(kDt);
        hit = !world.contact_events().empty();
        turned += spin * kDt;
      }
      EXPECT_TRUE(hit) << spin << " rad/s from " << phase << " rad";
      // From the phase the near tip reaches the wall (at 0 and pi) after less than half a turn; a
      // step is lost at most.
      EXPECT_LE(turned, kPi + 3 * spin * kDt) << spin << " rad/s from " << phase << " rad";
      EXPECT_LT(world.angular_velocity(rod).z(), 0.99 * spin);
    }
  }
}

TEST(ContinuousCollision, a_fast_box_does_not_pass_a_mesh) {
  Random random(3);
  int passed = 0;
  for (int i = 0; i < rounds(200); ++i) {
    World world;
    world.add_body(
        {.type = BodyType::fixed, .shapes = {TriangleMesh{.data = flat_mesh(40, 0.25)}}});
    const Vec3 from{random.in(-2, 2), random.in(0.5, 6), random.in(-2, 2)};
    const Vec3 to{random.in(-2, 2), 0, random.in(-2, 2)};
    const BodyId box = world.add_body({.shapes = {Box{.half_extents = {0.1, 0.2, 0.3}}},
                                       .position = from,
                                       .orientation = random.rotation(),
                                       .linear_velocity = 150 * (to - from).normalized(),
                                       .angular_velocity = 30 * random.on_sphere()});
    for (int n = 0; n < 60; ++n) world.step(kDt);
    const Vec3 at = world.pose(box).position;
    passed += at.y() < 0 && std::abs(at.x()) < 4.9 && std::abs(at.z()) < 4.9;
  }
  EXPECT_EQ(passed, 0);
}

// At 250 m/s, and after the first impact along the ground, from which the next hill rises.
TEST(ContinuousCollision, no_shape_passes_hills_whether_mesh_or_height_field) {
  const auto hill = [](double x, double z) { return 0.8 * std::sin(0.9 * x) * std::cos(0.7 * z); };
  const Shape field = field_shape(80, 0.25, hill),
              mesh = TriangleMesh{.data = mesh_of(80, 0.25, hill)};
  const Shape shapes[] = {Sphere{.radius = 0.1}, Capsule{.radius = 0.05, .half_height = 0.2},
                          Box{.half_extents = {0.1, 0.15, 0.2}},
                          Cylinder{.radius = 0.15, .half_height = 0.1}};
  Random random(4);
  int passed = 0, flew_on = 0;
  for (int i = 0; i < rounds(400); ++i) {
    World world;
    world.add_body({.type = BodyType::fixed, .shapes = {i / 4 % 2 == 0 ? field : mesh}});
    const Vec3 from{random.in(-3, 3), random.in(1.5, 8), random.in(-3, 3)};
    const double x = random.in(-3, 3), z = random.in(-3, 3);
    const BodyId body =
        world.add_body({.shapes = {shapes[i % 4]},
                        .position = from,
                        .orientation = random.rotation(),
                        .linear_velocity = 250 * (Vec3{x, hill(x, z), z} - from).normalized(),
                        .angular_velocity = 30 * random.on_sphere()});
    for (int n = 0; n < 5; ++n) world.step(kDt);
    const Vec3 at = world.pose(body).position;
    const bool over = std::abs(at.x()) < 9.9 && std::abs(at.z()) < 9.9;
    passed += over && at.y() < hill(at.x(), at.z()) - 0.02;
    flew_on += at.y() < -1;
  }
  EXPECT_EQ(passed, 0);
  EXPECT_EQ(flew_on, 0);
}

TEST(ContinuousCollision, bullets_meet_head_on_in_flight) {
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    World world({.gravity = {0, 0, 0}});
    const Vec3 middle{random.in(-50, 50), random.in(-50, 50), random.in(-50, 50)};
    const Vec3 along = random.on_sphere();
    const double near = random.in(0.5, 6), far = random.in(0.5, 6);
    const double v1 = random.in(100, 400), v2 = v1 * far / near;
    const auto bullet = [&](const Vec3& position, const Vec3& velocity) {
      return world.add_body({.shapes = {Sphere{.radius = 0.02}},
                             .position = position,
                             .linear_velocity = velocity,
                             .restitution = 1});
    };
    const BodyId a = bullet(middle - near * along, v1 * along);
    const BodyId b = bullet(middle + far * along, -v2 * along);
    for (int n = 0; n < 8; ++n) world.step(kDt);
    EXPECT_NEAR(world.linear_velocity(a).dot(along), -v2, 1e-3 * v2);
    EXPECT_NEAR(world.linear_velocity(b).dot(along), v1, 1e-3 * v1);
  }
}

TEST(ContinuousCollision, a_bullet_hits_a_crossing_body_and_a_sleeping_one) {
  for (const bool asleep : {false, true}) {
    World world({.gravity = {0, 0, 0}});
    const BodyId plate = world.add_body({.shapes = {Box{.half_extents = {0.001, 0.5, 0.5}}},
                                         .position = {2, 0, 0},
                                         .linear_velocity = {0, asleep ? 0.0 : 20.0, 0},
                                         .awake = !asleep});
    const BodyId bullet = world.add_body(
        {.shapes = {Sphere{.radius = 0.01}}, .linear_velocity = {300, 0, 0}, .friction = 0});
    for (int n = 0; n < 6; ++n) world.step(kDt);
    EXPECT_TRUE(world.awake(plate));
    EXPECT_GT(world.linear_velocity(plate).x(), 0.1);
    EXPECT_LT(world.linear_velocity(bullet).x(), 299);
    const Vec3 p = world.mass(bullet) * world.linear_velocity(bullet) +
                   world.mass(plate) * world.linear_velocity(plate);
    EXPECT_NEAR(p.x(), world.mass(bullet) * 300, 1e-6 * world.mass(bullet) * 300);
  }
}

// A body that another one throws at a wall in the same step.
TEST(ContinuousCollision, what_a_bullet_throws_does_not_pass_the_wall_behind) {
  for (const double gap : {0.02, 0.3, 1.0, 2.0}) {
    World world({.gravity = {0, 0, 0}});
    world.add_body({.type = BodyType::fixed,
                    .shapes = {Box{.half_extents = {0.0005, 3, 3}}},
                    .position = {gap + 0.02, 0, 0}});
    const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.01}}, .restitution = 1});
    const BodyId bullet = world.add_body({.shapes = {Sphere{.radius = 0.01}},
                                          .position = {-1, 0, 0},
                                          .linear_velocity = {300, 0, 0},
                                          .density = 20000,
                                          .restitution = 1});
    for (int n = 0; n < 20; ++n) {
      world.step(kDt);
      ASSERT_LT(world.pose(ball).position.x(), gap + 0.02) << "gap " << gap;
      ASSERT_LT(world.pose(bullet).position.x(), gap + 0.02) << "gap " << gap;
    }
  }
}

// -- The impact itself.

// Jolt's HighSpeed scene in small: bodies at 250 m/s in a closed room, restitution 1.
TEST(ContinuousCollision, no_body_leaves_a_closed_room_and_energy_stays_below_that_at_the_start) {
  World world({.gravity = {0, 0, 0}});
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      Vec3 half(5, 5, 5), at(0, 0, 0);
      half[axis] = 0.05;
      at[axis] = side * 5.05;
      world.add_body({.type = BodyType::fixed,
                      .shapes = {Box{.half_extents = half}},
                      .position = at,
                      .friction = 0,
                      .restitution = 1});
    }
  Random random(2);
  std::vector<BodyId> bodies;
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 6; ++y)
      for (int z = 0; z < 6; ++z) {
        const int i = (x * 6 + y) * 6 + z;
        const Shape shape =
            i % 2 ? Shape(Sphere{.radius = 0.1}) : Shape(Box{.half_extents = {0.1, 0.1, 0.1}});
        bodies.push_back(
            world.add_body({.shapes = {shape},
                            .position = {1.5 * x - 3.75, 1.5 * y - 3.75, 1.5 * z - 3.75},
                            .linear_velocity = 250 * random.on_sphere(),
                            .friction = 0,
                            .restitution = 1}));
      }
  const double at_start = mechanical_energy(world);
  for (int n = 0; n < 300; ++n) {
    world.step(kDt);
    ASSERT_LE(mechanical_energy(world), at_start * 1.0001) << "step " << n;
  }
  EXPECT_GE(mechanical_energy(world), at_start * 0.99);
  int outside = 0;
  for (const BodyId body : bodies) outside += world.pose(body).position.cwiseAbs().maxCoeff() > 5.0;
  EXPECT_EQ(outside, 0);
}

// A5 at speed: Newton's law holds for the speed at the moment of impact.
TEST(ContinuousCollision, fast_balls_rebound_with_their_restitution) {
  for (const double speed : {20.0, 100.0, 700.0}) {
    for (const double e : {0.0, 0.5, 1.0}) {
      World world({.gravity = {0, 0, 0}});
      add_floor(world, 0, e);
      const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.05}},
                                          .position = {0, 3.3, 0},
                                          .linear_velocity = {0, -speed, 0},
                                          .restitution = e});
      double fastest = -speed;
      for (int n = 0; n < 30; ++n) {
        world.step(kDt);
        fastest = std::max(fastest, world.linear_velocity(ball).y());
      }
      EXPECT_NEAR(fastest, e * speed, 1e-5 * speed) << "e = " << e << ", " << speed << " m/s";
    }
  }
}

// The step ends at the wall with the velocity that gravity and a user's force give on the way there.
TEST(ContinuousCollision, a_step_cut_short_keeps_the_work_of_forces) {
  World world;
  world.add_body({.type = BodyType::fixed,
                  .shapes = {Box{.half_extents = {0.5, 5, 5}}},
                  .position = {1.51, 0, 0},
                  .restitution = 1});
  const BodyId ball =
      world.add_body({.shapes = {Sphere{.radius = 0.01}}, .linear_velocity = {100, 0, 0}});
  const double acceleration = 2000;
  world.apply_force(ball, {acceleration * world.mass(ball), 0, 0});
  world.step(kDt);
  const Vec3 at = world.pose(ball).position, v = world.linear_velocity(ball);
  EXPECT_NEAR(at.x(), 1, 1e-3) << "the step ends at the wall";
  EXPECT_NEAR(v.x() * v.x(), 100 * 100 + 2 * acceleration * at.x(), 1e-6);
  EXPECT_NEAR(v.y() * v.y(), 2 * 9.81 * -at.y(), 1e-9);
}

TEST(ContinuousCollision, a_fast_ball_slants_off_like_light) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    World world({.gravity = {0, 0, 0}});
    add_floor(world, 0, 1);
    Vec3 v = 200 * random.on_sphere();
    v.y() = -std::abs(v.y()) - 10;
    const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.05}},
                                        .position = {0, random.in(0.1, 6), 0},
                                        .linear_velocity = v,
                                        .friction = 0,
                                        .restitution = 1});
    for (int n = 0; n < 60 && world.linear_velocity(ball).y() < 0; ++n) world.step(kDt);
    const Vec3 expected(v.x(), -v.y(), v.z());
    EXPECT_LT((world.linear_velocity(ball) - expected).norm(), 1e-5 * v.norm());
  }
}

TEST(ContinuousCollision, an_elastic_impact_of_a_tumbling_box_keeps_its_energy) {
  Random random(9);
  for (int i = 0; i < rounds(200); ++i) {
    World world({.gravity = {0, 0, 0}});
    add_floor(world, 0, 1);
    Vec3 v = 250 * random.on_sphere();
    v.y() = -std::abs(v.y()) - 50;
    const BodyId box = world.add_body({.shapes = {Box{.half_extents = {0.1, 0.15, 0.2}}},
                                       .position = {0, random.in(0.5, 3), 0},
                                       .orientation = random.rotation(),
                                       .linear_velocity = v,
                                       .angular_velocity = 100 * random.on_sphere(),
                                       .friction = 0,
                                       .restitution = 1});
    const double before = mechanical_energy(world);
    for (int n = 0; n < 40 && world.linear_velocity(box).y() < 0; ++n) world.step(kDt);
    // Two corners at once may share more than one blow.
    EXPECT_LT(mechanical_energy(world), 1.1 * before);
    EXPECT_GT(mechanical_energy(world), 0.9 * before);
  }
}

// -- What passes by is not touched.

void expect_straight(World& world, BodyId body, int steps) {
  const Vec3 v = world.linear_velocity(body), w = world.angular_velocity(body);
  const Vec3 from = world.pose(body).position;
  for (int n = 0; n < steps; ++n) world.step(kDt);
  EXPECT_LT((world.linear_velocity(body) - v).norm(), 1e-5 * v.norm());
  EXPECT_LT((world.angular_velocity(body) - w).norm(), 1e-5);
  EXPECT_LT((world.pose(body).position - (from + steps * kDt * v)).norm(),
            1e-5 * steps * kDt * v.norm());
}

TEST(ContinuousCollision, a_ball_that_passes_an_edge_is_not_deflected) {
  for (const double speed : {5.0, 30.0, 300.0})
    for (const double clearance : {0.001, 0.01, 0.1})
      for (const double start : {-3.0, -1.37, -0.6, -0.52, -0.5}) {
        World world({.gravity = {0, 0, 0}});
        world.add_body({.type = BodyType::fixed, .shapes = {Box{}}, .restitution = 1});
        const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.01}},
                                            .position = {start, 0.51 + clearance, 0.1},
                                            .linear_velocity = {speed, 0, 0}});
        SCOPED_TRACE(testing::Message() << speed << " m/s, " << clearance << " m, " << start);
        expect_straight(world, ball, 8);
      }
}

// Of squares of 0.7 m.
enum class Ground { tiles, mesh, field };
const char* name_of_ground(Ground ground) {
  constexpr const char* kNames[] = {"tiles", "mesh", "height field"};
  return kNames[static_cast<int>(ground)];
}
void add_ground(World& world, Ground ground, double friction) {
  if (ground != Ground::tiles) {
    const Shape shape = ground == Ground::mesh ? Shape{TriangleMesh{.data = flat_mesh(60, 0.7)}}
                                               : field_shape(60, 0.7, flat);
    world.add_body({.type = BodyType::fixed, .shapes = {shape}, .friction = friction});
    return;
  }
  for (int x = -40; x < 40; ++x)
    for (int z = -2; z <= 2; ++z)
      world.add_body({.type = BodyType::fixed,
                      .shapes = {Box{.half_extents = {0.35, 0.1, 0.35}}},
                      .position = {0.7 * x, -0.1, 0.7 * z},
                      .friction = friction});
}

TEST(ContinuousCollision, a_ball_over_tiles_a_mesh_or_a_height_field_is_not_deflected) {
  for (const Ground ground : {Ground::tiles, Ground::mesh, Ground::field})
    for (const double clearance : {0.0005, 0.01})
      for (const double speed : {3.0, 40.0, 300.0}) {
        World world({.gravity = {0, 0, 0}});
        add_ground(world, ground, 0.5);
        const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.1}},
                                            .position = {-8, 0.1 + clearance, 0.123},
                                            .linear_velocity = {speed, 0, 0.01 * speed}});
        SCOPED_TRACE(testing::Message()
                     << name_of_ground(ground) << " " << clearance << " " << speed);
        expect_straight(world, ball, 4);
      }
}

TEST(ContinuousCollision, a_fast_puck_on_tiles_keeps_its_way) {
  for (const Ground ground : {Ground::tiles, Ground::mesh, Ground::field}) {
    SCOPED_TRACE(name_of_ground(ground));
    World world;
    add_ground(world, ground, 0);
    const BodyId puck = world.add_body({.shapes = {Box{.half_extents = {0.1, 0.1, 0.1}}},
                                        .position = {-18, 0.1, 0.123},
                                        .linear_velocity = {40, 0, 0},
                                        .friction = 0});
    for (int n = 0; n < 50; ++n) world.step(kDt);
    EXPECT_NEAR(world.pose(puck).position.x(), -18 + 50 * kDt * 40, 1e-2);
    EXPECT_NEAR(world.linear_velocity(puck).x(), 40, 1e-2);
  }
}

TEST(ContinuousCollision, works_a_thousand_kilometres_from_the_origin) {
  const Vec3 far(1e6, -1e6, 1e6);
  Random random(6);
  for (int i = 0; i < rounds(200); ++i) {
    World world;
    world.add_body({.type = BodyType::fixed,
                    .shapes = {Box{.half_extents = {0.0005, 3, 3}}},
                    .position = far});
    const Vec3 from{random.in(-6, -0.05), random.in(-1, 1), random.in(-1, 1)};
    const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.01}},
                                        .position = far + from,
                                        .linear_velocity = 300 * (-from).normalized()});
    for (int n = 0; n < 4; ++n) world.step(kDt);
    EXPECT_LT(world.pose(ball).position.x(), far.x());
  }
}

// Without it contacts foresee the whole step from where it begins: the plane of the nearest edge
// stops what would have passed.
TEST(ContinuousCollision, can_be_left_out_for_a_body_or_a_world) {
  const auto speed_after = [](bool in_world, ContinuousCollision of_body) {
    World world({.gravity = {0, 0, 0}, .continuous = in_world});
    world.add_body({.type = BodyType::fixed, .shapes = {Box{}}});
    const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.01}},
                                        .position = {-3, 0.52, 0.1},
                                        .linear_velocity = {300, 0, 0},
                                        .continuous = of_body});
    world.step(kDt);
    return world.linear_velocity(ball).x();
  };
  EXPECT_EQ(speed_after(true, ContinuousCollision::automatic), 300);
  EXPECT_LT(speed_after(true, ContinuousCollision::never), 299);
  EXPECT_LT(speed_after(false, ContinuousCollision::automatic), 299);
}

// A suite of its own: those of EveryMode run under every name that it is instantiated by.
class FastBodiesInEveryMode : public EveryMode {};

TEST_P(FastBodiesInEveryMode, gives_the_serial_bits) {
  const auto hashes = [](World& world) {
    Random random(1);
    add_floor(world, 0.5, 0.3, 20);
    world.add_body({.type = BodyType::fixed,
                    .shapes = {TriangleMesh{.data = flat_mesh(30, 1)}},
                    .position = {0, 0.5, 0},
                    .restitution = 0.7});
    for (int i = 0; i < 140; ++i)
      world.add_body({.shapes = {bullet_shape(i)},
                      .position = {random.in(-4, 4), random.in(1, 9), random.in(-4, 4)},
                      .orientation = random.rotation(),
                      .linear_velocity = random.up_to(150),
                      .angular_velocity = random.up_to(100),
                      .restitution = 0.5});
    std::vector<std::uint64_t> out;
    for (int n = 0; n < 60; ++n) {
      step(world, kDt);
      out.push_back(world.state_hash());
    }
    return out;
  };
  static const std::vector<std::uint64_t> serial = [&] {
    World world;
    return hashes(world);
  }();
  World world = make_world(GetParam());
  EXPECT_EQ(hashes(world), serial);
}
INSTANTIATE_TEST_SUITE_P(ContinuousCollision, FastBodiesInEveryMode,
                         testing::ValuesIn(every_mode()), name_of);

}  // namespace
}  // namespace skerry::test
