// Translation in free flight: each integrator is what its name says, its order is measured, and
// what must be exact is.
#include "solver/free_flight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "solver/forces.h"
#include "tests/solver/hand_made_world.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;

constexpr double g = 9.81;

// -- The lecture's car: 10 m/s^2 from rest for 10 s, in steps of 1 s -------------------------------

double car_after_10_s(Integrator integrator) {
  HandMadeWorld world;
  world.settings.gravity = {10, 0, 0};
  world.settings.integrator = integrator;
  world.dt = 1;
  const BodyIndex car = world.add({.mass = 1200});
  world.fly(car, 10);
  EXPECT_NEAR(world.bodies.motion[car].linear.x(), 100, 1e-12);
  return world.bodies.pose[car].center.x();
}

TEST(Car, explicit_euler_lags_semi_implicit_leads_the_others_are_exact) {
  EXPECT_NEAR(car_after_10_s(Integrator::explicit_euler), 450, 1e-10);
  EXPECT_NEAR(car_after_10_s(Integrator::semi_implicit_euler), 550, 1e-10);
  EXPECT_NEAR(car_after_10_s(Integrator::velocity_verlet), 500, 1e-10);
  EXPECT_NEAR(car_after_10_s(Integrator::rk4), 500, 1e-10);
  EXPECT_NEAR(car_after_10_s(Integrator::exact), 500, 1e-10);
}

// -- Free fall ------------------------------------------------------------------------------------

TEST(FreeFall, semi_implicit_euler_obeys_its_own_closed_form) {
  HandMadeWorld world;
  world.settings.gravity = {0, 0, -g};
  world.settings.integrator = Integrator::semi_implicit_euler;
  world.dt = 1.0 / 240;
  const Vec3 p0 = {1, 2, 3}, v0 = {3, 10, -2};
  const BodyIndex ball = world.add({.mass = 0.3, .center = p0, .linear = v0});
  for (int n = 1; n <= 480; ++n) {
    world.fly(ball);
    const double z = p0.z() + n * world.dt * v0.z() - g * world.dt * world.dt * n * (n + 1) / 2;
    ASSERT_NEAR(world.bodies.pose[ball].center.z(), z, 1e-12 * n);
    ASSERT_NEAR(world.bodies.pose[ball].center.x(), p0.x() + n * world.dt * v0.x(), 1e-12 * n);
  }
}

TEST(FreeFall, exact_flight_is_the_parabola_at_any_step_and_keeps_energy) {
  for (const double dt : {1.0 / 240, 1.0 / 60, 0.5}) {
    HandMadeWorld world;
    world.dt = dt;
    const Vec3 p0 = {0, 5, 0}, v0 = {3, 10, -2};
    const BodyIndex ball = world.add({.mass = 7, .center = p0, .linear = v0});
    const double energy = world.kinetic_energy(ball) + 7 * g * p0.y();
    const int steps = static_cast<int>(std::lround(2 / dt));
    for (int n = 1; n <= steps; ++n) {
      world.fly(ball);
      const double t = n * dt;
      const Vec3 truth = p0 + v0 * t + world.settings.gravity * (t * t / 2);
      ASSERT_LT((world.bodies.pose[ball].center - truth).norm(), 1e-10);
      const double now = world.kinetic_energy(ball) + 7 * g * world.bodies.pose[ball].center.y();
      ASSERT_NEAR(now, energy, 1e-10 * energy);
      ASSERT_NEAR(world.bodies.motion[ball].linear.x(), 3, 0);
    }
  }
}

TEST(FreeFall, gravity_scale_and_user_forces_act) {
  HandMadeWorld world;
  const BodyIndex ball = world.add({.mass = 2, .gravity_scale = -0.5});
  core::add_force(world.bodies, ball, {4, 0, 0}, {0, 0, 3});
  world.dt = 1;
  world.fly(ball);
  EXPECT_NEAR(world.bodies.pose[ball].center.x(), 1, 1e-15);
  EXPECT_NEAR(world.bodies.pose[ball].center.y(), g / 4, 1e-15);
  EXPECT_NEAR(world.bodies.motion[ball].angular_momentum.z(), 3, 1e-15);
  EXPECT_NEAR(world.bodies.motion[ball].angular.z(), 3, 1e-15);
}

