// Directions in which contacts hold a body during a step: along their normals, and about the axes
// across them where several points share a normal. In what is left the body moves smoothly.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/bodies.h"
#include "core/vec.h"

namespace skerry::solver {

class HeldDirections {
 public:
  // Of a contact that pushed; `normal` is a unit vector of either sign.
  void hold(const core::V3f& normal, bool several_points) {
    if (several_points) hold_turns(normal);
    if (count_ > 2 || (count_ > 0 && same(direction_[0], normal))) return;
    core::V3f rest = normal;
    for (std::uint8_t k = 0; k < count_; ++k)
      rest = rest - direction_[k] * core::dot(direction_[k], rest);
    const float squared = core::dot(rest, rest);
    if (squared < kSameDirection) return;
    if (count_ < 2) direction_[count_] = rest * (1 / std::sqrt(squared));
    ++count_;
  }

  // What of a change of velocity, m/s, no contact holds.
  Vec3 free_part(Vec3 change) const {
    if (count_ > 2) return Vec3::Zero();
    for (std::uint8_t k = 0; k < count_; ++k) {
      const Vec3 held = core::to_double(direction_[k]);
      change -= held * held.dot(change);
    }
    return change;
  }

  // Likewise of a change of angular velocity, rad/s.
  Vec3 free_turn(const Vec3& change) const {
    if (turn_ == Turn::any) return change;
    if (turn_ == Turn::none) return Vec3::Zero();
    const Vec3 axis = core::to_double(axis_);
    return axis * axis.dot(change);
  }

 private:
  static constexpr float kSameDirection = 0.01f;  // square of the sine of 6 degrees
  enum class Turn : std::uint8_t { any, about_axis, none };

  static bool same(const core::V3f& a, const core::V3f& b) {
    const float cosine = core::dot(a, b);
    return 1 - cosine * cosine < kSameDirection;
  }

  void hold_turns(const core::V3f& normal) {
    if (turn_ == Turn::any) {
      turn_ = Turn::about_axis;
      axis_ = normal;
    } else if (turn_ == Turn::about_axis && !same(axis_, normal)) {
      turn_ = Turn::none;
    }
  }

  core::V3f direction_[2] = {{0, 0, 0}, {0, 0, 0}};
  core::V3f axis_{0, 0, 0};
  std::uint8_t count_ = 0;
  Turn turn_ = Turn::any;
};

}  // namespace skerry::solver
