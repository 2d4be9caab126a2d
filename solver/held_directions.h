// Directions in which contacts hold a body during a step: along their normals, and about the axes
// across them where several points share a normal. In what is left the body moves smoothly.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/bodies.h"

namespace skerry::solver {

class HeldDirections {
 public:
  // Of a contact that pushed; `normal` is a unit vector of either sign.
  void hold(const Vec3& normal, bool several_points) {
    if (several_points) hold_turns(normal);
    Vec3 rest = normal;
    for (std::uint8_t k = 0; k < count_ && k < 2; ++k)
      rest -= direction_[k] * direction_[k].dot(rest);
    const double squared = rest.squaredNorm();
    if (count_ > 2 || squared < kSameDirection) return;
    if (count_ < 2) direction_[count_] = rest / std::sqrt(squared);
    ++count_;
  }

  // What of a change of velocity, m/s, no contact holds.
  Vec3 free_part(Vec3 change) const {
    if (count_ > 2) return Vec3::Zero();
    for (std::uint8_t k = 0; k < count_; ++k) change -= direction_[k] * direction_[k].dot(change);
    return change;
  }

  // Likewise of a change of angular velocity, rad/s.
  Vec3 free_turn(const Vec3& change) const {
    if (turn_ == Turn::any) return change;
    return turn_ == Turn::about_axis ? Vec3(axis_ * axis_.dot(change)) : Vec3(Vec3::Zero());
  }

 private:
  static constexpr double kSameDirection = 0.01;  // square of the sine of 6 degrees
  enum class Turn : std::uint8_t { any, about_axis, none };

  void hold_turns(const Vec3& normal) {
    if (turn_ == Turn::any) {
      turn_ = Turn::about_axis;
      axis_ = normal;
    } else if (turn_ == Turn::about_axis && axis_.cross(normal).squaredNorm() > kSameDirection) {
      turn_ = Turn::none;
    }
  }

  Vec3 direction_[2] = {Vec3::Zero(), Vec3::Zero()};
  Vec3 axis_ = Vec3::Zero();
  std::uint8_t count_ = 0;
  Turn turn_ = Turn::any;
};

}  // namespace skerry::solver
