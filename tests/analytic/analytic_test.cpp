// Physical truths with closed forms, at default settings: the ones that speed figures use too.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

constexpr double kG = 9.81;
constexpr double kPi = std::numbers::pi;

// The two time steps at which every truth must hold.
class BothSteps : public testing::TestWithParam<double> {
 protected:
  double dt() const { return GetParam(); }
  int steps(double seconds) const { return static_cast<int>(std::lround(seconds / dt())); }
  void run(World& world, double seconds) {
    for (int n = steps(seconds); n > 0; --n) world.step(dt());
  }
};
INSTANTIATE_TEST_SUITE_P(Analytic, BothSteps, testing::Values(1.0 / 60, 1.0 / 240),
                         [](const auto& given) { return given.param < 0.01 ? "dt_240" : "dt_60"; });

// A1. x0 + v0 t + g t^2 / 2, exactly: free flight integrates the parabola, not a chord of it.
TEST_P(EveryMode, a_thrown_body_follows_the_parabola) {
  World world = make_world(GetParam());
  const Vec3 x0(1, 20, -3), v0(3, 10, -2);
  const BodyId ball =
      world.add_body({.shapes = {Sphere{.radius = 0.5}}, .position = x0, .linear_velocity = v0});
  for (int n = 1; n <= 120; ++n) {
    step(world, 1.0 / 60);
    const double t = n / 60.0;
    const Vec3 expected = x0 + t * v0 + 0.5 * t * t * Vec3(0, -kG, 0);
    EXPECT_LT((world.pose(ball).position - expected).norm(), 1e-10);
  }
}
INSTANTIATE_TEST_SUITE_P(Analytic, EveryMode, testing::ValuesIn(every_mode()), name_of);

// A5. The apex after the k-th bounce is e^(2k) of the drop.
std::array<double, 3> apexes_of_three_bounces(double restitution, double dt) {
  World world;
  add_floor(world, 0.6, restitution);
  const BodyId ball = add_sphere(world, {0, 2.5, 0}, 0.5, 0.6, restitution);
  std::array<double, 3> apex = {0, 0, 0};
  int bounce = 0;
  double before = 0;
  for (double t = 0; t < 8 && bounce <= 3; t += dt) {
    world.step(dt);
    const double v = world.linear_velocity(ball).y();
    if (before < -1e-3 && v >= 0) ++bounce;  // also a landing without rebound
    if (bounce >= 1 && bounce <= 3) {
      double& best = apex[static_cast<std::size_t>(bounce - 1)];
      const double height = world.pose(ball).position.y() - 0.5 + v * v / (2 * kG) * (v > 0);
      best = std::max(best, height);
    }
    before = v;
  }
  return apex;
}

TEST_P(BothSteps, a_ball_bounces_to_the_square_of_its_restitution) {
  for (const double e : {0.0, 0.3, 0.5, 0.8, 0.95, 1.0}) {
    const std::array<double, 3> apex = apexes_of_three_bounces(e, dt());
    for (int k = 1; k <= 3; ++k) {
      const double expected = 2 * std::pow(e, 2 * k);
      EXPECT_NEAR(apex[static_cast<std::size_t>(k - 1)], expected, 0.005 * 2)
          << "e = " << e << ", bounce " << k;
    }
  }
}

// What lands on several points at once rebounds as straight as a ball, however it lies in the world.
struct FlatLanding {
  Shape shape;
  double height;  // m, of the centre above the ground at touch
  Quat turn = Quat::Identity();
};
std::vector<FlatLanding> flat_landings() {
  const Quat lying(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));
  return {{Box{.half_extents = {0.4, 0.3, 0.5}}, 0.3},
          {Cylinder{.radius = 0.4, .half_height = 0.3}, 0.3},
          {Cylinder{.radius = 0.3, .half_height = 0.6}, 0.3, lying},
          {Capsule{.radius = 0.3, .half_height = 0.6}, 0.3, lying}};
}
TEST_P(BothSteps, what_lands_flat_bounces_without_turning) {
  const Quat up(Eigen::AngleAxisd(0.7, Vec3(1, 2, -2).normalized()));
  const double e = 0.8;
  for (const FlatLanding& landing : flat_landings()) {
    World world({.gravity = up * Vec3(0, -kG, 0)});
    world.add_body(
        {.type = BodyType::fixed, .shapes = {Plane{}}, .orientation = up, .friction = 0.6});
    const BodyId body = world.add_body({.shapes = {landing.shape},
                                        .position = up * Vec3(0, 2 + landing.height, 0),
                                        .orientation = up * landing.turn,
                                        .friction = 0.6,
                                        .restitution = e});
    std::array<double, 3> apex = {0, 0, 0};
    int bounce = 0;
    double before = 0;
    for (double t = 0; t < 8 && bounce <= 3; t += dt()) {
      world.step(dt());
      const double v = (up.conjugate() * world.linear_velocity(body)).y();
      if (before < -1e-3 && v >= 0) ++bounce;
      before = v;
      if (bounce < 1 || bounce > 3) continue;
      const double y = (up.conjugate() * world.pose(body).position).y() - landing.height;
      double& best = apex[static_cast<std::size_t>(bounce - 1)];
      best = std::max(best, y + v * v / (2 * kG) * (v > 0));
      EXPECT_LT(world.angular_velocity(body).norm(), 0.01) << landing.shape.geometry.index();
    }
    for (int k = 1; k <= 3; ++k) {
      EXPECT_NEAR(apex[static_cast<std::size_t>(k - 1)], 2 * std::pow(e, 2 * k), 0.005 * 2)
          << landing.shape.geometry.index() << ", bounce " << k;
    }
  }
}

