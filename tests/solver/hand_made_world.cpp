#include "tests/solver/hand_made_world.h"

#include "solver/free_flight.h"

namespace skerry::solver {

core::StepContext HandMadeWorld::context() {
  core::StepContext step;
  step.dt = dt;
  step.time = time;
  step.settings = &settings;
  step.bodies = &bodies;
  step.contacts = &contacts;
  step.joints = &joints;
  step.fields = &fields;
  step.islands = &islands;
  step.sleepers = &sleepers;
  step.callback_errors = &errors;
  step.warnings = &warnings;
  return step;
}

core::BodyIndex HandMadeWorld::add(const Body& body) {
  return add(body, body.moments.asDiagonal());
}

core::BodyIndex HandMadeWorld::add(const Body& body, const Mat3& inertia) {
  const core::BodyIndex row = core::take_row(bodies);
  bodies.flags[row] |= body.flags;
  if (inertia.isApprox(Mat3::Identity() * inertia(0, 0))) bodies.flags[row] |= core::kIsotropic;
  core::BodyMass& mass = bodies.mass[row];
  mass.mass = body.mass;
  mass.inv_mass = 1 / body.mass;
  mass.inertia_b = inertia;
  mass.inv_inertia_b = inertia.inverse();
  mass.gravity_scale = body.gravity_scale;
  mass.linear_damping = body.linear_damping;
  mass.angular_damping = body.angular_damping;
  bodies.pose[row] = {body.center, body.orientation.normalized()};
  core::set_motion(bodies, row, body.linear, body.angular);
  bodies.awake_stale = true;
  core::refresh_awake(bodies);
  return row;
}

core::BodyIndex HandMadeWorld::add_fixed(const Vec3& center) {
  const core::BodyIndex row = core::take_row(bodies);
  bodies.pose[row].center = center;
  return row;
}

core::BodyIndex HandMadeWorld::add_kinematic(const Vec3& center, const Vec3& linear,
                                             const Vec3& angular) {
  const core::BodyIndex row = add_fixed(center);
  bodies.flags[row] |= core::kKinematic | core::kAwake;
  core::set_motion(bodies, row, linear, angular);
  return row;
}

void HandMadeWorld::fly(core::BodyIndex body, int steps) {
  for (int i = 0; i < steps; ++i) {
    fly_free(context(), body);
    time += dt;
  }
}

double HandMadeWorld::kinetic_energy(core::BodyIndex body) const {
  const core::BodyMotion& motion = bodies.motion[body];
  return 0.5 * bodies.mass[body].mass * motion.linear.squaredNorm() +
         0.5 * motion.angular_momentum.dot(motion.angular);
}

Vec3 box_moments(double mass, const Vec3& size) {
  const Vec3 s = size.cwiseProduct(size);
  return Vec3(s.y() + s.z(), s.z() + s.x(), s.x() + s.y()) * (mass / 12);
}

}  // namespace skerry::solver
