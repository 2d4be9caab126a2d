// What describes a joint to World::add_joint. Anchors and axes are given in the world frame at the
// bodies' poses of that moment; all coordinates of a joint are zero then, unless said otherwise.
// A body left out (BodyId{}) is the world frame. The joined bodies do not collide unless asked to.
//
//   Units   m, rad, s, N and N m. What is called force here is a torque for angular coordinates.
//   Forces  World::joint_force and joint_torque tell what a joint carries; it breaks beyond
//           JointLoad. docs/joints.md has the types, their coordinates and the maths.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <variant>

#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry {

// Pulls a coordinate to `rest`, as an oscillator of this frequency and damping ratio made of the two
// bodies and the joint alone.
struct JointSpring {
  double frequency = 0;      // Hz; 0: no spring
  double damping_ratio = 1;  // 1: critical
  double rest = 0;           // m or rad
};

// Bounds of a coordinate. With a frequency they are soft: a spring acts beyond them.
struct JointLimits {
  std::optional<double> lower = std::nullopt;  // m or rad
  std::optional<double> upper = std::nullopt;
  double frequency = 0;  // Hz; 0: hard
  double damping_ratio = 1;
};

enum class JointMotorMode : std::uint8_t { off, velocity, position };

struct JointMotor {
  JointMotorMode mode = JointMotorMode::off;
  double target = 0;  // m/s or rad/s; of a position motor m or rad
  double max_force = std::numeric_limits<double>::infinity();  // N or N m
  double frequency = 2;  // Hz, how fast a position motor closes in
  double damping_ratio = 1;
};

// What may happen along one coordinate of a joint.
struct JointDrive {
  JointSpring spring = {};
  JointMotor motor = {};
  double friction = 0;  // N or N m: largest force that resists motion
};

// The mean load over a step beyond which a joint breaks: it is removed and reported by
// World::broken_joints().
struct JointLoad {
  double force = std::numeric_limits<double>::infinity();   // N
  double torque = std::numeric_limits<double>::infinity();  // N m, about b's anchor
};

// The coordinates of a joint: b's anchor and frame seen from a's. Rotation is a swing of the z axis
// followed by a twist about it; swing_x and swing_y are the components of the swing's rotation
// vector, `swing` is its angle, `distance` that between the anchors.
enum class JointCoordinate : std::uint8_t { x, y, z, swing_x, swing_y, twist, distance, swing };

// One common point.
struct BallJoint {
  BodyId a = {}, b = {};
  Vec3 anchor = Vec3::Zero();  // m, world
  double friction_torque = 0;  // N m, resists twist and each swing
  JointLoad breaks = {};
  bool collide = false;
};

// One common point and one common axis; the angle (coordinate twist) is that of b relative to a.
struct HingeJoint {
  BodyId a = {}, b = {};
  Vec3 anchor = Vec3::Zero();                        // m, world
  Vec3 axis = {0, 0, 1};                             // unit, world
  std::optional<double> lower_angle = std::nullopt;  // rad
  std::optional<double> upper_angle = std::nullopt;  // rad
  double limit_frequency = 0;                        // Hz; 0: hard limits
  double limit_damping_ratio = 1;
  JointDrive drive = {};  // rad, N m
  JointLoad breaks = {};
  bool collide = false;
};

// Motion along one axis (coordinate z), no rotation.
struct SliderJoint {
  BodyId a = {}, b = {};
  Vec3 anchor = Vec3::Zero();  // m, world: where loads are measured
  Vec3 axis = {1, 0, 0};       // unit, world; carried along by a
  JointLimits limits = {};     // m
  JointDrive drive = {};       // m, N
  JointLoad breaks = {};
  bool collide = false;
};

// No relative motion.
struct FixedJoint {
  BodyId a = {}, b = {};
  Vec3 anchor = Vec3::Zero();  // m, world: where loads are measured
  JointLoad breaks = {};
  bool collide = false;
};

// Keeps the distance between two anchors within limits: a rod if they are equal, a rope with an upper
// limit alone. The coordinate is the distance itself.
struct DistanceJoint {
  BodyId a = {}, b = {};
  Vec3 anchor_a = Vec3::Zero(), anchor_b = Vec3::Zero();  // m, world
  JointLimits limits = {};                                // m
  JointDrive drive = {};                                  // m, N
  JointLoad breaks = {};
  bool collide = false;
};

// One common point; the axis of b stays within a cone about that of a and twists within limits. A
// shoulder or a neck.
struct ConeTwistJoint {
  BodyId a = {}, b = {};
  Vec3 anchor = Vec3::Zero();                        // m, world
  Vec3 axis = {0, 0, 1};                             // unit, world
  std::optional<double> swing_limit = std::nullopt;  // rad, half angle of the cone
  std::optional<double> lower_twist = std::nullopt;  // rad
  std::optional<double> upper_twist = std::nullopt;  // rad
  double limit_frequency = 0;                        // Hz; 0: hard limits
  double limit_damping_ratio = 1;
  JointDrive swing = {};  // rad, N m: of swing_x and swing_y each; velocity motors turn neither
  JointDrive twist = {};  // rad, N m
  JointLoad breaks = {};
  bool collide = false;
};

enum class JointAxisMode : std::uint8_t { free, locked, limited };

struct JointAxis {
  JointAxisMode mode = JointAxisMode::locked;
  JointLimits limits = {};  // only if limited
  JointDrive drive = {};    // unless locked
};

// Each of six coordinates free, locked or limited.
struct SixDofJoint {
  BodyId a = {}, b = {};
  Vec3 anchor = Vec3::Zero();          // m, world
  Quat frame = Quat::Identity();       // world; its axes are those of the coordinates
  std::array<JointAxis, 6> axes = {};  // x, y, z, swing_x, swing_y, twist
  JointLoad breaks = {};
  bool collide = false;
};

using JointDesc = std::variant<BallJoint, HingeJoint, SliderJoint, FixedJoint, DistanceJoint,
                               ConeTwistJoint, SixDofJoint>;

// A joint that gave way in the last step; its id is stale. In the order of the ids.
struct JointBroken {
  JointId joint;
  BodyId a, b;
  Vec3 force = Vec3::Zero();   // N, world, mean over the step, by a on b
  Vec3 torque = Vec3::Zero();  // N m, world, likewise
};

}  // namespace skerry