// -- Order of convergence -------------------------------------------------------------------------

constexpr double kStiffness = 30, kMass = 2;

// Error after 1 s of a spring that starts at x = 1 at rest.
double spring_error(Integrator integrator, int steps) {
  HandMadeWorld world;
  world.settings.gravity = Vec3::Zero();
  world.settings.integrator = integrator;
  world.dt = 1.0 / steps;
  world.fields.rows.push_back(
      [](const FieldSample& s) { return FieldForce{-kStiffness * s.position}; });
  const BodyIndex ball = world.add({.mass = kMass, .center = {1, 0, 0}});
  world.fly(ball, steps);
  const double w = std::sqrt(kStiffness / kMass);
  const double dx = world.bodies.pose[ball].center.x() - std::cos(w);
  const double dv = world.bodies.motion[ball].linear.x() + w * std::sin(w);
  return std::hypot(dx, dv / w);
}

// Error after 1 s of a fall with quadratic air drag, F = m g - k |v| v, terminal speed 10 m/s.
double drag_error(Integrator integrator, int steps) {
  HandMadeWorld world;
  world.settings.integrator = integrator;
  world.dt = 1.0 / steps;
  constexpr double terminal = 10, k = kMass * g / (terminal * terminal);
  world.fields.rows.push_back(
      [](const FieldSample& s) { return FieldForce{-k * s.velocity.norm() * s.velocity}; });
  const BodyIndex ball = world.add({.mass = kMass});
  world.fly(ball, steps);
  const double v = -terminal * std::tanh(g / terminal);
  const double y = -terminal * terminal / g * std::log(std::cosh(g / terminal));
  return std::hypot(world.bodies.pose[ball].center.y() - y,
                    world.bodies.motion[ball].linear.y() - v);
}

// Error after 1 s in a force that depends on time alone, F = m cos 5t.
double clock_error(Integrator integrator, int steps) {
  HandMadeWorld world;
  world.settings.gravity = Vec3::Zero();
  world.settings.integrator = integrator;
  world.dt = 1.0 / steps;
  world.fields.rows.push_back(
      [](const FieldSample& s) { return FieldForce{Vec3(kMass * std::cos(5 * s.time), 0, 0)}; });
  const BodyIndex ball = world.add({.mass = kMass});
  world.fly(ball, steps);
  return std::fabs(world.bodies.pose[ball].center.x() - (1 - std::cos(5.0)) / 25);
}

struct Order {
  Integrator integrator;
  double order;
  const char* name;
};
std::ostream& operator<<(std::ostream& out, const Order& o) { return out << o.name; }
class Convergence : public testing::TestWithParam<Order> {};
INSTANTIATE_TEST_SUITE_P(
    Integrators, Convergence,
    testing::Values(Order{Integrator::explicit_euler, 1, "explicit_euler"},
                    Order{Integrator::semi_implicit_euler, 1, "semi_implicit_euler"},
                    Order{Integrator::velocity_verlet, 2, "velocity_verlet"},
                    Order{Integrator::rk4, 4, "rk4"}, Order{Integrator::exact, 4, "exact"}),
    [](const auto& order) { return std::string(order.param.name); });

TEST_P(Convergence, halving_the_step_divides_the_error_by_two_to_the_order) {
  using Problem = double (*)(Integrator, int);
  for (const Problem error : {&spring_error, &drag_error, &clock_error}) {
    const double coarse = error(GetParam().integrator, 80);
    const double fine = error(GetParam().integrator, 160);
    EXPECT_NEAR(std::log2(coarse / fine), GetParam().order, 0.12) << coarse << " " << fine;
  }
}

