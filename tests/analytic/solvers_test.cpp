// The solvers that are there to be measured against soft-step TGS: the same bits in every mode, and
// the physics they promise.
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "solver/penalty_solver.h"
#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

constexpr double kG = 9.81, kDt = 1.0 / 60;

WorldSettings settings_of(SolverKind kind) {
  WorldSettings settings;
  settings.solver.kind = kind;
  settings.sleep.enabled = false;
  settings.measure_steps = true;
  return settings;
}

class OtherSolver : public testing::TestWithParam<SolverKind> {};
INSTANTIATE_TEST_SUITE_P(Analytic, OtherSolver,
                         testing::Values(SolverKind::pgs, SolverKind::penalty),
                         [](const auto& given) { return std::string(to_string(given.param)); });

class OtherSolverInEveryMode
    : public testing::TestWithParam<std::tuple<SolverKind, ModeAndWorkers>> {};

TEST_P(OtherSolverInEveryMode, gives_the_serial_bits_at_every_step) {
  constexpr int kSteps = 90;
  const auto hashes = [](SolverKind kind, const ModeAndWorkers& mode) {
    WorldSettings settings;
    settings.solver.kind = kind;
    World world = make_world(mode, settings);
    BusyScene scene(world);
    std::vector<std::uint64_t> all;
    for (int n = 0; n < kSteps; ++n) {
      scene.advance(world, n);
      all.push_back(world.state_hash());
    }
    return all;
  };
  const auto& [kind, mode] = GetParam();
  static const std::vector<std::uint64_t> serial[] = {
      hashes(SolverKind::pgs, {ThreadingMode::serial, 1}),
      hashes(SolverKind::penalty, {ThreadingMode::serial, 1})};
  EXPECT_EQ(hashes(kind, mode), serial[kind == SolverKind::penalty ? 1 : 0]);
}
std::string name_of_row(const testing::TestParamInfo<std::tuple<SolverKind, ModeAndWorkers>>& row) {
  const auto& [kind, mode] = row.param;
  return std::string(to_string(kind)) + "_" + to_string(mode.mode) + "_" +
         std::to_string(mode.workers);
}
INSTANTIATE_TEST_SUITE_P(
    Analytic, OtherSolverInEveryMode,
    testing::Combine(testing::Values(SolverKind::pgs, SolverKind::penalty),
                     testing::Values(ModeAndWorkers{ThreadingMode::dedicated_thread, 1},
                                     ModeAndWorkers{ThreadingMode::dedicated_thread_jobs, 2},
                                     ModeAndWorkers{ThreadingMode::fork_join, 3},
                                     ModeAndWorkers{ThreadingMode::job_system, 2},
                                     ModeAndWorkers{ThreadingMode::job_system, 4})),
    name_of_row);

TEST_P(OtherSolver, a_box_rests_and_the_ground_gives_its_weight) {
  World world(settings_of(GetParam()));
  add_floor(world);
  const BodyId box = add_box(world, {0, 0.5, 0});
  for (int n = 0; n < 240; ++n) world.step(kDt);
  const Measures m = world.last_report().measures;
  EXPECT_NEAR(world.pose(box).position.y(), 0.5, 2e-3);
  EXPECT_LT(m.kinetic_energy, 1e-6);
  EXPECT_NEAR(m.contacts.impulse_from_ground[1], 1000 * kG * kDt, 1e-3 * 1000 * kG * kDt);
  EXPECT_EQ(m.contacts.law.pull_max, 0);
  EXPECT_LT(m.contacts.law.cone_max, 1e-5);
}

