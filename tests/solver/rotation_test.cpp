// Rotation in free flight: conservation, the middle-axis flip, closed forms, torque, locks.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "solver/rotation.h"
#include "tests/solver/hand_made_world.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;

struct Weightless : HandMadeWorld {
  Weightless() { settings.gravity = Vec3::Zero(); }
};

struct Tumbler {
  const char* name;
  double mass;
  Vec3 moments;
  Vec3 angular;
  Vec3 tilt;  // rotation vector of the principal axes in the body frame: a full inertia tensor
};

std::ostream& operator<<(std::ostream& out, const Tumbler& t) { return out << t.name; }

const Tumbler kTumblers[] = {
    {"flat_box", 10, box_moments(10, {0.1, 0.4, 0.9}), {0.1, 5, 0.1}, {0, 0, 0}},
    {"flat_box_with_tilted_axes", 10, box_moments(10, {0.1, 0.4, 0.9}), {3, 5, -4}, {0.3, 0.7, 1}},
    {"rod", 2, box_moments(2, {0.02, 0.03, 1.5}), {4, 3, 20}, {0, 0, 0}},
    {"disc", 3, {0.02, 0.04, 0.02}, {1, 30, 7}, {0, 0, 0}},
    {"ball", 5, {0.2, 0.2, 0.2}, {3, -7, 12}, {0, 0, 0}},
    {"nearly_a_ball", 5, {0.2, 0.2000001, 0.1999999}, {3, -7, 12}, {0, 0, 0}},
    {"fast_splinter", 0.01, box_moments(0.01, {0.002, 0.01, 0.2}), {90, 80, 70}, {0, 0, 0}},
};

class TorqueFree : public testing::TestWithParam<Tumbler> {};
INSTANTIATE_TEST_SUITE_P(Bodies, TorqueFree, testing::ValuesIn(kTumblers),
                         [](const auto& tumbler) { return std::string(tumbler.param.name); });

TEST_P(TorqueFree, tumbling_for_120_s_keeps_momentum_to_the_bit_and_energy) {
  Weightless world;
  const Tumbler& t = GetParam();
  const Mat3 axes = t.tilt.isZero()
                        ? Mat3::Identity()
                        : Eigen::AngleAxisd(t.tilt.norm(), t.tilt.normalized()).toRotationMatrix();
  const Mat3 inertia = axes * t.moments.asDiagonal() * axes.transpose();
  const BodyIndex body = world.add({.mass = t.mass, .angular = t.angular}, inertia);
  const Vec3 momentum = world.bodies.motion[body].angular_momentum;
  const double energy = world.kinetic_energy(body);
  double worst = 0;
  for (int i = 0; i < 7200; ++i) {
    world.fly(body);
    worst = std::max(worst, std::fabs(world.kinetic_energy(body) - energy) / energy);
  }
  const core::BodyMotion& motion = world.bodies.motion[body];
  EXPECT_EQ(momentum, motion.angular_momentum);
  // The momentum that the orientation and the angular velocity imply.
  const Vec3 implied =
      core::inertia_w(world.bodies.mass[body], world.bodies.pose[body].orientation) *
      motion.angular;
  EXPECT_LT((implied - momentum).norm(), 1e-12 * momentum.norm());
  EXPECT_LT(worst, 1e-11);
  RecordProperty("energy_drift", std::to_string(worst));
  std::printf("  %s: energy drift %.1e\n", t.name, worst);
}

// Times at which the component of w along the body's y axis changes sign, by linear interpolation
// on a step's grid refined by the cubic term being small.
std::vector<double> middle_axis_flips(double dt, double duration) {
  Weightless world;
  world.dt = dt;
  const BodyIndex body = world.add(
      {.mass = 10, .moments = box_moments(10, {0.1, 0.4, 0.9}), .angular = {0.1, 5, 0.1}});
  std::vector<double> flips;
  const auto spin = [&] {
    return (world.bodies.pose[body].orientation.conjugate() * world.bodies.motion[body].angular)
        .y();
  };
  double before = spin();
  while (world.time < duration) {
    world.fly(body);
    const double now = spin();
    if ((before > 0) != (now > 0)) flips.push_back(world.time - dt * now / (now - before));
    before = now;
  }
  return flips;
}

