// What joints carry, what they break under, and masses of 1 to 1000.
#include <gtest/gtest.h>

#include <map>

#include "tests/joints/joint_worlds.h"
#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

TEST(Joints, a_hanging_weight_pulls_with_its_weight) {
  World world;
  const BodyId link = add_rod(world, {0, 0, 0}, {0, -1, 0}, 0.5);
  const BodyId weight = add_point(world, {0, -1.2, 0}, 30, 1);
  const JointId top = world.add_joint(BallJoint{.b = link});
  const JointId hook = world.add_joint(FixedJoint{.a = link, .b = weight, .anchor = {0, -1, 0}});
  run(world, 1);
  EXPECT_NEAR(world.joint_force(top).y(), 30.5 * kG, 1e-3 * 30.5 * kG);
  EXPECT_NEAR(world.joint_force(hook).y(), 30 * kG, 1e-3 * 30 * kG);
}

TEST(Joints, a_beam_fixed_to_the_world_reports_its_bending_moment) {
  World world;
  const BodyId beam = add_rod(world, {0, 0, 0}, {2, 0, 0}, 5);
  const JointId root = world.add_joint(FixedJoint{.b = beam});
  run(world, 1);
  EXPECT_NEAR(world.joint_force(root).y(), 5 * kG, 1e-3 * 5 * kG);
  EXPECT_NEAR(world.joint_torque(root).z(), 5 * kG, 1e-3 * 5 * kG);  // at half its length
}

TEST(Joints, a_joint_breaks_at_its_load_and_is_reported_once) {
  for (const double strength : {0.99, 1.01}) {
    World world;
    const BodyId bob = add_point(world, {0, -1, 0}, 10, 1);
    const JointId joint =
        world.add_joint(BallJoint{.b = bob, .breaks = {.force = strength * 10 * kG}});
    world.step(kDt);
    EXPECT_EQ(world.contains(joint), strength > 1);
    ASSERT_EQ(world.broken_joints().size(), strength > 1 ? 0u : 1u);
    if (strength > 1) continue;
    EXPECT_EQ(world.broken_joints()[0].joint, joint);
    EXPECT_EQ(world.broken_joints()[0].b, bob);
    EXPECT_NEAR(world.broken_joints()[0].force.y(), 10 * kG, 1e-2 * 10 * kG);
    run(world, 1);
    EXPECT_TRUE(world.broken_joints().empty());
    EXPECT_LT(world.pose(bob).position.y(), -5);
  }
}

// Stretch of the links of a chain of balls with a heavy end, as a part of a link, while it swings and
// at rest.
struct Stretch {
  double most, at_rest;
};
Stretch stretch_of_chain(int links, double ratio, double start_angle) {
  World world;
  constexpr double kLink = 0.4;
  const Vec3 down = kLink * Vec3(std::sin(start_angle), -std::cos(start_angle), 0);
  std::vector<BodyId> chain;
  std::vector<JointId> joints;
  for (int i = 0; i <= links; ++i) {
    const bool end = i == links;
    chain.push_back(end ? add_point(world, (links + 0.5) * down, ratio, 0.1 * ratio)
                        : add_rod(world, i * down, (i + 1) * down, 1));
    joints.push_back(
        world.add_joint(BallJoint{.a = i > 0 ? chain[static_cast<std::size_t>(i) - 1] : BodyId{},
                                  .b = chain.back(),
                                  .anchor = i * down}));
  }
  Stretch stretch = {0, 0};
  for (int n = 0; n < 300; ++n) {
    world.step(kDt);
    stretch.at_rest = 0;
    for (const JointId joint : joints) {
      const double gap = world.joint_position(joint, JointCoordinate::distance) / kLink;
      stretch.at_rest = std::max(stretch.at_rest, gap);
    }
    stretch.most = std::max(stretch.most, stretch.at_rest);
  }
  return stretch;
}
TEST(Joints, light_chains_carry_a_thousand_times_the_mass_of_a_link) {
  for (const int links : {10, 20}) {
    EXPECT_LT(stretch_of_chain(links, 1000, 0).most, 5e-3) << links << " links, hanging";
    EXPECT_LT(stretch_of_chain(links, 1000, 1.2).most, 1e-2) << links << " links, swinging";
  }
}

