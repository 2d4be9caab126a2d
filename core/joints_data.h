// Joint rows.
#pragma once

#include <cstdint>
#include <vector>

#include "core/bodies.h"
#include "core/vec.h"

namespace skerry::core {

enum class JointType : std::uint8_t { ball, hinge };

struct Joint {
  JointType type = JointType::ball;
  bool alive = false;
  bool collide = false;
  bool has_lower = false, has_upper = false;
  BodyIndex a = kNone, b = kNone;
  std::uint32_t generation = 0;
  Vec3 anchor_a = Vec3::Zero(), anchor_b = Vec3::Zero();  // m, from the centre of mass, body axes
  Quat frame_a = Quat::Identity(),
       frame_b = Quat::Identity();  // joint frame in body axes, axis = z
  double lower = 0, upper = 0;      // rad
  double motor_speed = 0;           // rad/s
  double motor_max_torque = 0;      // N m
  // Warm start: N s and N m s of the last substep.
  V3f linear_impulse{0, 0, 0};
  float angular_impulse[3] = {0, 0, 0};  // two swing axes, then motor
  float lower_impulse = 0, upper_impulse = 0;
};

struct Joints {
  std::vector<Joint> rows;
  std::vector<std::uint32_t> free_rows;  // sorted descending
  // Ascending (min body, max body) keys of joined pairs that must not collide; with duplicates.
  std::vector<std::uint64_t> no_collide;
};

}  // namespace skerry::core
