// Tells what contacts did in a step, if somebody asked (core/contact_effects.h).
#pragma once

#include "core/step_context.h"
#include "solver/contact_side.h"

namespace skerry::solver {

// Energy that contacts took from one body. Constructed before the body gets its new state, finished
// after; touches that body's data only.
class EffectWatch {
 public:
  EffectWatch(const core::StepContext& step, core::BodyIndex body);
  bool on() const { return step_.effects != nullptr; }  // else nothing here does anything
  const core::BodyMotion& before() const { return motion_; }

  // `impulse` (N s) and `angular_impulse` (N m s, about the centre of mass) by contacts; world.
  // Of a body that contacts and constant external forces alone moved, the energy lost is what its
  // balance lacks: energy before, and work of force and torque, less energy after.
  void finish_balanced(const Vec3& impulse, const Vec3& angular_impulse,
                       const Vec3& external_impulse, const Vec3& external_angular_impulse);
  // Of one that joints or damping slow too, it is the impulses' work at its mean velocity.
  void finish(const Vec3& impulse, const Vec3& angular_impulse);

 private:
  const core::StepContext& step_;
  core::BodyIndex body_;
  core::BodyMotion motion_;
  Vec3 center_ = Vec3::Zero();
};

// Natural map of the contact law of manifold `contact` (Alart and Curnier 1991, "A mixed formulation
// for frictional contact problems prone to Newton like solution methods"): how far an impulse is from
// where the law would put it, given the velocities after the solve. `offset`: centre of b from centre of a when the
// contact was found, m; `gap`: separation of the points after the step, m; impulses act for `h` s.
// A manifold that bounced obeys the law of impact instead and counts as exact.
core::ContactResidual contact_residual(const core::StepContext& step, const core::Manifold& contact,
                                       const Vec3& offset, const ContactSide& a,
                                       const ContactSide& b, const double gap[4], double h);

}  // namespace skerry::solver
