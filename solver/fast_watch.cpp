#include "solver/fast_watch.h"

#include <algorithm>
#include <cmath>

#include "solver/rotation.h"

namespace skerry::solver {
namespace {

constexpr int kMostKnots = 31;

}  // namespace

FastWatch::FastWatch(const core::StepContext& step, core::BodyIndex body)
    : step_(step), body_(body) {
  const std::uint32_t flags = step.bodies->flags[body];
  joined_ = step.settings->continuous && step.bodies->lock_joints[body] > 0;
  watched_ = ((flags & core::kContinuous) || joined_) && !(flags & core::kQuarantined);
  if (!watched_) return;
  pose_ = step.bodies->pose[body];
  motion_ = step.bodies->motion[body];
}

// By what it was going to do, or by what it did. Most bodies are told slow without a root:
// (x + y)^2 <= 2 (x^2 + y^2).
bool FastWatch::is_fast() const {
  const core::BodyMass& mass = step_.bodies->mass[body_];
  const double safe = core::safe_motion(mass), radius = double(mass.turn_radius);
  const core::BodyPose& end = step_.bodies->pose[body_];
  const Quat turn = end.orientation * pose_.orientation.conjugate();
  const double way = (end.center - pose_.center).squaredNorm();
  const double turned = 4 * turn.vec().squaredNorm() * (radius * radius);
  const double ahead =
      motion_.linear.squaredNorm() + motion_.angular.squaredNorm() * (radius * radius);
  const double square = 0.5 * safe * safe;
  if (ahead * (step_.dt * step_.dt) <= square && way + turned <= square) return false;
  return core::motion_of(mass, motion_, step_.dt) > safe ||
         std::sqrt(way) + std::sqrt(turned) > safe;
}

void FastWatch::note_turn(core::FastStart& start, double impact) const {
  core::Bodies& bodies = *step_.bodies;
  const core::BodyMass& mass = bodies.mass[body_];
  core::BodyMotion& motion = bodies.motion[body_];
  start.knots.clear();
  start.angle = step_.dt * std::max(motion_.angular.norm(), motion.angular.norm());
  if (start.flight == core::FastFlight::joined || start.angle <= kLargeTurn) return;
  if (mass.turn_radius == 0) return;
  const std::uint32_t flags = bodies.flags[body_];
  const bool free = start.flight == core::FastFlight::free;
  const Vec3& momentum = motion_.angular_momentum;
  const Vec3 torque = (motion.angular_momentum - momentum) / step_.dt;
  const auto orientation_at = [&](double t) {
    if (!free) return pushed_orientation(step_, body_, start, t * step_.dt);
    return orientation_after(t * step_.dt, mass, flags, pose_.orientation, momentum, torque);
  };
  const int count = std::min(kMostKnots, static_cast<int>(std::min(1e3, start.angle / kLargeTurn)));
  for (int k = 1; k <= count; ++k) start.knots.push_back(orientation_at(double(k) / (count + 1)));
  if (free || impact >= 0) return;
  bodies.pose[body_].orientation = orientation_at(1);
  motion.angular =
      angular_velocity(mass, flags, bodies.pose[body_].orientation, motion.angular_momentum);
}

void FastWatch::finish(core::FastFlight flight, double impact) {
  if (!watched_) return;
  std::uint32_t& flags = step_.bodies->flags[body_];
  flags &= ~std::uint32_t{core::kFast};
  if (flags & core::kQuarantined) return;
  const bool fast = (flags & core::kContinuous) && is_fast();
  if (fast) flags |= core::kFast;
  if (!fast && !joined_) return;
  core::FastStart& start = step_.fast->start[body_];
  start.pose = pose_;
  start.motion = motion_;
  start.force = flags & core::kForced ? step_.bodies->force[body_] : core::BodyForce{};
  start.flight = flight;
  start.impact = impact;
  if (fast) note_turn(start, impact);
}

Quat pushed_orientation(const core::StepContext& step, core::BodyIndex body,
                        const core::FastStart& start, double time) {
  const core::BodyMass& mass = step.bodies->mass[body];
  const std::uint32_t flags = step.bodies->flags[body];
  const double before = std::min(time, std::max(start.impact, 0.0));
  Quat q = start.pose.orientation;
  if (before > 0)
    q = orientation_after(before, mass, flags, q, start.motion.angular_momentum, Vec3::Zero());
  return orientation_after(time - before, mass, flags, q,
                           step.bodies->motion[body].angular_momentum, Vec3::Zero());
}

}  // namespace skerry::solver
