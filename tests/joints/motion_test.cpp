// Jointed motion with closed forms or reference integrations, at default settings.
#include <gtest/gtest.h>

#include <array>

#include "tests/joints/joint_worlds.h"

namespace skerry::test {
namespace {

class BothSteps : public testing::TestWithParam<double> {
 protected:
  double dt() const { return GetParam(); }
};
INSTANTIATE_TEST_SUITE_P(Joints, BothSteps, testing::Values(1.0 / 60, 1.0 / 240),
                         [](const auto& given) { return given.param < 0.01 ? "dt_240" : "dt_60"; });

// Period of a body that swings about z from rest at `angle` to the vertical: four times the time to
// the lowest point, the mean over `swings` half swings.
double period_of_pendulum(double angle, double dt, int swings) {
  World world;
  constexpr double kLength = 0.7, kMass = 2, kMoment = 0.1;
  const Vec3 at = kLength * Vec3(std::sin(angle), -std::cos(angle), 0);
  const BodyId bob = add_point(world, at, kMass, kMoment);
  world.add_joint(HingeJoint{.b = bob, .axis = {0, 0, 1}});
  double t = 0, first = -1, last = -1, before = angle;
  for (int passes = 0; passes <= swings; t += dt) {
    world.step(dt);
    const Vec3 p = world.pose(bob).position;
    const double now = std::atan2(p.x(), -p.y());
    if (before * now < 0 && std::abs(before) < 1) {
      last = t + dt * before / (before - now);
      if (first < 0) first = last;
      ++passes;
    }
    before = now;
    if (t > 100) return 0;
  }
  return 2 * (last - first) / swings;
}
double small_period() {  // 2 pi sqrt(I / (m g l))
  return 2 * kPi * std::sqrt((0.1 + 2 * 0.7 * 0.7) / (2 * kG * 0.7));
}

// A16. Complete elliptic integral: T / T0 = 1.37288 from 120 degrees, 1 + a^2 / 16 when small.
TEST_P(BothSteps, a_hinged_pendulum_keeps_the_period_of_its_amplitude) {
  const double wide = period_of_pendulum(2 * kPi / 3, dt(), 8) / small_period();
  EXPECT_NEAR(wide, 1.37288, 0.001 * 1.37288);
  const double small = period_of_pendulum(0.05, dt(), 8) / small_period();
  EXPECT_NEAR(small, 1 + 0.05 * 0.05 / 16, 1e-3);
}

// Angles of a double pendulum of two slender rods by Runge-Kutta with 10 us steps.
std::array<double, 2> reference_double_pendulum(double angle1, double angle2, double length,
                                                double seconds) {
  using State = std::array<double, 4>;
  // (1/3+1) l q1'' + 1/2 l cos(d) q2'' = ..., in units of mass: rods of equal mass and length.
  const auto rate = [&](const State& s) -> State {
    const double d = s[0] - s[1], g = kG / length;
    const double a = 4.0 / 3, b = 0.5 * std::cos(d), c = 1.0 / 3;
    const double f1 = -1.5 * g * std::sin(s[0]) - 0.5 * std::sin(d) * s[3] * s[3];
    const double f2 = -0.5 * g * std::sin(s[1]) + 0.5 * std::sin(d) * s[2] * s[2];
    const double det = a * c - b * b;
    return {s[2], s[3], (f1 * c - b * f2) / det, (a * f2 - b * f1) / det};
  };
  State s = {angle1, angle2, 0, 0};
  const double h = 1e-5;
  const auto ahead = [](const State& at, const State& by, double t) {
    State r = at;
    for (std::size_t i = 0; i < 4; ++i) r[i] += t * by[i];
    return r;
  };
  for (int n = static_cast<int>(std::lround(seconds / h)); n > 0; --n) {
    const State k1 = rate(s), k2 = rate(ahead(s, k1, h / 2)), k3 = rate(ahead(s, k2, h / 2)),
                k4 = rate(ahead(s, k3, h));
    for (std::size_t i = 0; i < 4; ++i) s[i] += h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
  }
  return {s[0], s[1]};
}

TEST_P(BothSteps, a_double_pendulum_follows_its_equation_of_motion) {
  static constexpr double kLength = 1;
  const auto tip = [](const Vec3& from, double angle) -> Vec3 {
    return from + kLength * Vec3(std::sin(angle), -std::cos(angle), 0);
  };
  World world;
  const Vec3 knee = tip({0, 0, 0}, 1.2), end = tip(knee, 0.4);
  const BodyId upper = add_rod(world, {0, 0, 0}, knee, 1), lower = add_rod(world, knee, end, 1);
  world.add_joint(HingeJoint{.b = upper});
  world.add_joint(HingeJoint{.a = upper, .b = lower, .anchor = knee});
  run(world, 1, dt());
  const auto expected = reference_double_pendulum(1.2, 0.4, kLength, 1);
  const Vec3 true_knee = tip({0, 0, 0}, expected[0]);
  EXPECT_LT((world.pose(upper).position - 0.5 * true_knee).norm(), 1e-3);
  EXPECT_LT((world.pose(lower).position - 0.5 * (true_knee + tip(true_knee, expected[1]))).norm(),
            1e-3);
}

// x'' = -w^2 x - 2 zeta w x', from x0 at rest, loaded with a constant acceleration.
double oscillator(double x0, double frequency, double zeta, double load, double t) {
  const double w = 2 * kPi * frequency, rest = load / (w * w);
  const double x = x0 - rest, c = zeta * w;
  if (zeta < 1) {
    const double d = w * std::sqrt(1 - zeta * zeta);
    return rest + std::exp(-c * t) * x * (std::cos(d * t) + c / d * std::sin(d * t));
  }
  return rest + std::exp(-w * t) * x * (1 + w * t);
}

struct SpringCase {
  double frequency, damping_ratio;
};
class Springs : public testing::TestWithParam<SpringCase> {
 protected:
  JointDrive drive() const {
    return {
        .spring = {.frequency = GetParam().frequency, .damping_ratio = GetParam().damping_ratio}};
  }
  double expected(double x0, double load, double t) const {
    return oscillator(x0, GetParam().frequency, GetParam().damping_ratio, load, t);
  }
};
INSTANTIATE_TEST_SUITE_P(Joints, Springs,
                         testing::Values(SpringCase{1, 0}, SpringCase{2, 0.1}, SpringCase{1, 0.5},
                                         SpringCase{2, 1}));

TEST_P(Springs, a_slider_spring_is_the_damped_oscillator_under_gravity) {
  for (const double dt : {1.0 / 60, 1.0 / 240}) {
    World world({.sleep = {.enabled = false}});
    const BodyId bob = add_point(world, {0, 0, 0}, 3, 0.2);
    world.add_joint(SliderJoint{.b = bob, .axis = {0, 1, 0}, .drive = drive()});
    double worst = 0;
    for (int n = 1; n * dt <= 2; ++n) {
      world.step(dt);
      worst = std::max(worst, std::abs(world.pose(bob).position.y() - expected(0, -kG, n * dt)));
    }
    EXPECT_LT(worst, dt > 0.01 ? 6e-6 : 4e-7) << "dt " << dt;
  }
}
TEST_P(Springs, a_hinge_spring_swings_with_the_inertia_about_the_hinge) {
  World world({.gravity = {0, 0, 0}, .sleep = {.enabled = false}});
  const BodyId door = add_point(world, {0.8, 0, 0}, 3, 0.2);
  const JointId hinge = world.add_joint(HingeJoint{.b = door, .axis = {0, 1, 0}, .drive = drive()});
  // Turned by 0.5 rad about the hinge.
  const Quat turn(Eigen::AngleAxisd(0.5, Vec3::UnitY()));
  world.set_pose(door, {turn * Vec3(0.8, 0, 0), turn});
  double worst = 0;
  for (int n = 1; n <= 120; ++n) {
    world.step(kDt);
    worst = std::max(worst, std::abs(world.hinge_angle(hinge) - expected(0.5, 0, n * kDt)));
  }
  EXPECT_LT(worst, 1e-4);
}
TEST_P(Springs, a_distance_spring_is_the_oscillator_of_the_reduced_mass) {
  World world({.gravity = {0, 0, 0}, .sleep = {.enabled = false}});
  const BodyId a = add_point(world, {0, 0, 0}, 1, 0.1), b = add_point(world, {2.3, 0, 0}, 3, 0.1);
  JointDrive pull = drive();
  pull.spring.rest = 2;
  const JointId spring =
      world.add_joint(DistanceJoint{.a = a, .b = b, .anchor_b = {2.3, 0, 0}, .drive = pull});
  double worst = 0;
  for (int n = 1; n <= 120; ++n) {
    world.step(kDt);
    worst = std::max(worst, std::abs(world.joint_position(spring, JointCoordinate::distance) - 2 -
                                     expected(0.3, 0, n * kDt)));
  }
  EXPECT_LT(worst, 3e-5);
}

// ---- Conservation.

std::vector<BodyId> add_chain(World& world, int links, const Vec3& step, bool anchored) {
  std::vector<BodyId> chain;
  for (int i = 0; i < links; ++i) {
    chain.push_back(add_rod(world, i * step, (i + 1) * step, 1));
    if (i > 0 || anchored) {
      world.add_joint(BallJoint{.a = i > 0 ? chain[static_cast<std::size_t>(i) - 1] : BodyId{},
                                .b = chain.back(),
                                .anchor = i * step});
    }
  }
  return chain;
}

TEST_P(BothSteps, a_swinging_chain_gains_no_energy) {
  World world;
  add_chain(world, 12, {0.5, 0, 0}, true);
  const double start = energy(world);
  double most = start, least = start;
  for (int n = 0; n * dt() < 10; ++n) {
    world.step(dt());
    most = std::max(most, energy(world));
    least = std::min(least, energy(world));
  }
  const double scale = 12 * kG * 3;  // J, to hang straight down
  EXPECT_LT(most - start, 1e-3 * scale);
  EXPECT_GT(least - start, -0.5 * scale);
}

TEST(Joints, internal_joints_keep_momentum_and_angular_momentum) {
  World world({.gravity = {0, 0, 0}});
  const std::vector<BodyId> chain = add_chain(world, 8, {0.5, 0, 0}, false);
  const BodyId box = world.add_body({.shapes = {Box{.half_extents = {0.1, 0.2, 0.4}}},
                                     .position = {4.2, 0.2, 0.4},
                                     .angular_velocity = {1, 2, 3}});
  world.add_joint(
      HingeJoint{.a = chain.back(),
                 .b = box,
                 .anchor = {4, 0, 0},
                 .axis = {0, 1, 0},
                 .lower_angle = -0.5,
                 .upper_angle = 0.5,
                 .drive = {.spring = {.frequency = 1, .damping_ratio = 0.2}, .friction = 0.5}});
  world.set_velocity(chain[0], {1, 5, 2}, {0, 3, 4});
  const Measures before = world.measure();
  run(world, 5);
  const Measures after = world.measure();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(after.momentum[i], before.momentum[i], 1e-9 * 10);
    EXPECT_NEAR(after.angular_momentum[i], before.angular_momentum[i], 1e-9 * 10);
  }
  EXPECT_LT(after.kinetic_energy, before.kinetic_energy);
}

// A chain that folds up and strikes itself: each link is held by two joints and pushed by contacts.
TEST(Joints, contacts_between_the_links_of_a_chain_keep_its_momentum) {
  for (const double speed : {5.0, 10.0}) {
    World world({.gravity = {0, 0, 0}});
    BodyId last = {};
    for (int i = 0; i < 8; ++i) {
      const double out = i - 3.5;
      const BodyId link =
          world.add_body({.shapes = {Capsule{.radius = 0.08, .half_height = 0.12}},
                          .position = {0, 0.4 * i, 0},
                          .linear_velocity = speed * Vec3(0.1 * out * out, 0, 0.01 * i)});
      if (i > 0) world.add_joint(BallJoint{.a = last, .b = link, .anchor = {0, 0.4 * i - 0.2, 0}});
      last = link;
    }
    const Measures before = world.measure();
    std::size_t events = 0;
    for (int n = 0; n < 240; ++n) {
      world.step(kDt);
      events += world.contact_events().size();
    }
    EXPECT_GE(events, 5u);
    const Measures after = world.measure();
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(after.momentum[i], before.momentum[i], 1e-6 * before.momentum[0]);
    EXPECT_LT(after.kinetic_energy, before.kinetic_energy);
  }
}

TEST(Joints, a_thrown_chain_carries_its_center_of_mass_along_the_parabola) {
  World world;
  const std::vector<BodyId> chain = add_chain(world, 5, {0.4, 0, 0}, false);
  world.set_velocity(chain[4], {0, 10, 3}, {0, 0, 0});
  Vec3 start = Vec3::Zero();
  for (const BodyId b : chain) start += world.center_of_mass(b) / 5;
  run(world, 2);
  Vec3 end = Vec3::Zero();
  for (const BodyId b : chain) end += world.center_of_mass(b) / 5;
  const Vec3 expected = start + Vec3(0, 4, 1.2) + 0.5 * 4 * Vec3(0, -kG, 0);
  EXPECT_LT((end - expected).norm(), 1e-9);
}

}  // namespace
}  // namespace skerry::test