// A bridge without slack: straight, it could carry nothing but by forces without bounds.
TEST(Joints, a_taut_bridge_of_planks_bears_a_ball_of_a_hundred_times_a_plank) {
  for (const double density : {100.0, 1000.0, 5000.0}) {  // a plank has 19 kg
    World world;
    constexpr int kPlanks = 16;
    BodyId last = {};
    std::vector<JointId> joints;
    const auto hinge = [&](BodyId next, double x) {
      joints.push_back(world.add_joint(HingeJoint{.a = last, .b = next, .anchor = {x, 0, 0}}));
      last = next;
    };
    for (int i = 0; i < kPlanks; ++i) {
      hinge(add_box(world, {i + 0.5, 0, 0}, {0.48, 0.1, 1}, 0.6, 50), i);
    }
    hinge(BodyId{}, kPlanks);
    const BodyId ball = add_sphere(world, {8.2, 1, 0}, 0.5, 0.6, 0, density);
    const double start = energy(world);
    for (int n = 0; n < 480; ++n) {
      world.step(kDt);
      EXPECT_LT(energy(world), 1.01 * start) << "density " << density;
      for (const JointId joint : joints) {
        EXPECT_LT(world.joint_position(joint, JointCoordinate::distance), 0.07);  // as it lands
      }
    }
    EXPECT_GT(world.pose(ball).position.y(), -0.5) << "density " << density;
  }
}

// A chain that lands flat on two bars and the ground: each blow is answered by the joints at once.
TEST(Joints, blows_of_contacts_do_not_pull_a_chain_apart) {
  for (const double dt : {kDt, kDt / 4}) {
    for (const double speed : {3.0, 6.0, 10.0}) {
      World world;
      add_floor(world);
      const Quat along_z(Eigen::AngleAxisd(kPi / 2, Vec3::UnitX()));
      for (const double x : {-1.0, 0.9})
        world.add_body({.type = BodyType::fixed,
                        .shapes = {Capsule{.radius = 0.1, .half_height = 1}},
                        .position = {x, 1, 0},
                        .orientation = along_z});
      BodyId last = {};
      std::vector<JointId> joints;
      for (int i = 0; i < 10; ++i) {
        const Vec3 at(0.4 * (i - 4.5), 1.5 + 0.02 * i, 0);
        const BodyId link =
            world.add_body({.shapes = {Capsule{.radius = 0.08, .half_height = 0.12}},
                            .position = at,
                            .orientation = Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ())),
                            .linear_velocity = {0, -speed, 0}});
        if (i > 0)
          joints.push_back(
              world.add_joint(BallJoint{.a = last, .b = link, .anchor = at - Vec3(0.2, 0.01, 0)}));
        last = link;
      }
      double worst = 0, sum = 0;
      int count = 0;
      for (int n = static_cast<int>(std::lround(2 / dt)); n > 0; --n) {
        world.step(dt);
        for (const JointId joint : joints) {
          const double apart = world.joint_position(joint, JointCoordinate::distance);
          worst = std::max(worst, apart);
          sum += apart;
          ++count;
        }
      }
      EXPECT_LT(worst, 0.25 * speed * dt) << speed << " m/s, dt " << dt;
      EXPECT_LT(sum / count, 2e-3 * speed * dt) << speed << " m/s, dt " << dt;
    }
  }
}

