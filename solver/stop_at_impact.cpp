#include "solver/stop_at_impact.h"

#include <algorithm>
#include <cmath>

#include "core/trig.h"
#include "solver/fast_watch.h"
#include "solver/free_flight.h"
#include "solver/rotation.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;
using core::StepContext;

void fly_again(const StepContext& step, BodyIndex body, double part) {
  core::Bodies& bodies = *step.bodies;
  const core::FastStart& start = step.fast->start[body];
  bodies.pose[body] = start.pose;
  bodies.motion[body] = start.motion;
  if (!(part * step.dt > 0)) return;
  StepContext shorter = step;
  shorter.dt = part * step.dt;
  core::add_force(bodies, body, start.force.force, start.force.torque);
  fly_free(shorter, body);
  bodies.force[body] = {};
  bodies.flags[body] &= ~std::uint32_t{core::kForced};
}

// The orientation at a time between two.
Quat between(const Quat& from, const Quat& to, double part) {
  Quat turn = to * from.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  if (sine == 0) return from;
  return turned(from, turn.vec() * (part * 2 * core::trig::atan2(sine, turn.w()) / sine));
}

void go_back(const StepContext& step, BodyIndex body, double part) {
  core::Bodies& bodies = *step.bodies;
  const core::FastStart& start = step.fast->start[body];
  core::BodyPose& pose = bodies.pose[body];
  core::BodyMotion& motion = bodies.motion[body];
  const core::BodyMass& mass = bodies.mass[body];
  const std::uint32_t flags = bodies.flags[body];
  const double before = kinetic_energy(motion, mass.mass);
  const Vec3 way = pose.center - start.pose.center;
  const Vec3 lost = (1 - part) * way;
  pose.center = start.pose.center + part * way;
  pose.orientation = start.knots.empty() ? between(start.pose.orientation, pose.orientation, part)
                                         : pushed_orientation(step, body, start, part * step.dt);
  const double squared = motion.linear.squaredNorm();
  const Vec3 gravity = mass.gravity_scale * step.settings->gravity;
  if (squared > 0) {
    motion.linear *= std::sqrt(std::max(0.0, 1 - 2 * gravity.dot(lost) / squared));
  }
  motion.angular = angular_velocity(mass, flags, pose.orientation, motion.angular_momentum);
  if (step.effects) {
    step.effects->bodies[body].energy_lost +=
        before - kinetic_energy(motion, mass.mass) - mass.mass * gravity.dot(lost);
  }
}

}  // namespace

void stop_at_impact(const StepContext& step, BodyIndex body) {
  const double part = step.fast->part[body];
  if (step.fast->start[body].flight == core::FastFlight::free)
    fly_again(step, body, part);
  else
    go_back(step, body, part);
}

}  // namespace skerry::solver