TEST(Spring, energy_grows_with_explicit_euler_and_oscillates_with_semi_implicit) {
  const auto energy_after = [](Integrator integrator) {
    HandMadeWorld world;
    world.settings.gravity = Vec3::Zero();
    world.settings.integrator = integrator;
    world.dt = 0.01;
    world.fields.rows.push_back(
        [](const FieldSample& s) { return FieldForce{-kStiffness * s.position}; });
    const BodyIndex ball = world.add({.mass = kMass, .center = {1, 0, 0}});
    world.fly(ball, 2000);
    return world.kinetic_energy(ball) +
           0.5 * kStiffness * world.bodies.pose[ball].center.squaredNorm();
  };
  const double start = 0.5 * kStiffness;
  EXPECT_GT(energy_after(Integrator::explicit_euler), 2 * start);
  EXPECT_NEAR(energy_after(Integrator::semi_implicit_euler), start, 0.03 * start);
  EXPECT_NEAR(energy_after(Integrator::velocity_verlet), start, 1e-3 * start);
  EXPECT_NEAR(energy_after(Integrator::rk4), start, 1e-4 * start);
}

// Torque -c w on a ball: w decays as e^(-c t / I).
TEST(AngularDrag, converges_with_the_integrator) {
  const auto error = [](Integrator integrator, int steps) {
    HandMadeWorld world;
    world.settings.integrator = integrator;
    world.dt = 1.0 / steps;
    world.fields.rows.push_back([](const FieldSample& s) {
      return FieldForce{Vec3::Zero(), -0.8 * s.angular_velocity};
    });
    const BodyIndex ball = world.add({.moments = {0.4, 0.4, 0.4}, .angular = {1, 2, 3}});
    world.fly(ball, steps);
    return (world.bodies.motion[ball].angular - Vec3(1, 2, 3) * std::exp(-2.0)).norm();
  };
  const auto order = [&](Integrator i) { return std::log2(error(i, 20) / error(i, 40)); };
  EXPECT_NEAR(order(Integrator::semi_implicit_euler), 1, 0.15);
  EXPECT_NEAR(order(Integrator::velocity_verlet), 2, 0.15);
  EXPECT_NEAR(order(Integrator::rk4), 4, 0.15);
}

// -- Damping --------------------------------------------------------------------------------------

TEST(Damping, exact_flight_follows_the_exponential_at_any_strength) {
  for (const double c : {1e-9, 0.1, 3.0, 80.0, 1e5}) {
    HandMadeWorld world;
    world.dt = 0.25;
    const BodyIndex ball = world.add({.moments = {0.3, 0.3, 0.3},
                                      .linear = {8, 0, 0},
                                      .angular = {0, 0, 5},
                                      .linear_damping = c,
                                      .angular_damping = c});
    world.fly(ball, 4);
    const double e = std::exp(-c), path = -std::expm1(-c) / c;
    EXPECT_NEAR(world.bodies.motion[ball].linear.x(), 8 * e, 1e-12) << c;
    EXPECT_NEAR(world.bodies.pose[ball].center.x(), 8 * path, 1e-12) << c;
    const double fall = c < 1e-6 ? 0.5 : (1 - path) / c;
    EXPECT_NEAR(world.bodies.pose[ball].center.y(), -g * fall, 1e-8) << c;
    EXPECT_NEAR(world.bodies.motion[ball].angular.z(), 5 * e, 1e-12) << c;
    const Quat q = world.bodies.pose[ball].orientation;
    EXPECT_NEAR(2 * std::atan2(q.z(), q.w()), 5 * path, 1e-12) << c;
  }
}

TEST(Damping, every_integrator_survives_strong_damping) {
  for (const Integrator integrator :
       {Integrator::explicit_euler, Integrator::semi_implicit_euler, Integrator::velocity_verlet,
        Integrator::rk4, Integrator::exact}) {
    HandMadeWorld world;
    world.settings.integrator = integrator;
    world.dt = 1.0 / 60;
    const BodyIndex ball = world.add({.linear = {8, 0, 0}, .linear_damping = 1e4});
    world.fly(ball, 60);
    EXPECT_LT(world.bodies.motion[ball].linear.norm(), 0.2);
  }
}

// -- Kinematic bodies -----------------------------------------------------------------------------

