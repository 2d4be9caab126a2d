// What describes a joint to World::add_joint. Anchors and axes are given in the world frame at the
// bodies' poses of that moment. The joined bodies do not collide unless asked to.
#pragma once

#include <limits>
#include <optional>
#include <variant>

#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry {

// One common point.
struct BallJoint {
  BodyId a, b;
  Vec3 anchor = Vec3::Zero();  // m, world
  bool collide = false;
};

// One common point and one common axis; the angle is that of b relative to a about the axis, zero
// at creation.
struct HingeJoint {
  BodyId a, b;
  Vec3 anchor = Vec3::Zero();                        // m, world
  Vec3 axis = {0, 0, 1};                             // unit, world
  std::optional<double> lower_angle = std::nullopt;  // rad
  std::optional<double> upper_angle = std::nullopt;  // rad
  double motor_speed = 0;                            // rad/s
  double motor_max_torque = 0;                       // N m; 0: no motor
  bool collide = false;
};

using JointDesc = std::variant<BallJoint, HingeJoint>;

}  // namespace skerry