// Whatever edge or corner comes down next, and far from the origin of the ground.
TEST_P(BothSteps, what_tumbles_over_an_elastic_floor_keeps_its_energy) {
  const Shape shapes[] = {
      Box{.half_extents = {0.3, 0.4, 0.5}},
      Cylinder{.radius = 0.3, .half_height = 0.5},
      Cylinder{.radius = 0.5, .half_height = 0.1},
      Cone{.radius = 0.3, .half_height = 0.5},
      Capsule{.radius = 0.3, .half_height = 0.5},
      Ellipsoid{.semi_axes = {0.3, 0.4, 0.5}},
      ConvexHull{.points = {{0.5, -0.3, -0.3}, {-0.5, -0.3, -0.3}, {0, -0.3, 0.6}, {0, 0.6, 0}}}};
  for (const Shape& shape : shapes) {
    for (int i = 0; i < 3; ++i) {
      World world;
      add_floor(world, 0, 1);
      const Vec3 axis = Vec3(std::sin(2.0 * i + 1), std::sin(3.0 * i), std::sin(5.0 * i + 2));
      world.add_body({.shapes = {shape},
                      .position = {0, 2, 0},
                      .orientation = Quat(Eigen::AngleAxisd(1.0 + i, axis.normalized())),
                      .linear_velocity = {0.8, 0, -0.5},
                      .angular_velocity = axis,
                      .friction = 0,
                      .restitution = 1});
      const auto energy = [&world] {
        const Measures m = world.measure();
        return m.kinetic_energy + m.potential_energy;
      };
      const double before = energy();
      run(world, 20);
      const double part = dt() < 0.01 ? 5e-5 : 5e-3;
      EXPECT_NEAR(energy(), before, part * before) << shape.geometry.index() << ", " << i;
    }
  }
}

// No speed is too low for a bounce without a loss; with one the settings say where bounces end.
TEST_P(BothSteps, slow_elastic_bounces_go_on) {
  for (const double height : {1e-3, 1e-2}) {
    World world;
    add_floor(world, 0, 1);
    const BodyId ball = add_sphere(world, {0, 0.5 + height, 0}, 0.5, 0, 1);
    run(world, 5);
    const double v = world.linear_velocity(ball).y();
    EXPECT_NEAR(0.5 * v * v + kG * (world.pose(ball).position.y() - 0.5), kG * height,
                0.01 * kG * height)
        << height;
  }
  for (const double e : {0.5, 1.0}) {
    World world({.gravity = {0, 0, 0}});
    const auto ball = [&](double side) {
      return world.add_body({.shapes = {Sphere{.radius = 0.1}},
                             .position = {0.11 * side, 0, 0},
                             .linear_velocity = {-0.02 * side, 0, 0},
                             .restitution = e});
    };
    ball(-1);
    const BodyId right = ball(1);
    run(world, 1);
    EXPECT_NEAR(world.linear_velocity(right).x(), e < 1 ? 0 : 0.02, 1e-6) << e;
  }
}

// Whatever of it hangs together at times.
TEST_P(BothSteps, an_elastic_column_that_falls_gains_no_energy) {
  for (const bool box : {false, true}) {
    for (const double gap : {1e-3, 1e-2, 5e-2}) {
      World world;
      add_floor(world, 0.6, 1);
      for (int i = 0; i < 6; ++i) {
        world.add_body({.shapes = {box ? Shape(Box{}) : Shape(Sphere{})},
                        .position = {0, 0.5 + gap + (1 + gap) * i, 0},
                        .restitution = 1});
      }
      const auto energy = [&world] {
        const Measures m = world.measure();
        return m.kinetic_energy + m.potential_energy;
      };
      const double before = energy();
      for (int n = steps(10); n > 0; --n) {
        world.step(dt());
        ASSERT_LT(energy(), 1.002 * before) << (box ? "boxes, " : "balls, ") << gap;
      }
    }
  }
}

