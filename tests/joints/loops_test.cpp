// Loops of joints, most of them with more locks than freedom: they hold, and gain no energy.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "tests/joints/joint_worlds.h"

namespace skerry::test {
namespace {

// A world of bars that watches how far its joints are apart.
class Linkage {
 public:
  explicit Linkage(const Vec3& gravity)
      : world({.gravity = gravity, .sleep = {.enabled = false}}) {}

  BodyId bar(const Vec3& from, const Vec3& to, double mass, const Vec3& spin = Vec3::Zero(),
             const Vec3& velocity = Vec3::Zero()) {
    const double length = (to - from).norm();
    return world.add_body({.shapes = {{Box{.half_extents = Vec3(0.5, 0.05, 0.05) * length},
                                       {.filter = {.category = 2, .mask = 0}}}},
                           .position = 0.5 * (from + to),
                           .orientation = Quat::FromTwoVectors(Vec3::UnitX(), to - from),
                           .linear_velocity = velocity + spin.cross(0.5 * (from + to)),
                           .angular_velocity = spin,
                           .mass = MassOverride{.mass = mass}});
  }
  template <class Joint>
  void join(Joint joint) {
    world.add_joint(joint);
    joints_.push_back(
        {joint.a, joint.b, local(joint.a, joint.anchor), local(joint.b, joint.anchor)});
  }
  double drift() const {  // m
    double most = 0;
    for (const Anchors& j : joints_) {
      most = std::max(most, (placed(j.a, j.in_a) - placed(j.b, j.in_b)).norm());
    }
    return most;
  }

  World world;
  double link = 1;  // m, the shortest