TEST_P(OtherSolver, a_sliding_box_stops_where_coulomb_says) {
  World world(settings_of(GetParam()));
  add_floor(world, 0.5);
  const BodyId box = add_box(world, {0, 0.5, 0}, {0.5, 0.5, 0.5}, 0.5);
  for (int n = 0; n < 60; ++n) world.step(kDt);
  const Vec3 start = world.pose(box).position;
  world.set_velocity(box, {5, 0, 0}, Vec3::Zero());
  for (int n = 0; n < 120; ++n) world.step(kDt);
  EXPECT_NEAR((world.pose(box).position - start).norm(), 2.5484, 0.03 * 2.5484);
  EXPECT_LT(world.linear_velocity(box).norm(), 1e-3);
}

TEST_P(OtherSolver, a_box_holds_on_an_incline_below_its_friction_angle) {
  World world(settings_of(GetParam()));
  const double angle = 20 * 3.14159265358979 / 180;
  add_incline(world, angle, 0.48);
  const BodyId box = world.add_body({.shapes = {Box{.half_extents = {0.5, 0.5, 0.5}}},
                                     .position = 0.5 * Vec3(-std::sin(angle), std::cos(angle), 0),
                                     .orientation = Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ())),
                                     .friction = 0.48});
  for (int n = 0; n < 60; ++n) world.step(kDt);
  const Vec3 start = world.pose(box).position;
  for (int n = 0; n < 300; ++n) world.step(kDt);
  EXPECT_LT((world.pose(box).position - start).norm(), 2e-3);
}

TEST_P(OtherSolver, a_ball_rolls_down_an_incline_at_five_sevenths_of_gravity) {
  World world(settings_of(GetParam()));
  const double angle = 15 * 3.14159265358979 / 180;
  add_incline(world, angle, 0.6);
  const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.5}},
                                      .position = 0.5 * Vec3(-std::sin(angle), std::cos(angle), 0),
                                      .friction = 0.6});
  for (int n = 0; n < 30; ++n) world.step(kDt);
  const double before = world.linear_velocity(ball).norm();
  for (int n = 0; n < 120; ++n) world.step(kDt);
  EXPECT_NEAR((world.linear_velocity(ball).norm() - before) / 2, 1.8136, 0.02 * 1.8136);
}

TEST_P(OtherSolver, a_ball_rebounds_with_its_restitution) {
  for (const double e : {0.0, 0.5, 0.8}) {
    World world(settings_of(GetParam()));
    add_floor(world, 0.6, e);
    const BodyId ball = add_sphere(world, {0, 2.5, 0}, 0.5, 0.6, e);
    double rebound = 0, lost = 0;
    for (int n = 0; n < 60; ++n) {
      lost += world.step(kDt).measures.contacts.energy_lost;
      rebound = std::max(rebound, world.linear_velocity(ball).y());
    }
    const double fall = std::sqrt(2 * kG * 2), mass = world.mass(ball);
    // Penalty forces do not stop an impact dead: solver/penalty_solver.h.
    EXPECT_NEAR(rebound, e * fall, (e > 0 ? 0.08 : 0.25) * fall) << "e = " << e;
    EXPECT_NEAR(lost, 0.5 * mass * fall * fall * (1 - e * e), 0.1 * mass * fall * fall);
  }
}

TEST_P(OtherSolver, a_cloud_in_empty_space_keeps_its_momenta) {
  WorldSettings settings = settings_of(GetParam());
  settings.gravity = Vec3::Zero();
  // Split impulses move bodies by what is in no momentum.
  settings.solver.pgs.correction = PositionCorrection::baumgarte;
  settings.continuous = false;
  World world(settings);
  for (int i = 0; i < 64; ++i) {
    const Vec3 at(i % 4 - 1.5, i / 4 % 4 - 1.5, i / 16 - 1.5);
    world.add_body({.shapes = {i % 2 ? Shape(Box{.half_extents = {0.3, 0.2, 0.25}})
                                     : Shape(Sphere{.radius = 0.3})},
                    .position = at,
                    .linear_velocity = -2 * at + Vec3(0.3, 0.1 * (i % 3), 0.2),
                    .angular_velocity = {0.5 * (i % 5), 1, 0.3 * (i % 7)},
                    .friction = 0.5,
                    .restitution = 0.5});
  }
  const Measures before = world.measure();
  for (int n = 0; n < 1440; ++n) world.step(1.0 / 480);
  const Measures after = world.measure();
  EXPECT_LT(after.kinetic_energy, 0.9 * before.kinetic_energy);
  const double size = std::sqrt(2 * before.kinetic_energy);  // of momenta, times sqrt(mass)
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(after.momentum[k], before.momentum[k], 1e-10 * size);
    EXPECT_NEAR(after.angular_momentum[k], before.angular_momentum[k], 1e-9 * size);
  }
}

