// What the step report measures (WorldSettings::measure_steps), and truths that need it: momentum,
// energy and the law of contact. Default settings otherwise.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

constexpr double kG = 9.81;

Vec3 vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

WorldSettings measured(Vec3 gravity = {0, -kG, 0}) {
  WorldSettings settings;
  settings.gravity = gravity;
  settings.sleep.enabled = false;
  settings.measure_steps = true;
  return settings;
}

std::vector<BodyId> add_stack(World& world, int count) {
  std::vector<BodyId> boxes;
  for (int i = 0; i < count; ++i) boxes.push_back(add_box(world, {0, 0.5 + i, 0}));
  return boxes;
}

// Boxes, balls, capsules and cylinders in a loose heap.
void add_heap(World& world, int count) {
  for (int i = 0; i < count; ++i) {
    const Vec3 at(0.9 * (i % 4) + 0.03 * (i % 7), 0.7 + 0.8 * (i / 16),
                  0.9 * (i / 4 % 4) - 0.02 * (i % 5));
    Shape shape = Box{.half_extents = {0.3, 0.25, 0.35}};
    if (i % 4 == 1) shape = Sphere{.radius = 0.3};
    if (i % 4 == 2) shape = Capsule{.radius = 0.2, .half_height = 0.2};
    if (i % 4 == 3) shape = Cylinder{.radius = 0.25, .half_height = 0.25};
    world.add_body({.shapes = {shape}, .position = at});
  }
}

TEST(Measures, are_zero_in_the_report_unless_asked_for) {
  World world;
  add_floor(world);
  add_stack(world, 2);
  world.step(1.0 / 60);
  EXPECT_EQ(world.last_report().measures.contact_points, 0u);
  EXPECT_EQ(world.last_report().measures.kinetic_energy, 0);
  EXPECT_EQ(world.measure().contacts.normal_impulse, 0);
  EXPECT_GT(world.measure().contact_points, 0u);
}

TEST(Measures, change_no_bit_of_the_state) {
  World plain, watched({.measure_steps = true});
  BusyScene a(plain), b(watched);
  for (int n = 0; n < 60; ++n) {
    a.advance(plain, n);
    b.advance(watched, n);
    ASSERT_EQ(plain.state_hash(), watched.state_hash()) << "step " << n;
  }
}

class MeasuresInEveryMode : public testing::TestWithParam<ModeAndWorkers> {};

TEST_P(MeasuresInEveryMode, are_the_same_bits) {
  const auto measures = [](const ModeAndWorkers& mode) {
    World world({.mode = mode.mode, .workers = mode.workers, .measure_steps = true});
    BusyScene scene(world);
    for (int n = 0; n < 90; ++n) scene.advance(world, n);
    const Measures& m = world.last_report().measures;
    const ContactLaw& law = m.contacts.law;
    return std::vector<double>{
        m.kinetic_energy,   m.potential_energy,     m.angular_momentum[0],
        m.penetration_mean, m.contacts.energy_lost, m.contacts.impulse_from_ground[1],
        law.impulse_mean,   law.normal_mean,        law.normal_max,
        law.friction_mean,  law.friction_max,       m.contacts.normal_impulse};
  };
  static const std::vector<double> serial = measures({ThreadingMode::serial, 1});
  EXPECT_GT(serial[11], 0);
  EXPECT_EQ(measures(GetParam()), serial);
}
INSTANTIATE_TEST_SUITE_P(Analytic, MeasuresInEveryMode, testing::ValuesIn(every_mode()), name_of);

// T_before = T_after + T_lost, as the kinetic energies of an impact say: reduced mass, (1 - e^2) / 2.
TEST(Measures, an_impact_loses_what_restitution_says) {
  for (const double e : {0.0, 0.5, 0.9, 1.0}) {
    World world(measured({0, 0, 0}));
    const auto sphere = [&](double x, double mass, double v) {
      return world.add_body({.shapes = {Sphere{.radius = 0.5}},
                             .position = {x, 0, 0},
                             .linear_velocity = {v, 0, 0},
                             .restitution = e,
                             .mass = MassOverride{.mass = mass}});
    };
    sphere(-1, 1, 3);
    sphere(1, 3, -1);
    double lost = 0;
    for (int n = 0; n < 60; ++n) lost += world.step(1.0 / 60).measures.contacts.energy_lost;
    const double reduced = 1.0 * 3 / (1 + 3), closing = 4;
    EXPECT_NEAR(lost, 0.5 * reduced * closing * closing * (1 - e * e), 1e-5) << "e = " << e;
  }
}

