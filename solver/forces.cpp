#include "solver/forces.h"

#include <exception>

namespace skerry::solver {
namespace {

// All fields or none: one that throws takes the others with it.
ExternalForce field_force(const core::StepContext& step, const FieldSample& sample) {
  ExternalForce sum;
  try {
    for (const ForceField& field : step.fields->rows) {
      if (!field) continue;
      const FieldForce part = field(sample);
      sum.force += part.force;
      sum.torque += part.torque;
    }
  } catch (...) {
    step.callback_errors->keep(sample.body.index, std::current_exception());
    return {};
  }
  return sum;
}

void clear_locked(ExternalForce& force, std::uint32_t flags) {
  if (!(flags & core::kLockMask)) return;
  for (int axis = 0; axis < 3; ++axis) {
    if (flags & (core::kLockX << axis)) force.force[axis] = 0;
    if (flags & (core::kLockRx << axis)) force.torque[axis] = 0;
  }
}

}  // namespace

bool forces_vary(const core::StepContext& step) {
  if (!step.fields) return false;
  for (const ForceField& field : step.fields->rows)
    if (field) return true;
  return false;
}

ExternalForce external_force(const core::StepContext& step, core::BodyIndex body, double t,
                             const Vec3& r, const Vec3& v, const Vec3& w) {
  const core::Bodies& bodies = *step.bodies;
  const core::BodyMass& mass = bodies.mass[body];
  ExternalForce sum;
  if (bodies.flags[body] & core::kForced) {
    sum.force = bodies.force[body].force;
    sum.torque = bodies.force[body].torque;
  }
  sum.force += step.settings->gravity * (mass.mass * mass.gravity_scale);
  if (forces_vary(step)) {
    const ExternalForce fields = field_force(step, {.body = bodies.id(body),
                                                    .time = t,
                                                    .position = r,
                                                    .velocity = v,
                                                    .angular_velocity = w,
                                                    .mass = mass.mass});
    sum.force += fields.force;
    sum.torque += fields.torque;
  }
  clear_locked(sum, bodies.flags[body]);
  return sum;
}

}  // namespace skerry::solver