 private:
  struct Anchors {
    BodyId a, b;
    Vec3 in_a, in_b;
  };
  Vec3 local(BodyId body, const Vec3& point) const {
    if (body == BodyId{}) return point;
    const Pose pose = world.pose(body);
    return pose.orientation.conjugate() * (point - pose.position);
  }
  Vec3 placed(BodyId body, const Vec3& point) const {
    if (body == BodyId{}) return point;
    const Pose pose = world.pose(body);
    return pose.position + pose.orientation * point;
  }
  std::vector<Anchors> joints_;
};

const Vec3 kDown = {0, -kG, 0};

// Drift below 1 % of a link and no energy gained over 20 s, within a part of the largest kinetic energy.
void expect_holds(Linkage& linkage, double dt, double most_gain = 0.01) {
  const double start = energy(linkage.world);
  double kinetic = linkage.world.measure().kinetic_energy, gain = 0, drift = 0;
  for (int n = static_cast<int>(20 / dt); n > 0; --n) {
    linkage.world.step(dt);
    gain = std::max(gain, energy(linkage.world) - start);
    kinetic = std::max(kinetic, linkage.world.measure().kinetic_energy);
    drift = std::max(drift, linkage.drift());
  }
  EXPECT_LT(drift, 0.01 * linkage.link);
  EXPECT_LT(gain, most_gain * kinetic);
}

class Loops : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Joints, Loops, testing::Values(1.0 / 60, 1.0 / 240),
                         [](const auto& given) { return given.param < 0.01 ? "dt_240" : "dt_60"; });

// Crank, coupler and rocker between two pivots of a base. `skew`: by how much the axes of the four
// hinges miss being parallel.
struct FourBar {
  double crank, coupler, rocker, base;
  double skew = 0, coupler_mass = 1;
};
void build(Linkage& linkage, const FourBar& f, bool free_base, double spin = 0) {
  const Vec3 left = Vec3::Zero(), right = {f.base, 0, 0};
  const Vec3 top = f.crank * Vec3(std::cos(2.0), std::sin(2.0), 0);
  const Vec3 to_right = right - top;
  const double d = to_right.norm();
  const double along = (f.coupler * f.coupler - f.rocker * f.rocker + d * d) / (2 * d);
  const Vec3 unit = to_right / d;
  const Vec3 far = top + along * unit +
                   std::sqrt(f.coupler * f.coupler - along * along) * Vec3(-unit.y(), unit.x(), 0);
  linkage.link = std::min({f.crank, f.coupler, f.rocker, f.base});
  const BodyId crank = linkage.bar(left, top, 1, {0, 0, spin});
  const BodyId coupler = linkage.bar(top, far, f.coupler_mass);
  const BodyId rocker = linkage.bar(far, right, 1);
  const BodyId base = free_base ? linkage.bar(left, right, 1) : BodyId{};
  const auto hinge = [&](BodyId a, BodyId b, const Vec3& at, int n) {
    const Vec3 axis(f.skew * std::cos(2.1 * n), f.skew * std::sin(3.3 * n + 1), 1);
    linkage.join(HingeJoint{.a = a, .b = b, .anchor = at, .axis = axis.normalized()});
  };
  hinge(base, crank, left, 0);
  hinge(crank, coupler, top, 1);
  hinge(coupler, rocker, far, 2);
  hinge(rocker, base, right, 3);
}

constexpr FourBar kFourBars[] = {
    {1, 2, 2, 2.2}, {0.4, 1, 0.8, 1.1}, {1, 1.5, 1.2, 1.6}, {0.3, 0.5, 0.5, 0.6}};

TEST_P(Loops, four_bar_linkages_on_the_world_swing_on) {
  for (FourBar f : kFourBars) {
    for (const double skew : {0.0, 0.001, 0.02}) {
      SCOPED_TRACE(std::to_string(f.crank) + " skew " + std::to_string(skew));
      f.skew = skew;
      Linkage linkage(kDown);
      build(linkage, f, false);
      expect_holds(linkage, GetParam());
    }
  }
}

TEST_P(Loops, free_four_bar_linkages_turn_on) {
  for (FourBar f : kFourBars) {
    for (const double ratio : {1.0, 100.0}) {
      SCOPED_TRACE(std::to_string(f.crank) + " ratio " + std::to_string(ratio));
      f.coupler_mass = ratio;
      Linkage linkage(Vec3::Zero());
      build(linkage, f, true, 3);
      const double start = energy(linkage.world);
      linkage.world.step(GetParam());  // the spin of one bar becomes that of the linkage
      EXPECT_LT(energy(linkage.world), start);
      expect_holds(linkage, GetParam());
    }
  }
}

// Bars in a ring in the xy plane, one of them of another mass, each joined to the next.
enum class RingJoint : std::uint8_t { hinge, fixed, locked_six };
void build_ring(Linkage& linkage, int bars, RingJoint kind, double odd_mass, bool thrown) {
  const auto corner = [&](int i) -> Vec3 {
    const double angle = 2 * kPi * i / bars;
    return bars / 6.0 * Vec3(std::cos(angle), std::sin(angle), 0);
  };
  linkage.link = (corner(1) - corner(0)).norm();
  std::vector<BodyId> ring;
  for (int i = 0; i < bars; ++i) {
    ring.push_back(linkage.bar(corner(i), corner(i + 1), i == bars / 2 ? odd_mass : 1,
                               thrown ? Vec3(1, 2, 3) : Vec3::Zero()));
  }
  for (int i = 0; i < bars; ++i) {
    const BodyId a = ring[static_cast<std::size_t>((i + bars - 1) % bars)];
    const BodyId b = ring[static_cast<std::size_t>(i)];
    if (kind == RingJoint::hinge) linkage.join(HingeJoint{.a = a, .b = b, .anchor = corner(i)});
    if (kind == RingJoint::fixed) linkage.join(FixedJoint{.a = a, .b = b, .anchor = corner(i)});
    if (kind == RingJoint::locked_six)
      linkage.join(SixDofJoint{.a = a, .b = b, .anchor = corner(i)});
  }
  if (!thrown) linkage.join(BallJoint{.b = ring[0], .anchor = corner(0)});
}

TEST_P(Loops, a_ring_of_20_hinged_links_hangs_and_flies) {
  for (const double ratio : {1.0, 100.0}) {
    Linkage thrown(Vec3::Zero());
    build_ring(thrown, 20, RingJoint::hinge, ratio, true);
    expect_holds(thrown, GetParam());
  }
  Linkage hung(kDown);
  build_ring(hung, 20, RingJoint::hinge, 1, false);
  const bool coarse = GetParam() > 0.01;  // it collapses and flails: an error of the second order
  expect_holds(hung, GetParam(), coarse ? 0.02 : 0.0025);
}

TEST_P(Loops, rings_of_locked_joints_are_rigid) {
  for (const RingJoint kind : {RingJoint::fixed, RingJoint::locked_six}) {
    for (const double ratio : {1.0, 100.0}) {
      for (const bool thrown : {true, false}) {
        Linkage square(thrown ? Vec3(Vec3::Zero()) : kDown);
        build_ring(square, 4, kind, ratio, thrown);
        expect_holds(square, GetParam());
      }
    }
  }
  Linkage ring(kDown);
  build_ring(ring, 20, RingJoint::fixed, 1, false);
  expect_holds(ring, GetParam());
}

// Two hinges between the same two bodies, their axes not quite in line.
TEST_P(Loops, a_door_swings_on_two_hinges) {
  for (const double skew : {0.0, 0.02}) {
    for (const double frame_mass : {0.0, 5.0, 500.0}) {  // 0: the world
      SCOPED_TRACE(std::to_string(skew) + " frame " + std::to_string(frame_mass));
      Linkage linkage(kDown);
      BodyId frame = {};
      if (frame_mass > 0) {
        frame = linkage.bar({-1, 0, 0}, {0, 0, 0}, frame_mass);
        linkage.join(HingeJoint{.b = frame, .anchor = {-1, 0, 0}});
      }
      const BodyId door = linkage.bar({0, 0, 0}, {1, 0, 0}, 5, {0, 1, 0});
      linkage.join(HingeJoint{
          .a = frame, .b = door, .anchor = {0, 0.4, 0}, .axis = Vec3(0, 1, skew).normalized()});
      linkage.join(HingeJoint{
          .a = frame, .b = door, .anchor = {0, -0.4, 0}, .axis = Vec3(skew, 1, 0).normalized()});
      expect_holds(linkage, GetParam());
    }
  }
}

// Too many loops for a solve at once.
TEST_P(Loops, a_net_of_balls_hangs_still) {
  Linkage net(kDown);
  std::vector<BodyId> nodes;
  for (int i = 0; i < 36; ++i) {
    const Vec3 at(i % 6, -(i / 6), 0);
    nodes.push_back(net.bar(at - Vec3(0.4, 0, 0), at + Vec3(0.4, 0, 0), 1));
    if (i < 6) net.join(BallJoint{.b = nodes.back(), .anchor = at});
    if (i >= 6)
      net.join(BallJoint{.a = nodes[static_cast<std::size_t>(i - 6)],
                         .b = nodes.back(),
                         .anchor = at + Vec3(0, 0.5, 0)});
    if (i % 6)
      net.join(BallJoint{.a = nodes[static_cast<std::size_t>(i - 1)],
                         .b = nodes.back(),
                         .anchor = at - Vec3(0.5, 0, 0)});
  }
  const double start = energy(net.world);
  run(net.world, 5, GetParam());
  EXPECT_LT(net.drift(), 0.02);
  EXPECT_LT(energy(net.world), start + 1e-3);
}

// What opposes itself: neither grows.
TEST_P(Loops, a_motor_without_bound_rests_at_its_limit) {
  World world;
  const BodyId lift = add_point(world, {0, 0, 0}, 3, 1);
  const JointId rail = world.add_joint(
      SliderJoint{.b = lift,
                  .axis = {0, 1, 0},
                  .limits = {.lower = 0, .upper = 0.5},
                  .drive = {.motor = {.mode = JointMotorMode::velocity, .target = 2}}});
  run(world, 20, GetParam());
  EXPECT_NEAR(world.pose(lift).position.y(), 0.5, 1e-3);
  EXPECT_LT(world.linear_velocity(lift).norm(), 1e-3);
  EXPECT_NEAR(world.joint_force(rail).y(), 3 * kG, 0.1);
  world.set_joint_drive(rail, JointCoordinate::z,
                        {.motor = {.mode = JointMotorMode::velocity, .target = -2}});
  run(world, 20, GetParam());
  EXPECT_NEAR(world.pose(lift).position.y(), 0, 1e-3);
}

}  // namespace
}  // namespace skerry::test