// Whatever energy goes, contacts took it: nothing else acts here.
TEST(Measures, contacts_account_for_all_the_energy_a_heap_loses) {
  World world(measured());
  add_floor(world);
  add_heap(world, 64);
  const Measures before = world.measure();
  double lost = 0;
  for (int n = 0; n < 240; ++n) lost += world.step(1.0 / 60).measures.contacts.energy_lost;
  const Measures after = world.measure();
  const double gone = before.kinetic_energy + before.potential_energy - after.kinetic_energy -
                      after.potential_energy;
  EXPECT_GT(gone, 1000);
  EXPECT_NEAR(lost, gone, 1e-10 * gone);
}

// A12. What the ground gives to a stack at rest is its weight, and each contact carries what lies
// above it.
TEST(Measures, ground_gives_a_stack_its_weight_in_every_step) {
  constexpr double kDt = 1.0 / 60;
  World world(measured());
  add_floor(world);
  add_stack(world, 10);
  for (int n = 0; n < 120; ++n) world.step(kDt);
  const double weight = 10 * 1000 * kG * kDt;
  for (int n = 0; n < 10; ++n) {
    const ContactMeasures contacts = world.step(kDt).measures.contacts;
    const Vec3 given = vector(contacts.impulse_from_ground);
    EXPECT_NEAR(given.y(), weight, 0.001 * weight);
    EXPECT_LT(std::hypot(given.x(), given.z()), 0.01 * weight);
    EXPECT_NEAR(contacts.normal_impulse, 5.5 * weight, 0.001 * 5.5 * weight);
  }
}

// A14.
void expect_law(const ContactLaw& law, double most) {
  EXPECT_GT(law.manifolds, 0u);
  EXPECT_EQ(law.pull_max, 0);
  EXPECT_LT(law.cone_max, 1e-5);
  EXPECT_LT(law.normal_mean, most);
  EXPECT_LT(law.friction_mean, most);
}

TEST(Measures, contacts_of_a_stack_keep_their_law) {
  World world(measured());
  add_floor(world);
  add_stack(world, 10);
  for (int n = 0; n < 240; ++n) world.step(1.0 / 60);
  expect_law(world.last_report().measures.contacts.law, 1e-2);
}

TEST(Measures, contacts_of_a_pile_keep_their_law) {
  World world(measured());
  add_floor(world);
  add_heap(world, 128);
  for (int n = 0; n < 180; ++n) world.step(1.0 / 60);
  // Where it rolls and slips still, a step is worth little by itself.
  constexpr int kSteps = 120;
  ContactLaw mean;
  for (int n = 0; n < kSteps; ++n) {
    const ContactLaw& law = world.step(1.0 / 60).measures.contacts.law;
    expect_law(law, 0.5);
    mean.normal_mean += law.normal_mean / kSteps;
    mean.friction_mean += law.friction_mean / kSteps;
  }
  EXPECT_LT(mean.normal_mean, 0.06);
  EXPECT_LT(mean.friction_mean, 0.05);
}

struct CloudDesc {
  double friction = 0.5, restitution = 0.5;
  AxisLocks locks = {};  // of every fifth
};