// Jolt #2092 and its like: locks leave nothing to move along a row, and nothing may be divided by it.
TEST(Joints, locked_axes_contacts_and_joints_of_every_type_stay_finite) {
  for (int locks = 0; locks < 64; locks += 3) {
    World world;
    add_floor(world);
    BodyDesc desc = {.shapes = {Box{.half_extents = {0.3, 0.3, 0.3}}}, .position = {0, 0.29, 0}};
    for (std::size_t i = 0; i < 3; ++i) {
      desc.locks.translation[i] = locks & (1 << i);
      desc.locks.rotation[i] = locks & (8 << i);
    }
    std::vector<BodyId> boxes;
    for (int i = 0; i < 9; ++i) {
      desc.position = {0.55 * i, 0.29, 0};
      boxes.push_back(world.add_body(desc));
    }
    const Vec3 at = {0.3, 0.3, 0};
    const JointDrive drive = {.spring = {.frequency = 3}, .friction = 1};
    world.add_joint(BallJoint{.a = boxes[0], .b = boxes[1], .anchor = at, .friction_torque = 1});
    world.add_joint(HingeJoint{.a = boxes[1],
                               .b = boxes[2],
                               .anchor = at,
                               .lower_angle = 0.1,
                               .drive = drive,
                               .collide = true});
    world.add_joint(SliderJoint{
        .a = boxes[2], .b = boxes[3], .anchor = at, .limits = {.lower = 0.1}, .drive = drive});
    world.add_joint(FixedJoint{.a = boxes[3], .b = boxes[4], .anchor = at});
    world.add_joint(
        DistanceJoint{.a = boxes[4], .b = boxes[5], .limits = {.lower = 1, .upper = 1}});
    world.add_joint(DistanceJoint{.a = boxes[5], .b = boxes[6], .limits = {.upper = 1}});
    world.add_joint(ConeTwistJoint{.a = boxes[6],
                                   .b = boxes[7],
                                   .anchor = at,
                                   .swing_limit = 0.0,
                                   .swing = drive,
                                   .twist = drive});
    world.add_joint(SixDofJoint{.a = boxes[7], .b = boxes[8], .anchor = at});
    world.add_joint(BallJoint{.a = boxes[8], .b = boxes[0], .anchor = at});  // closes the loop
    run(world, 1);
    EXPECT_TRUE(world.last_report().warnings.empty()) << "locks " << locks;
    for (const BodyId box : boxes) {
      EXPECT_TRUE(world.pose(box).position.allFinite()) << "locks " << locks;
    }
  }
}

// The order in which joints are added may matter by rounding only.
TEST(Joints, order_of_joints_does_not_matter) {
  const auto ends = [](bool backwards) {
    World world;
    std::vector<BodyId> chain;
    for (int i = 0; i < 8; ++i) {
      chain.push_back(add_rod(world, {0.5 * i, 0, 0}, {0.5 * (i + 1), 0, 0}, 1 + i % 3));
    }
    for (int k = 0; k < 8; ++k) {
      const int i = backwards ? 7 - k : k;
      world.add_joint(BallJoint{.a = i > 0 ? chain[static_cast<std::size_t>(i) - 1] : BodyId{},
                                .b = chain[static_cast<std::size_t>(i)],
                                .anchor = {0.5 * i, 0, 0}});
    }
    run(world, 1);
    return world.pose(chain.back()).position;
  };
  EXPECT_LT((ends(false) - ends(true)).norm(), 1e-9);
}

// Loops, trees, drives, breaking, contacts.
class JointedScene {
 public:
  explicit JointedScene(World& world) {
    add_floor(world);
    for (int d = 0; d < 6; ++d) add_doll(world, {1.5 * d, 3 + 0.3 * d, 0});
    add_net(world);
  }