TEST_P(BothSteps, an_elastic_stack_that_rests_goes_on_resting) {
  World world;
  add_floor(world, 0.6, 1);
  BodyId top;
  for (int i = 0; i < 6; ++i) {
    top = world.add_body({.shapes = {Box{.half_extents = {0.5, 0.5, 0.5}}},
                          .position = {0, 0.5 + i, 0},
                          .restitution = 1,
                          .allow_sleep = false});
  }
  run(world, 5);
  EXPECT_LT((world.pose(top).position - Vec3(0, 5.5, 0)).norm(), 1e-5);
  EXPECT_LT(world.measure().kinetic_energy, 1e-3);
}

// The whole push of a bounce, 1 + e times the approach, rubs.
TEST_P(BothSteps, a_ball_that_bounces_aslant_is_slowed_by_friction_on_the_whole_push) {
  for (const double e : {0.0, 0.5, 1.0}) {
    for (const double height : {0.5, 0.537, 0.561}) {  // also across the end of a step
      World world({.gravity = {0, 0, 0}});
      add_floor(world, 0.2, e);
      const BodyId ball = world.add_body({.shapes = {Sphere{.radius = 0.5}},
                                          .position = {0, 0.5 + height, 0},
                                          .linear_velocity = {12, -4, 0},
                                          .friction = 0.2,
                                          .restitution = e});
      run(world, 0.5);
      EXPECT_NEAR(world.linear_velocity(ball).x(), 12 - 0.2 * (1 + e) * 4, 1e-3) << e;
      EXPECT_NEAR(world.linear_velocity(ball).y(), 4 * e, 1e-3) << e;
    }
  }
}

// As many balls leave Newton's cradle as strike it, at their speed, and the others rest.
TEST_P(BothSteps, a_cradle_passes_on_as_many_balls_as_strike_it) {
  for (const int balls : {5, 8}) {
    for (const int strikers : {1, 2, 3}) {
      for (const double gap : {0.0, 1e-4, 1e-3, 1e-2}) {
        World world({.gravity = {0, 0, 0}});
        std::vector<BodyId> row;
        for (int i = 0; i < balls; ++i) {
          const double x = i * (0.2 + gap) - (i < strikers ? 0.35 : 0);
          row.push_back(world.add_body({.shapes = {Sphere{.radius = 0.1}},
                                        .position = {x, 0, 0},
                                        .linear_velocity = {i < strikers ? 2.0 : 0.0, 0, 0},
                                        .friction = 0,
                                        .restitution = 1}));
        }
        run(world, 1.5);
        for (int i = 0; i < balls; ++i) {
          const double expected = i >= balls - strikers ? 2 : 0;
          EXPECT_NEAR(world.linear_velocity(row[static_cast<std::size_t>(i)]).x(), expected,
                      strikers == 1 ? 1e-3 : 0.05)
              << "ball " << i << " of " << balls << ", strikers " << strikers << ", gap " << gap;
        }
      }
    }
  }
}

// The ground gives the blow back through the ball that rests on it.
TEST_P(BothSteps, a_ball_that_drops_on_a_resting_ball_rises_again) {
  for (const double mass : {1.0, 3.0}) {
    World world;
    add_floor(world, 0, 1);
    const auto ball = [&](double y, double m) {
      return world.add_body({.shapes = {Sphere{.radius = 0.25}},
                             .position = {0, y, 0},
                             .friction = 0,
                             .restitution = 1,
                             .mass = MassOverride{.mass = m}});
    };
    const BodyId low = ball(0.25, 1);
    run(world, 1);
    const BodyId high = ball(2.75, mass);
    double apex = 0;
    for (int n = steps(1.4); n > 0; --n) {
      world.step(dt());
      if (n < steps(0.7)) apex = std::max(apex, world.pose(high).position.y());
    }
    EXPECT_NEAR(apex, 2.75, 0.005 * 2);
    EXPECT_NEAR(world.pose(low).position.y(), 0.25, 0.01);
  }
}

// A6. Momentum and Newton's law of restitution.
TEST_P(BothSteps, head_on_spheres_part_with_their_restitution) {
  World world({.gravity = {0, 0, 0}});
  const auto sphere = [&world](double x, double mass, double v) {
    return world.add_body({.shapes = {Sphere{.radius = 0.5}},
                           .position = {x, 0, 0},
                           .linear_velocity = {v, 0, 0},
                           .restitution = 0.5,
                           .mass = MassOverride{.mass = mass}});
  };
  const BodyId a = sphere(-2, 1, 3), b = sphere(2, 3, -1);
  run(world, 3);
  EXPECT_NEAR(world.linear_velocity(a).x(), -1.5, 1e-6);
  EXPECT_NEAR(world.linear_velocity(b).x(), 0.5, 1e-6);
}