// Five hundred bodies that meet in empty space.
std::vector<BodyId> add_cloud(World& world, const CloudDesc& cloud = {}) {
  std::vector<BodyId> bodies;
  for (int i = 0; i < 500; ++i) {
    const Vec3 at(1.0 * (i % 8) - 3.5, 1.0 * (i / 8 % 8) - 3.5, 1.0 * (i / 64) - 3.5);
    const Vec3 away(std::sin(3.0 * i), std::sin(5.0 * i + 1), std::sin(7.0 * i + 2));
    Shape shape = Box{.half_extents = {0.3, 0.2, 0.25}};
    if (i % 4 == 1) shape = Sphere{.radius = 0.3};
    if (i % 4 == 2) shape = Capsule{.radius = 0.2, .half_height = 0.2};
    if (i % 4 == 3)
      shape =
          ConvexHull{.points = {{0.3, -0.2, 0.3}, {-0.3, -0.2, 0.3}, {0, -0.2, -0.4}, {0, 0.4, 0}}};
    BodyDesc body{.shapes = {shape},
                  .position = at,
                  .linear_velocity = 3 * away - at + Vec3(0.5, 0.2, -0.1),
                  .angular_velocity = 4 * Vec3(away.z(), away.x(), away.y()),
                  .friction = cloud.friction,
                  .restitution = cloud.restitution};
    if (i % 5 == 0) body.locks = cloud.locks;
    bodies.push_back(world.add_body(body));
  }
  return bodies;
}

// A13. With restitution and without, fast bodies among them (at 60 Hz), rough and smooth.
void expect_momenta_kept(const CloudDesc& cloud, double dt, double duration) {
  World world(measured({0, 0, 0}));
  add_cloud(world, cloud);
  const Measures start = world.measure();
  const Vec3 p0 = vector(start.momentum), l0 = vector(start.angular_momentum);
  double energy = start.kinetic_energy, most_gained = 0;
  std::uint64_t touched = 0;
  for (int n = 0; n * dt < duration; ++n) {
    const Measures m = world.step(dt).measures;
    touched += m.contact_points;
    most_gained = std::max(most_gained, (m.kinetic_energy - energy) / energy);
    energy = m.kinetic_energy;
  }
  const Measures end = world.measure();
  EXPECT_GT(touched, 1000u);
  EXPECT_LT((vector(end.momentum) - p0).norm(), 1e-12 * p0.norm());
  EXPECT_LT((vector(end.angular_momentum) - l0).norm(), 1e-4 * l0.norm());
  EXPECT_LE(most_gained, 1e-12);
  EXPECT_LT(energy, (cloud.restitution < 1 ? 0.9 : 1.0) * start.kinetic_energy);
}

TEST(Measures, a_cloud_in_empty_space_keeps_its_momenta_and_gains_no_energy) {
  expect_momenta_kept({}, 1.0 / 60, 10);
  expect_momenta_kept({}, 1.0 / 240, 5);
}

TEST(Measures, so_does_a_cloud_that_does_not_bounce) {
  expect_momenta_kept({.restitution = 0}, 1.0 / 60, 10);
  expect_momenta_kept({.friction = 1, .restitution = 0}, 1.0 / 240, 5);
}

TEST(Measures, so_does_a_cloud_that_bounces_without_loss) {
  expect_momenta_kept({.friction = 0, .restitution = 1}, 1.0 / 60, 5);
  expect_momenta_kept({.friction = 1, .restitution = 0.9}, 1.0 / 60, 5);
}

// In a closed room without gravity nothing gives energy.
TEST(Measures, elastic_bodies_in_a_closed_room_gain_no_energy) {
  World world(measured({0, 0, 0}));
  for (int side = 0; side < 6; ++side) {
    Vec3 at = Vec3::Zero();
    at[side / 2] = side % 2 ? 4 : -4;
    world.add_body({.type = BodyType::fixed,
                    .shapes = {Box{.half_extents = Vec3(5, 5, 5) - at.cwiseAbs()}},
                    .position = at * 1.5,
                    .restitution = 1});
  }
  add_cloud(world, {.friction = 0, .restitution = 1});
  const double start = world.measure().kinetic_energy;
  double energy = start, most_gained = 0;
  for (int n = 0; n < 300; ++n) {
    const Measures m = world.step(1.0 / 240).measures;
    most_gained = std::max(most_gained, (m.kinetic_energy - energy) / energy);
    energy = m.kinetic_energy;
  }
  EXPECT_LE(most_gained, 1e-12);
  EXPECT_GT(energy, 0.95 * start);
}