TEST(Kinematic, follows_its_velocities_exactly_and_feels_nothing) {
  HandMadeWorld world;
  world.fields.rows.push_back([](const FieldSample&) -> FieldForce { throw 1; });
  const Vec3 linear = {1, -2, 0.5}, angular = {0.3, -0.4, 1.2};
  const BodyIndex lift = world.add_kinematic({10, 0, 0}, linear, angular);
  core::add_force(world.bodies, lift, {100, 100, 100}, Vec3::Zero());
  world.fly(lift, 600);
  EXPECT_LT((world.bodies.pose[lift].center - (Vec3(10, 0, 0) + linear * 10)).norm(), 1e-12);
  const Quat truth(Eigen::AngleAxisd(10 * angular.norm(), angular.normalized()));
  EXPECT_LT(2 * (world.bodies.pose[lift].orientation.conjugate() * truth).vec().norm(), 1e-12);
  EXPECT_EQ(world.bodies.motion[lift].linear, linear);
  EXPECT_EQ(world.bodies.motion[lift].angular, angular);
}

// -- Trouble --------------------------------------------------------------------------------------

TEST(Quarantine, a_body_pushed_out_of_the_finite_keeps_its_pose_and_stops) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const Vec3& push : {Vec3(inf, 0, 0), Vec3(0, std::nan(""), 0), Vec3(0, 1e308, 0)}) {
    HandMadeWorld world;
    world.fields.rows.push_back([push](const FieldSample& s) {
      return s.position.y() < 3 ? FieldForce{push, push} : FieldForce{};
    });
    const BodyIndex bad = world.add({.mass = 1e-9, .center = {1, 2, 3}, .linear = {1, 1, 1}});
    const BodyIndex good = world.add({.center = {1, 9, 3}});
    world.dt = 1;
    world.fly(bad, 3);
    world.fly(good, 1);
    EXPECT_TRUE(world.bodies.is(bad, core::kQuarantined));
    EXPECT_EQ(world.bodies.pose[bad].center, Vec3(1, 2, 3));
    EXPECT_TRUE(world.bodies.motion[bad].linear.isZero(0));
    EXPECT_FALSE(world.bodies.is(good, core::kQuarantined));
    EXPECT_TRUE(world.bodies.motion[good].linear.allFinite());
  }
}

TEST(Quarantine, catches_a_spin_beyond_numbers) {
  HandMadeWorld world;
  const BodyIndex body = world.add({.moments = {1, 2, 3}});
  world.bodies.motion[body].angular_momentum = {1e300, 1e300, 1};
  world.fly(body);
  EXPECT_TRUE(world.bodies.is(body, core::kQuarantined));
  EXPECT_EQ(world.bodies.pose[body].orientation.coeffs(), Quat::Identity().coeffs());
}

TEST(ForceFieldErrors, the_lowest_body_wins_and_fields_count_for_nothing) {
  HandMadeWorld world;
  world.dt = 1;
  world.fields.rows.push_back([](const FieldSample&) { return FieldForce{{50, 0, 0}}; });
  world.fields.rows.push_back({});  // a hole
  world.fields.rows.push_back([](const FieldSample& s) -> FieldForce {
    if (s.body.index == 0) return {};
    throw std::runtime_error("body " + std::to_string(s.body.index));
  });
  const BodyIndex fine = world.add({}), first = world.add({}), second = world.add({});
  for (const BodyIndex body : {second, first, fine}) world.fly(body);
  EXPECT_NEAR(world.bodies.pose[fine].center.x(), 25, 1e-12);
  EXPECT_EQ(world.bodies.pose[first].center.x(), 0);
  EXPECT_NEAR(world.bodies.pose[second].center.y(), -g / 2, 1e-12);
  try {
    world.errors.rethrow();
    FAIL() << "nothing was kept";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "body 1");
  }
}

TEST(ExternalForce, locked_axes_are_cleared) {
  HandMadeWorld world;
  const BodyIndex body =
      world.add({.flags = core::kDynamic | core::kAwake | core::kLockY | core::kLockRz});
  core::add_force(world.bodies, body, {1, 2, 3}, {4, 5, 6});
  const ExternalForce force =
      external_force(world.context(), body, 0, Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
  EXPECT_EQ(force.force, Vec3(1, 0, 3));
  EXPECT_EQ(force.torque, Vec3(4, 5, 0));
}

}  // namespace
}  // namespace skerry::solver