// Where a box that is kicked along a heading comes to rest: distance and time.
struct Stop {
  double distance, time;
};
Stop slide_to_rest(double heading, double dt) {
  World world;
  add_floor(world, 0.5);
  const BodyId box = add_box(world, {0, 0.5, 0}, {0.5, 0.5, 0.5}, 0.5);
  for (int n = 0; n < 60; ++n) world.step(dt);  // settle
  const Vec3 start = world.pose(box).position;
  const Vec3 forward(std::cos(heading), 0, std::sin(heading));
  world.set_velocity(box, 5 * forward, Vec3::Zero());
  double time = 0, speed = 5;
  while (time < 3) {
    world.step(dt);
    // Forward alone: as its friction ends the box rocks back at about 1 cm/s.
    const double now = world.linear_velocity(box).dot(forward);
    if (now < 1e-2) {
      time += dt * std::min(1.0, speed / std::max(speed - now, 1e-9));
      break;
    }
    speed = now;
    time += dt;
  }
  for (int n = 0; n < 30; ++n) world.step(dt);
  return {(world.pose(box).position - start).norm(), time};
}

// A7. v^2 / (2 mu g) and v / (mu g).
TEST_P(BothSteps, a_sliding_box_stops_where_coulomb_says) {
  const Stop stop = slide_to_rest(0, dt());
  EXPECT_NEAR(stop.distance, 2.5484, 0.01 * 2.5484);
  EXPECT_NEAR(stop.time, 1.0194, 0.01 * 1.0194 + 0.5 * dt());
}

// A8. The friction cone is round.
TEST_P(BothSteps, friction_is_the_same_in_every_direction) {
  for (int i = 0; i < 12; ++i) {
    EXPECT_NEAR(slide_to_rest(i * kPi / 6, dt()).distance, 2.5484, 0.01 * 2.5484) << 30 * i;
  }
}

// A box or sphere lying on an incline; the distance along it after some time.
BodyId on_incline(World& world, double angle, double friction, bool box) {
  add_incline(world, angle, friction);
  const Vec3 normal(-std::sin(angle), std::cos(angle), 0);
  const Quat turn(Eigen::AngleAxisd(angle, Vec3::UnitZ()));
  return world.add_body(
      {.shapes = {box ? Shape(Box{.half_extents = {0.5, 0.5, 0.5}}) : Shape(Sphere{.radius = 0.5})},
       .position = 0.5 * normal,
       .orientation = turn,
       .friction = friction});
}

// A9. tan 25 deg = 0.4663: holds above, slides at g (sin - mu cos) below.
TEST_P(BothSteps, a_box_holds_on_an_incline_steeper_than_no_friction_allows) {
  const double angle = 25 * kPi / 180;
  World world;
  const BodyId box = on_incline(world, angle, 0.48, true);
  run(world, 0.5);
  const Vec3 start = world.pose(box).position;
  run(world, 10);
  EXPECT_LT((world.pose(box).position - start).norm(), 1e-3);
}
TEST_P(BothSteps, a_box_slides_down_an_incline_with_the_rest_of_gravity) {
  const double angle = 25 * kPi / 180;
  World world;
  const BodyId box = on_incline(world, angle, 0.44, true);
  run(world, 0.5);
  const double before = world.linear_velocity(box).norm();
  run(world, 2);
  EXPECT_NEAR((world.linear_velocity(box).norm() - before) / 2, 0.2338, 0.02 * 0.2338);
}

// A10. 5/7 v0 after 2 v0 / (7 mu g).
TEST_P(BothSteps, a_sliding_ball_ends_up_rolling_at_five_sevenths) {
  World world;
  add_floor(world, 0.3);
  const BodyId ball = add_sphere(world, {0, 0.5, 0}, 0.5, 0.3);
  run(world, 0.5);
  world.set_velocity(ball, {4, 0, 0}, Vec3::Zero());
  double rolling_at = -1;
  for (int n = 1; n <= steps(1); ++n) {
    world.step(dt());
    const double slip = world.linear_velocity(ball).x() + 0.5 * world.angular_velocity(ball).z();
    if (rolling_at < 0 && std::abs(slip) < 1e-2) rolling_at = n * dt();
  }
  EXPECT_NEAR(world.linear_velocity(ball).x(), 4 * 5 / 7.0, 0.005 * 2.857);
  EXPECT_NEAR(rolling_at, 0.3883, 0.005 * 0.3883 + dt());
}