TEST(MiddleAxisFlip, happens_at_the_times_of_the_elliptic_solution) {
  for (const double dt : {1e-3, 1.0 / 240, 1.0 / 60}) {
    const std::vector<double> flips = middle_axis_flips(dt, 8);
    ASSERT_EQ(flips.size(), 3u) << "dt " << dt;
    EXPECT_NEAR(flips[0], 1.1660, 1e-4) << "dt " << dt;
    EXPECT_NEAR(flips[1], 4.1944, 1e-4) << "dt " << dt;
    EXPECT_NEAR(flips[2], 7.2228, 1e-4) << "dt " << dt;
  }
}

// Classical RK4 on (q, L) with tiny steps.
Quat brute_force(double duration, int steps, const Mat3& inverse, Quat q, const Vec3& momentum,
                 const Vec3& torque) {
  const double h = duration / steps;
  const auto slope = [&](const Quat& at, double t) {
    const Mat3 r = at.toRotationMatrix();
    const Vec3 w = r * (inverse * (r.transpose() * (momentum + torque * t)));
    const Quat product = Quat(0, w.x(), w.y(), w.z()) * at;
    return Eigen::Vector4d(product.coeffs() * 0.5);
  };
  const auto moved = [&](const Eigen::Vector4d& by) {
    Quat r;
    r.coeffs() = q.coeffs() + by;
    return r;
  };
  for (int i = 0; i < steps; ++i) {
    const double t = i * h;
    const Eigen::Vector4d k1 = slope(q, t), k2 = slope(moved(k1 * (h / 2)), t + h / 2),
                          k3 = slope(moved(k2 * (h / 2)), t + h / 2),
                          k4 = slope(moved(k3 * h), t + h);
    q.coeffs() += (k1 + 2 * k2 + 2 * k3 + k4) * (h / 6);
    q.normalize();
  }
  return q;
}

double angle_between(const Quat& a, const Quat& b) { return 2 * (a.conjugate() * b).vec().norm(); }

core::BodyMass mass_of(const Mat3& inertia) {
  core::BodyMass mass;
  mass.mass = 1;
  mass.inv_mass = 1;
  mass.inertia_b = inertia;
  mass.inv_inertia_b = inertia.inverse();
  return mass;
}

TEST(ConstantTorque, orientation_matches_brute_force) {
  Mat3 inertia;
  inertia << 0.8, 0.05, -0.02, 0.05, 0.6, 0.03, -0.02, 0.03, 0.3;
  const core::BodyMass mass = mass_of(inertia);
  const Quat start = Quat(0.8, 0.1, -0.5, 0.3).normalized();
  const Vec3 momentum = {1, -2, 0.5};
  for (const Vec3& torque : {Vec3(0, 0, 0), Vec3(3, 1, -2), Vec3(0, 40, 0)}) {
    const Quat ours = orientation_after(1.0, mass, 0, start, momentum, torque);
    const Quat truth = brute_force(1.0, 200000, mass.inv_inertia_b, start, momentum, torque);
    EXPECT_LT(angle_between(ours, truth), 1e-11) << torque.transpose();
  }
}

TEST(ConstantTorque, isotropic_body_follows_to_fourth_order) {
  const core::BodyMass mass = mass_of(Mat3::Identity() * 0.4);
  const Vec3 momentum = {1, -2, 0.5}, torque = {3, 1, -2};
  const Quat truth =
      brute_force(0.2, 100000, mass.inv_inertia_b, Quat::Identity(), momentum, torque);
  double errors[2];
  for (const int steps : {4, 8}) {
    Quat q = Quat::Identity();
    for (int i = 0; i < steps; ++i)
      q = orientation_after(0.2 / steps, mass, core::kIsotropic, q,
                            momentum + torque * (0.2 * i / steps), torque);
    errors[steps / 8] = angle_between(q, truth);
  }
  EXPECT_LT(errors[1], 1e-6);
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 4, 0.2);
}

