#include "solver/effect_watch.h"

#include <algorithm>
#include <cmath>

namespace skerry::solver {

using namespace core;

EffectWatch::EffectWatch(const StepContext& step, BodyIndex body) : step_(step), body_(body) {
  if (!on()) return;
  motion_ = step.bodies->motion[body];
  center_ = step.bodies->pose[body].center;
}

void EffectWatch::finish_balanced(const Vec3& impulse, const Vec3& angular_impulse,
                                  const Vec3& external_impulse,
                                  const Vec3& external_angular_impulse) {
  if (!on()) return;
  const BodyMotion& after = step_.bodies->motion[body_];
  const double mass = step_.bodies->mass[body_].mass;
  const double work = external_impulse.dot(step_.bodies->pose[body_].center - center_) / step_.dt +
                      0.5 * external_angular_impulse.dot(motion_.angular + after.angular);
  finish(impulse, angular_impulse);
  step_.effects->bodies[body_].energy_lost =
      kinetic_energy(motion_, mass) + work - kinetic_energy(after, mass);
}

void EffectWatch::finish(const Vec3& impulse, const Vec3& angular_impulse) {
  if (!on()) return;
  const BodyMotion& after = step_.bodies->motion[body_];
  BodyEffect& effect = step_.effects->bodies[body_];
  effect.impulse = impulse;
  effect.energy_lost = -0.5 * (impulse.dot(motion_.linear + after.linear) +
                               angular_impulse.dot(motion_.angular + after.angular));
}

ContactResidual contact_residual(const StepContext& step, const Manifold& contact,
                                 const Vec3& offset, const ContactSide& a, const ContactSide& b,
                                 const double gap[4], double h) {
  ContactResidual residual;
  residual.total_impulse = double(contact.total_impulse);
  const bool bounced = contact.restitution > 0 &&
                       double(contact.approach_speed) > step.settings->solver.restitution_threshold;
  const Vec3 n = to_double(contact.normal);
  Vec3 center = Vec3::Zero();
  for (std::uint32_t i = 0; i < contact.point_count; ++i) {
    const Vec3 arm_a = to_double(contact.points[i].position), arm_b = arm_a - offset;
    const auto impulse = double(contact.normal_impulse[i]);
    center += arm_a;
    residual.normal_impulse += impulse;
    residual.pull = std::max(residual.pull, -impulse);
    const double inverse = response(a, arm_a, n, n) + response(b, arm_b, n, n);
    const double speed = n.dot(relative_velocity(a, b, arm_a, arm_b)) + std::max(gap[i], 0.0) / h;
    residual.normal += std::abs(std::min(impulse, inverse_or_zero(inverse) * speed));
  }
  const Vec3 friction = to_double(contact.friction_impulse);
  const double limit = double(contact.friction) * residual.normal_impulse;
  residual.cone = std::max(0.0, friction.norm() - limit);
  if (bounced || residual.normal_impulse <= 0) {
    residual.normal = 0;
    return residual;
  }
  center /= contact.point_count;
  const Vec3 arm_b = center - offset;
  const Vec3 v = relative_velocity(a, b, center, arm_b);
  const Vec3 slip = v - n * n.dot(v);
  if (const double speed = slip.norm(); speed > 0) {
    const Vec3 along = slip / speed;
    const double inverse = response(a, center, along, along) + response(b, arm_b, along, along);
    const Vec3 target = friction - slip * inverse_or_zero(inverse);
    const double size = target.norm();
    const Vec3 in_disc = size > limit ? Vec3(target * (limit / size)) : target;
    residual.friction = (friction - in_disc).norm();
  }
  return residual;
}

}  // namespace skerry::solver