// A11. 5/7 g sin.
TEST_P(BothSteps, a_ball_rolls_down_an_incline_at_five_sevenths_of_gravity) {
  World world;
  const BodyId ball = on_incline(world, 15 * kPi / 180, 0.6, false);
  run(world, 0.5);
  const double before = world.linear_velocity(ball).norm();
  run(world, 2);
  EXPECT_NEAR((world.linear_velocity(ball).norm() - before) / 2, 1.8136, 0.005 * 1.8136);
}

// Rollers that turn by up to a radian per step. `inertia` about their axis, of mass radius^2.
struct Roller {
  Shape shape;
  double radius, inertia;
};
std::vector<Roller> small_rollers() {
  const ShapeOptions lying = {
      .local_pose = {.orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()))}};
  return {{Sphere{.radius = 0.05}, 0.05, 0.4},
          {Sphere{.radius = 0.1, .hollow = true}, 0.1, 2 / 3.0},
          {{Cylinder{.radius = 0.08, .half_height = 0.1}, lying}, 0.08, 0.5}};
}
TEST_P(BothSteps, small_bodies_that_turn_fast_roll_as_large_ones) {
  for (const Roller& roller : small_rollers()) {
    World world;
    add_floor(world, 0.5, 0, 100);
    const BodyId body = world.add_body(
        {.shapes = {roller.shape}, .position = {0, roller.radius, 0}, .friction = 0.5});
    run(world, 0.5);
    world.set_velocity(body, {4, 0, 0}, Vec3::Zero());
    run(world, 1);
    const double rolling = 4 / (1 + roller.inertia);
    EXPECT_NEAR(world.linear_velocity(body).x(), rolling, 0.005 * rolling);
    EXPECT_NEAR(world.angular_velocity(body).z(), -rolling / roller.radius,
                0.005 * rolling / roller.radius);
  }
}
TEST_P(BothSteps, small_bodies_roll_down_an_incline_as_large_ones) {
  const double angle = 15 * kPi / 180;
  for (const Roller& roller : small_rollers()) {
    World world;
    add_incline(world, angle, 0.6);
    const BodyId body =
        world.add_body({.shapes = {roller.shape},
                        .position = roller.radius * Vec3(-std::sin(angle), std::cos(angle), 0),
                        .friction = 0.6});
    run(world, 0.5);
    const double before = world.linear_velocity(body).norm();
    run(world, 1.5);
    const double acceleration = kG * std::sin(angle) / (1 + roller.inertia);
    EXPECT_NEAR((world.linear_velocity(body).norm() - before) / 1.5, acceleration,
                0.005 * acceleration);
  }
}

// A ball that spins on one spot: Coulomb friction over a patch of a hundredth of its radius, pressed as
// Hertz says, has the moment 3 pi / 16 mu m g r / 100.
TEST_P(BothSteps, a_ball_that_spins_on_one_spot_is_slowed_by_its_patch_and_falls_asleep) {
  for (const double radius : {0.05, 0.25, 1.0}) {
    World world;
    add_floor(world);
    const BodyId ball = add_sphere(world, {0, radius, 0}, radius, 0.6);
    run(world, 0.25);
    const double spin = 0.1 / radius;
    world.set_velocity(ball, Vec3::Zero(), {0, spin, 0});
    const double slows = 3 * kPi / 16 * 0.6 * kG * 0.01 * radius / (0.4 * radius * radius);
    run(world, 0.5);
    EXPECT_NEAR(world.angular_velocity(ball).y(), spin - 0.5 * slows, 0.01 * spin) << radius;
    run(world, 1.5);
    EXPECT_FALSE(world.awake(ball)) << radius;
  }
}
TEST(Analytic, spin_goes_from_ball_to_ball_and_none_is_lost) {
  World world({.gravity = Vec3::Zero()});
  BodyId ball[2];
  for (int i = 0; i < 2; ++i) {
    ball[i] = world.add_body({.shapes = {Sphere{.radius = 0.5}},
                              .position = {i - 0.5, 0, 0},
                              .angular_velocity = {i == 0 ? 3.0 : 0.0, 0, 0},
                              .friction = 0.6});
  }
  for (int n = 0; n < 30; ++n) {
    for (int i = 0; i < 2; ++i) world.apply_force(ball[i], {i == 0 ? 1e4 : -1e4, 0, 0});
    world.step(1.0 / 60);
  }
  const double moment = 3 * kPi / 16 * 0.6 * 1e4 * 0.005,
               inertia = 0.4 * world.mass(ball[0]) * 0.25;
  const double spin[2] = {world.angular_velocity(ball[0]).x(), world.angular_velocity(ball[1]).x()};
  EXPECT_NEAR(spin[1], 0.5 * moment / inertia, 0.02 * spin[1]);
  EXPECT_NEAR(spin[0] + spin[1], 3, 1e-12);
}