 private:
  static void add_doll(World& world, const Vec3& at) {
    const BodyId body = add_box(world, at, {0.2, 0.3, 0.15});
    const JointDrive stiff = {.spring = {.frequency = 1, .damping_ratio = 0.7}, .friction = 2};
    for (const double side : {-1.0, 1.0}) {
      const Vec3 shoulder = at + Vec3(side * 0.25, 0.25, 0);
      const BodyId arm = add_box(world, shoulder + Vec3(side * 0.3, 0, 0), {0.25, 0.06, 0.06});
      world.add_joint(ConeTwistJoint{.a = body,
                                     .b = arm,
                                     .anchor = shoulder,
                                     .axis = {side, 0, 0},
                                     .swing_limit = 1.2,
                                     .lower_twist = -0.5,
                                     .upper_twist = 0.5,
                                     .swing = stiff,
                                     .twist = stiff});
      const Vec3 knee = at + Vec3(side * 0.12, -0.8, 0);
      const BodyId thigh = add_box(world, at + Vec3(side * 0.12, -0.55, 0), {0.08, 0.22, 0.08});
      const BodyId shin = add_box(world, knee - Vec3(0, 0.25, 0), {0.07, 0.22, 0.07});
      world.add_joint(BallJoint{.a = body,
                                .b = thigh,
                                .anchor = at + Vec3(side * 0.12, -0.3, 0),
                                .friction_torque = 3,
                                .breaks = {.force = 4e4}});
      world.add_joint(HingeJoint{.a = thigh,
                                 .b = shin,
                                 .anchor = knee,
                                 .axis = {1, 0, 0},
                                 .lower_angle = -2.2,
                                 .upper_angle = 0.0,
                                 .drive = stiff});
    }
  }
  static void add_net(World& world) {
    std::vector<BodyId> net;
    for (int i = 0; i < 12; ++i) {
      for (int k = 0; k < 12; ++k) {
        const Vec3 at(-12 + k, 8, i);
        net.push_back(add_sphere(world, at, 0.3));
        const auto join = [&](int other, const Vec3& by) {
          world.add_joint(BallJoint{.a = net[net.size() - static_cast<std::size_t>(other) - 1],
                                    .b = net.back(),
                                    .anchor = at + by});
        };
        if (k > 0) join(1, {-0.5, 0, 0});
        if (i > 0) join(12, {0, 0, -0.5});
        if (i == 0) world.add_joint(BallJoint{.b = net.back(), .anchor = at - Vec3(0, 0, 0.5)});
      }
    }
  }
};

std::vector<std::uint64_t> hashes_of(World& world) {
  const JointedScene scene(world);
  std::vector<std::uint64_t> hashes;
  for (int n = 0; n < 120; ++n) {
    world.run_steps(1, kDt);
    hashes.push_back(world.state_hash());
  }
  return hashes;
}
TEST_P(EveryMode, jointed_scenes_give_the_serial_bits) {
  static const std::vector<std::uint64_t> serial = [] {
    World world;
    return hashes_of(world);
  }();
  World world = make_world(GetParam());
  EXPECT_EQ(hashes_of(world), serial);
}
INSTANTIATE_TEST_SUITE_P(Joints, EveryMode, testing::ValuesIn(every_mode()), name_of);

TEST(Joints, a_far_jointed_island_changes_no_bit_of_another) {
  const auto pendulum = [](World& world, double x) {
    const BodyId upper = add_rod(world, {x, 0, 0}, {x + 1, 0, 0}, 1);
    const BodyId lower = add_rod(world, {x + 1, 0, 0}, {x + 2, 0, 0}, 1);
    world.add_joint(BallJoint{.b = upper, .anchor = {x, 0, 0}});
    world.add_joint(BallJoint{.a = upper, .b = lower, .anchor = {x + 1, 0, 0}});
    return lower;
  };
  const auto run_with = [&](bool before, bool after) {
    World world;
    if (before) pendulum(world, 100);
    const BodyId tip = pendulum(world, 0);
    const BodyId box = add_box(world, {30, 0.5, 0});
    add_floor(world);
    if (after) pendulum(world, -100);
    run(world, 2);
    const Pose p = world.pose(tip), q = world.pose(box);
    return std::vector<double>{p.position.x(),    p.position.y(), p.orientation.x(),
                               p.orientation.w(), q.position.y(), q.orientation.x()};
  };
  EXPECT_EQ(run_with(false, false), run_with(true, false));
  EXPECT_EQ(run_with(false, false), run_with(false, true));
}

}  // namespace
}  // namespace skerry::test