// Bodies of a cloud are moved apart, and back for the sake of its angular momentum, never along these.
TEST(Measures, a_cloud_moves_no_body_along_its_locked_axes) {
  World world(measured({0, 0, 0}));
  const std::vector<BodyId> bodies =
      add_cloud(world, {.locks = {.translation = {false, true, false}}});
  std::vector<Vec3> start;
  for (const BodyId body : bodies) start.push_back(world.center_of_mass(body));
  for (int n = 0; n < 200; ++n) world.step(1.0 / 60);
  int moved = 0;
  for (std::size_t i = 0; i < bodies.size(); i += 5) {
    const Vec3 now = world.center_of_mass(bodies[i]);
    EXPECT_EQ(now.y(), start[i].y()) << i;
    moved += (now - start[i]).norm() > 0.1 ? 1 : 0;
  }
  EXPECT_GT(moved, 90);
}

// Impacts of bodies that fly keep the angular momentum to rounding, whatever their shapes.
TEST(Measures, two_bodies_that_meet_in_empty_space_keep_their_angular_momentum) {
  const Shape shapes[] = {Box{.half_extents = {0.3, 0.2, 0.25}}, Sphere{.radius = 0.3},
                          Capsule{.radius = 0.2, .half_height = 0.2},
                          Cylinder{.radius = 0.25, .half_height = 0.2}};
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    for (const double e : {0.0, 0.2, 0.5, 1.0}) {
      for (int i = 0; i < 16; ++i) {
        World world(measured({0, 0, 0}));
        BodyId body;
        for (const double side : {-1.0, 1.0}) {
          body = world.add_body({.shapes = {shapes[side < 0 ? i / 4 : i % 4]},
                                 .position = {0.7 * side, 0.08 * side, 5},
                                 .linear_velocity = {-2.5 * side, 1, 0.3 * side},
                                 .angular_velocity = {0.5 * side, 1, 2},
                                 .friction = 0.1 * (i % 5),
                                 .restitution = e});
        }
        const Measures start = world.measure();
        for (int n = 0; n < 30 || n < 0.5 / dt; ++n) world.step(dt);
        const Measures end = world.measure();
        const Vec3 l0 = vector(start.angular_momentum);
        // Without a rebound, or after a weak one, they touch for longer.
        const double exact = e < 0.5 ? 1e-7 : 1e-10;
        EXPECT_LT((vector(end.angular_momentum) - l0).norm(), exact * l0.norm()) << i << " " << e;
        EXPECT_LT(end.kinetic_energy, start.kinetic_energy * (1 + 1e-6)) << i << " " << e;
        EXPECT_GT(world.linear_velocity(body).x(), -2.4) << i << " " << e;
      }
    }
  }
}

// A4. The free box of the "boxes" benchmark (S. Peters, scpeters/benchmark): L and E hold, and the
// spin about the middle axis changes sign when the exact solution says.
TEST(Measures, a_tumbling_box_keeps_momentum_and_energy_and_flips_on_time) {
  World world(measured({0, 0, -9.8}));
  const BodyId box = world.add_body({.shapes = {Box{.half_extents = {0.05, 0.2, 0.45}}},
                                     .linear_velocity = {-2, 2, 8},
                                     .angular_velocity = {0.1, 5, 0.1},
                                     .mass = MassOverride{.mass = 10}});
  const Vec3 l0 = world.angular_momentum(box);
  const double e0 = world.measure().kinetic_energy;
  std::vector<double> flips;
  double before = 5;
  for (int n = 1; n <= 10000; ++n) {
    const Measures m = world.step(0.001).measures;
    const Quat back = world.pose(box).orientation.conjugate();
    const double now = (back * world.angular_velocity(box)).y();
    if ((before > 0) != (now > 0)) flips.push_back(0.001 * (n - 1 + before / (before - now)));
    before = now;
    ASSERT_NEAR(m.kinetic_energy + m.potential_energy, e0, 1e-9 * e0);
  }
  EXPECT_LT((world.angular_momentum(box) - l0).norm(), 1e-9 * l0.norm());
  const Vec3 end = Vec3(-2, 2, 8) * 10 + 0.5 * 100 * Vec3(0, 0, -9.8);
  EXPECT_LT((world.pose(box).position - end).norm(), 1e-9);
  ASSERT_EQ(flips.size(), 3u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(flips[static_cast<std::size_t>(k)], 1.1660 + 3.0284 * k, 2e-4) << k;
  }
}

}  // namespace
}  // namespace skerry::test