TEST_P(OtherSolver, islands_with_joints_are_left_to_the_engines_own) {
  const auto run = [](SolverKind kind) {
    World world(settings_of(kind));
    add_floor(world);
    const BodyId a = add_box(world, {0, 0.5, 0}), b = add_box(world, {1.5, 1.5, 0});
    world.add_joint(BallJoint{.a = a, .b = b, .anchor = {0.8, 1, 0}});
    for (int n = 0; n < 60; ++n) world.step(kDt);
    return world.state_hash();
  };
  EXPECT_EQ(run(GetParam()), run(SolverKind::soft_step_tgs));
}

TEST(Pgs, split_impulses_push_out_without_speed_and_baumgarte_with) {
  const auto speed_after = [](PositionCorrection correction) {
    WorldSettings settings = settings_of(SolverKind::pgs);
    settings.solver.pgs.correction = correction;
    World world(settings);
    add_floor(world);
    const BodyId box = add_box(world, {0, 0.45, 0});
    world.step(kDt);
    EXPECT_GT(world.pose(box).position.y(), 0.455);
    return world.linear_velocity(box).y();
  };
  EXPECT_LT(std::abs(speed_after(PositionCorrection::split_impulse)), 1e-4);
  EXPECT_GT(speed_after(PositionCorrection::baumgarte), 0.3);
}

TEST(Pgs, more_iterations_bring_a_stack_closer_to_the_law) {
  const auto residual = [](int iterations) {
    WorldSettings settings = settings_of(SolverKind::pgs);
    settings.solver.pgs.iterations = iterations;
    World world(settings);
    add_floor(world);
    for (int i = 0; i < 10; ++i) add_box(world, {0, 0.5 + i, 0});
    world.step(kDt);
    return world.last_report().measures.contacts.law.normal_mean;
  };
  const double few = residual(5), many = residual(500);
  EXPECT_GT(few, 1e-2);
  EXPECT_LT(many, 0.01 * few);
}

TEST(Penalty, damping_follows_from_restitution) {
  for (const double e : {0.05, 0.3, 0.5, 0.9, 0.999}) {
    const double z = solver::damping_ratio(e);
    EXPECT_NEAR(std::exp(-3.14159265358979 * z / std::sqrt(1 - z * z)), e, 1e-13);
  }
  EXPECT_EQ(solver::damping_ratio(0), 1);
  EXPECT_EQ(solver::damping_ratio(1), 0);
}

TEST(Penalty, a_box_sinks_in_by_what_its_springs_say) {
  WorldSettings settings = settings_of(SolverKind::penalty);
  settings.solver.penalty.hertz = 30;
  World world(settings);
  add_floor(world);
  const BodyId box = add_box(world, {0, 0.5, 0});
  for (int n = 0; n < 240; ++n) world.step(kDt);
  const double omega = 2 * 3.14159265358979 * 30;
  EXPECT_NEAR(0.5 - world.pose(box).position.y(), kG / (omega * omega), 2e-6);
}

TEST(SolverSettings, are_refused_with_their_name) {
  WorldSettings settings;
  settings.solver.pgs.iterations = 0;
  EXPECT_THROW(World{settings}, InputError);
  settings.solver.pgs.iterations = 10;
  settings.solver.penalty.hertz = -1;
  EXPECT_THROW(World{settings}, InputError);
}

}  // namespace
}  // namespace skerry::test