TEST(SymmetricTop, closed_form_agrees_with_the_series) {
  const core::BodyMass round = mass_of(Vec3(0.3, 0.7, 0.3).asDiagonal());
  core::BodyMass nearly = round;
  nearly.inv_inertia_b(0, 0) *= 1 + 1e-15;  // no longer equal: takes the series
  nearly.inv_inertia_b(0, 0) = std::nextafter(nearly.inv_inertia_b(0, 0), 100.0);
  const Quat start = Quat(0.8, 0.1, -0.5, 0.3).normalized();
  const Vec3 momentum = {4, 1, -7};
  const Quat a = orientation_after(0.5, round, 0, start, momentum, Vec3::Zero());
  const Quat b = orientation_after(0.5, nearly, 0, start, momentum, Vec3::Zero());
  EXPECT_LT(angle_between(a, b), 1e-13);
}

TEST(Rotation, does_not_depend_on_how_time_is_cut) {
  const core::BodyMass mass = mass_of(box_moments(10, {0.1, 0.4, 0.9}).asDiagonal());
  const Vec3 momentum = {1, 3, -2};
  const Quat whole = orientation_after(3, mass, 0, Quat::Identity(), momentum, Vec3::Zero());
  Quat cut = Quat::Identity();
  for (int i = 0; i < 3000; ++i)
    cut = orientation_after(1e-3, mass, 0, cut, momentum, Vec3::Zero());
  EXPECT_LT(angle_between(whole, cut), 1e-11);
}

TEST(Rotation, absurd_spin_ends_and_stays_unit) {
  const core::BodyMass mass = mass_of(box_moments(1, {0.1, 0.4, 0.9}).asDiagonal());
  for (const double spin : {1e4, 1e8, 1e100}) {
    const Quat q =
        orientation_after(0.1, mass, 0, Quat::Identity(), Vec3(1, 1, 1) * spin, Vec3::Zero());
    EXPECT_NEAR(q.norm(), 1, 1e-12) << spin;
  }
}

TEST(Locks, a_body_locked_to_the_plane_turns_about_one_axis_only) {
  Weightless world;
  const BodyIndex body = world.add(
      {.moments = {0.2, 0.3, 0.4},
       .angular = {5, 6, 2},
       .flags = core::kDynamic | core::kAwake | core::kLockZ | core::kLockRx | core::kLockRy});
  world.bodies.motion[body].linear = {1, 2, 3};
  world.settings.gravity = {0, -9.81, -5};
  world.fly(body, 60);
  EXPECT_EQ(world.bodies.pose[body].center.z(), 0);
  EXPECT_NEAR(world.bodies.pose[body].center.x(), 1, 1e-14);
  EXPECT_NEAR(world.bodies.pose[body].center.y(), 2 - 9.81 / 2, 1e-12);
  EXPECT_EQ(world.bodies.motion[body].angular.x(), 0);
  EXPECT_NEAR(world.bodies.motion[body].angular.z(), 2, 1e-14);
  EXPECT_LT(
      angle_between(world.bodies.pose[body].orientation, Quat(Eigen::AngleAxisd(2, Vec3::UnitZ()))),
      1e-13);
}

TEST(Locks, a_body_locked_all_over_stays_where_it_is) {
  HandMadeWorld world;
  const BodyIndex body = world.add({.center = {1, 2, 3},
                                    .linear = {1, 1, 1},
                                    .angular = {1, 1, 1},
                                    .flags = core::kDynamic | core::kAwake | core::kLockMask});
  world.fields.rows.push_back([](const FieldSample&) { return FieldForce{{1, 2, 3}, {4, 5, 6}}; });
  for (const Integrator integrator : {Integrator::explicit_euler, Integrator::rk4}) {
    world.settings.integrator = integrator;
    world.fly(body, 10);
    EXPECT_EQ(world.bodies.pose[body].center, Vec3(1, 2, 3));
    EXPECT_EQ(world.bodies.pose[body].orientation.coeffs(), Quat::Identity().coeffs());
    EXPECT_TRUE(world.bodies.motion[body].angular_momentum.isZero(0));
  }
}

}  // namespace
}  // namespace skerry::solver