// A18. Halving the step halves the error at least, wherever there is an error to speak of; `errors`
// at steps of 1/30, 1/60, 1/120 and 1/240 s.
void expect_order(const std::array<double, 4>& errors, double order, double negligible) {
  const double last = std::max(errors[3], negligible), first = std::max(errors[0], negligible);
  if (first > negligible) {
    EXPECT_GE(std::log2(first / last) / 3, order)
        << errors[0] << ' ' << errors[1] << ' ' << errors[2] << ' ' << errors[3];
  }
}
constexpr std::array<double, 4> kHalvedSteps = {1.0 / 30, 1.0 / 60, 1.0 / 120, 1.0 / 240};

TEST(Analytic, halving_the_step_halves_the_error_of_a_sliding_box) {
  std::array<double, 4> errors;
  for (std::size_t k = 0; k < 4; ++k)
    errors[k] = std::abs(slide_to_rest(0, kHalvedSteps[k]).distance - 25 / (2 * 0.5 * kG));
  expect_order(errors, 0.9, 1e-6);
}

TEST(Analytic, halving_the_step_halves_the_error_of_a_ball_that_begins_to_roll) {
  std::array<double, 4> errors;
  for (std::size_t k = 0; k < 4; ++k) {
    const double dt = kHalvedSteps[k];
    World world;
    add_floor(world, 0.3);
    const BodyId ball = add_sphere(world, {0, 0.5, 0}, 0.5, 0.3);
    for (int n = 0; n < 0.5 / dt; ++n) world.step(dt);
    const double start = world.pose(ball).position.x();
    world.set_velocity(ball, {4, 0, 0}, Vec3::Zero());
    for (double t = 0.5 * dt; t < 1; t += dt) world.step(dt);
    const double slides = 2 * 4 / (7 * 0.3 * kG);
    const double truth = 4 * slides - 0.5 * 0.3 * kG * slides * slides + 20 / 7.0 * (1 - slides);
    errors[k] = std::abs(world.pose(ball).position.x() - start - truth);
    EXPECT_LT(errors[k], 1e-3);
  }
  expect_order(errors, 0.9, 1e-6);
}

TEST(Analytic, halving_the_step_quarters_the_error_of_flight_through_drag) {
  std::array<double, 4> errors;
  for (std::size_t k = 0; k < 4; ++k) {
    World world;
    world.add_force_field([](const FieldSample& at) {
      return FieldForce{-0.5 * at.mass * at.velocity, Vec3::Zero()};
    });
    const BodyId ball = world.add_body(
        {.shapes = {Sphere{.radius = 0.5}}, .position = {0, 50, 0}, .linear_velocity = {3, 10, 0}});
    for (double t = 0.5 * kHalvedSteps[k]; t < 2; t += kHalvedSteps[k]) world.step(kHalvedSteps[k]);
    const double rest = std::exp(-0.5 * 2), fall = -kG / 0.5;
    const Vec3 truth(3 / 0.5 * (1 - rest), 50 + fall * 2 + (10 - fall) / 0.5 * (1 - rest), 0);
    errors[k] = (world.pose(ball).position - truth).norm();
  }
  expect_order(errors, 1.9, 1e-12);
}

// A17. A heavy box on a light one neither passes nor sinks in.
double sink_of_heavy_on_light(double ratio, double dt) {
  World world;
  add_floor(world);
  add_box(world, {0, 0.5, 0}, {0.5, 0.5, 0.5}, 0.6, 100);
  const BodyId heavy = add_box(world, {0, 1.5, 0}, {0.5, 0.5, 0.5}, 0.6, 100 * ratio);
  for (int n = static_cast<int>(std::lround(5 / dt)); n > 0; --n) world.step(dt);
  return 1.5 - world.pose(heavy).position.y();
}
TEST_P(BothSteps, a_light_box_carries_a_hundred_times_its_weight) {
  EXPECT_LT(sink_of_heavy_on_light(10, dt()), 1e-3);
  EXPECT_LT(sink_of_heavy_on_light(100, dt()), 1e-3);
}
TEST_P(BothSteps, a_light_box_carries_a_thousand_times_its_weight) {
  EXPECT_LT(sink_of_heavy_on_light(1000, dt()), 1e-3);
}

// Cubes on each other, in a column or in a triangle one layer deep.
std::vector<BodyId> add_column(World& world, int height, double density = 1000) {
  std::vector<BodyId> boxes;
  for (int i = 0; i < height; ++i) {
    boxes.push_back(add_box(world, {0, 0.5 + i, 0}, {0.5, 0.5, 0.5}, 0.6, density));
  }
  return boxes;
}

