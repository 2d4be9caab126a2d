// Joint rows. Every type is made of the same parts: coordinates of b's joint frame seen from a's, each
// free, locked, or an axis with spring, motor, friction and limits.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <skerry/joints.h>

#include "core/bodies.h"
#include "core/vec.h"

namespace skerry::core {

// What acts along an axis, in the order in which it is solved.
enum JointLaw : std::uint8_t { kSpring, kMotor, kFriction, kLower, kUpper, kJointLaws };

struct DrivenAxis {
  JointCoordinate coordinate = JointCoordinate::twist;
  JointLimits limits;
  JointDrive drive;
  std::array<double, kJointLaws> impulse = {};  // N s or N m s of the last substep: warm start
};

struct Joint {
  bool alive = false;
  bool collide = false;
  bool broken = false;  // carried more than it can in this step
  std::uint8_t lock_count = 0;
  BodyIndex a = kNone, b = kNone;  // kNone: the world frame
  std::uint32_t generation = 0;
  std::array<JointCoordinate, 6> locks = {};  // coordinates held at zero; a distance at `length`
  double length = 0;                          // m
  Vec3 anchor_a = Vec3::Zero(), anchor_b = Vec3::Zero();  // m, from the centre of mass, body axes
  Quat frame_a = Quat::Identity(), frame_b = Quat::Identity();  // joint frame in body axes
  JointLoad breaks;
  std::vector<DrivenAxis> axes;  // by ascending coordinate

  std::array<double, 6> impulse = {};  // of the locks, N s or N m s of the last substep
  Vec3 force = Vec3::Zero();           // N, world, mean over the last step, on b
  Vec3 torque = Vec3::Zero();          // N m, world, likewise, about b's anchor
};

struct Joints {
  std::vector<Joint> rows;
  std::vector<std::uint32_t> free_rows;  // sorted descending
  // Ascending (min body, max body) keys of joined pairs that must not collide; with duplicates.
  std::vector<std::uint64_t> no_collide;
  std::uint32_t breakable = 0;  // joints with a finite JointLoad
};

}  // namespace skerry::core