// A12. A stack at rest neither sinks nor drifts, at no time.
struct Stack {
  int height;
  double side, mass, gap;  // m, kg; m between boxes that are put up
};
std::vector<BodyId> put_up(World& world, const Stack& stack) {
  std::vector<BodyId> boxes;
  for (int i = 0; i < stack.height; ++i) {
    const double y = (i + 0.5) * stack.side + (i + 1) * stack.gap;
    boxes.push_back(add_box(world, {0, y, 0}, Vec3::Constant(0.5 * stack.side), 0.6,
                            stack.mass / std::pow(stack.side, 3)));
  }
  return boxes;
}
double farthest_from_place(const World& world, const Stack& stack,
                           const std::vector<BodyId>& boxes) {
  double farthest = 0;
  for (int i = 0; i < stack.height; ++i) {
    const Vec3 at = world.pose(boxes[static_cast<std::size_t>(i)]).position;
    farthest = std::max(farthest, (at - Vec3(0, (i + 0.5) * stack.side, 0)).norm());
  }
  return farthest;
}
TEST_P(BothSteps, a_stack_stands_where_it_was_put_for_a_minute) {
  for (const Stack& stack :
       {Stack{10, 1, 1000, 0}, {15, 0.2, 5, 0}, {10, 2, 8000, 0}, {20, 0.5, 100, 0}}) {
    World world({.sleep = {.enabled = false}});
    add_floor(world);
    const std::vector<BodyId> boxes = put_up(world, stack);
    double farthest = 0;
    for (int n = steps(60); n > 0; --n) {
      world.step(dt());
      farthest = std::max(farthest, farthest_from_place(world, stack, boxes));
    }
    EXPECT_LT(farthest, 1e-5) << stack.height << " of " << stack.side;
    EXPECT_LT(world.measure().kinetic_energy, 1e-6);
  }
}

// Put up with gaps, or in each other, a stack comes to stand at its true height.
TEST_P(BothSteps, a_stack_that_has_fallen_into_place_stands_at_its_height) {
  for (const Stack& stack : {Stack{10, 1, 1000, 0.001},
                             {10, 1, 1000, 0.01},
                             {10, 1, 1000, 0.05},
                             {10, 1, 1000, -0.005},
                             {15, 0.2, 5, 0.005},
                             {8, 2, 8000, 0.02}}) {
    World world({.sleep = {.enabled = false}});
    add_floor(world);
    const std::vector<BodyId> boxes = put_up(world, stack);
    run(world, 2);
    double farthest = 0;
    for (int n = steps(10); n > 0; --n) {
      world.step(dt());
      farthest = std::max(farthest, farthest_from_place(world, stack, boxes));
    }
    EXPECT_LT(farthest, 5e-4) << stack.height << " of " << stack.side << ", gaps " << stack.gap;
    EXPECT_LT(world.measure().kinetic_energy, 1e-6);
  }
}
TEST_P(BothSteps, a_stack_falls_asleep_at_its_height) {
  World world;
  add_floor(world);
  const Stack stack{10, 1, 1000, 0.01};
  const std::vector<BodyId> boxes = put_up(world, stack);
  run(world, 5);
  EXPECT_FALSE(world.awake(boxes.back()));
  EXPECT_LT(farthest_from_place(world, stack, boxes), 2e-3);
}

// Gravity changes: the loads of all contacts, and no height.
TEST_P(BothSteps, a_stack_bears_another_load_from_the_first_step_on) {
  World world({.sleep = {.enabled = false}});
  add_floor(world);
  const Stack stack{10, 1, 1000, 0};
  const std::vector<BodyId> boxes = put_up(world, stack);
  double farthest = 0;
  for (int n = 0; n < steps(3); ++n) {
    if (n == steps(1)) world.set_gravity({0, -20, 0});
    if (n == steps(2)) world.set_gravity({0, -5, 0});
    world.step(dt());
    farthest = std::max(farthest, farthest_from_place(world, stack, boxes));
  }
  EXPECT_LT(farthest, 1e-4);
}

TEST_P(BothSteps, a_ball_rests_on_the_surface_at_any_gravity) {
  for (const double g : {1.6, 9.81, 100.0, 981.0}) {
    World world({.gravity = {0, -g, 0}, .sleep = {.enabled = false}});
    add_floor(world);
    const BodyId ball = add_sphere(world, {0, 0.52, 0}, 0.5, 0.6);
    run(world, 5);
    EXPECT_NEAR(world.pose(ball).position.y(), 0.5, 1e-4) << g;
  }
}

// Each leg bears 185 times its weight, and statics does not say which bears how much.
TEST_P(BothSteps, a_heavy_slab_does_not_press_its_four_legs_in) {
  World world({.sleep = {.enabled = false}});
  add_floor(world);
  for (const double x : {-0.9, 0.9})
    for (const double z : {-0.9, 0.9}) add_box(world, {x, 0.251, z}, {0.25, 0.25, 0.25}, 0.6, 1000);
  add_box(world, {0, 0.71, 0}, {1.2, 0.2, 1.2}, 0.6, 4e4);
  run(world, 6);
  const double softer = (dt() * 60) * (dt() * 60);
  EXPECT_LT(world.measure().penetration_max, 7e-3 * softer);
}

// Half of a stack is taken away: what is left neither jumps nor trembles.
TEST_P(BothSteps, a_stack_stays_when_its_upper_half_is_taken_away) {
  World world({.sleep = {.enabled = false}});
  add_floor(world);
  const std::vector<BodyId> boxes = add_column(world, 20);
  run(world, 2);
  for (std::size_t i = 10; i < 20; ++i) world.remove_body(boxes[i]);
  double highest = 0;
  for (int n = steps(20); n > 0; --n) {
    world.step(dt());
    highest = std::max(highest, world.pose(boxes[9]).position.y());
  }
  EXPECT_LT(highest, 9.5001);
  EXPECT_LT(world.measure().kinetic_energy, 1e-3);  // ten boxes of a tonne
}

// What is symmetric has no side to lean to.
TEST_P(BothSteps, a_column_left_alone_does_not_lean) {
  for (const int height : {1, 2, 7, 20, 40}) {
    for (const double g : {9.7, 9.81, 10.0}) {
      World world({.gravity = {0, -g, 0}, .sleep = {.enabled = false}});
      add_floor(world);
      const std::vector<BodyId> boxes = add_column(world, height, 300);
      run(world, 5);
      const Vec3 top = world.pose(boxes.back()).position;
      EXPECT_LT(std::hypot(top.x(), top.z()), 1e-6) << height << " at " << g;
    }
  }
}
TEST_P(BothSteps, a_heavy_box_at_the_top_does_not_make_a_column_lean) {
  World world({.sleep = {.enabled = false}});
  add_floor(world);
  add_column(world, 3, 100);
  const BodyId top = add_box(world, {0, 3.5, 0}, {0.5, 0.5, 0.5}, 0.6, 1e5);
  run(world, 5);
  const Vec3 at = world.pose(top).position;
  EXPECT_LT(std::hypot(at.x(), at.z()), 1e-6);
  EXPECT_NEAR(at.y(), 3.5, 1e-3);
}
TEST_P(BothSteps, a_pyramid_stays_in_its_plane) {
  World world({.sleep = {.enabled = false}});
  add_floor(world);
  std::vector<BodyId> boxes;
  for (int row = 0; row < 15; ++row) {
    for (int k = 0; k < 15 - row; ++k) {
      boxes.push_back(add_box(world, {k + 0.5 * row - 7, row + 0.5, 0}, {0.5, 0.5, 0.5}, 0.6, 100));
    }
  }
  run(world, 5);
  for (const BodyId box : boxes) EXPECT_LT(std::fabs(world.pose(box).position.z()), 1e-5);
}

// Each box lands a few centimetres beside the one below. Nothing drives the sway that this leaves.
TEST_P(BothSteps, crooked_towers_come_to_rest) {
  World world({.sleep = {.enabled = false}});
  world.add_body({.type = BodyType::fixed,
                  .shapes = {Box{.half_extents = {200, 1, 200}}},
                  .position = {0, -1, 0},
                  .friction = 0.6});
  for (int tower = 0; tower < 36; ++tower) {
    const Vec3 foot(30 * (tower % 6) - 75, 0, 30 * (tower / 6) - 75);
    for (int i = 0; i < 10; ++i) {
      const double angle = 2.4 * (10 * tower + i);
      const Vec3 beside(0.06 * std::sin(angle), 0.6 + 1.2 * i, 0.06 * std::cos(1.7 * angle));
      add_box(world, foot + beside, {0.5, 0.5, 0.5}, 0.6, 1000);
    }
  }
  run(world, 12);
  EXPECT_LT(world.measure().kinetic_energy, 0.01);
  EXPECT_LT(world.measure().penetration_max, 3e-3);
}

// Sixteen boxes, each a few centimetres beside the one below, dropped on each other.
TEST_P(BothSteps, a_tower_that_lands_crooked_stands) {
  World world({.sleep = {.enabled = false}});
  add_floor(world);
  std::vector<BodyId> boxes;
  for (int i = 0; i < 16; ++i) {
    const Vec3 at(0.05 * std::sin(13.0 * i), 1 + 1.2 * i, 0.05 * std::cos(78.0 * i));
    boxes.push_back(add_box(world, at, {0.5, 0.5, 0.5}, 0.6, 1000));
  }
  run(world, 12);
  for (int i = 0; i < 16; ++i) {
    EXPECT_NEAR(world.pose(boxes[static_cast<std::size_t>(i)]).position.y(), 0.5 + i, 0.03) << i;
  }
}

}  // namespace
}  // namespace skerry::test
