#include "solver/free_flight.h"

#include <cmath>

#include "solver/forces.h"
#include "solver/rotation.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;
using core::BodyMotion;
using core::BodyPose;
using core::StepContext;

struct Point {
  Vec3 r, v;
};

// Functions of damping c over a time h, z = c h:
//   decay = e^-z      first = (1 - e^-z) / z      second = (z - 1 + e^-z) / z^2
// so that with constant a: v = v0 decay + a h first, r = r0 + v0 h first + a h^2 second.
struct Decay {
  double decay = 1, first = 1, second = 0.5;
};

Decay decay_over(double z) {
  if (!(z > 0)) return {};
  int doublings = 0;
  double small = z;
  while (small > 1 && doublings < 64) {
    small *= 0.5;
    ++doublings;
  }
  double second = 0;  // sum of (-z)^k / (k + 2)!
  for (int k = 18; k >= 0; --k) second = (1 - small * second) / (k + 2);
  double first = 1 - small * second;
  double decay = 1 - small * first;
  if (doublings > 0) {
    for (int i = 0; i < doublings; ++i) decay *= decay;
    first = (1 - decay) / z;
    second = (1 - first) / z;
  }
  return {decay, first, second};
}

// One body's flight over one step.
class Flight {
 public:
  Flight(const StepContext& step, BodyIndex body)
      : step_(step),
        mass_(step.bodies->mass[body]),
        flags_(step.bodies->flags[body]),
        body_(body),
        pose_(step.bodies->pose[body]),
        motion_(step.bodies->motion[body]),
        varying_(forces_vary(step)) {}

  void fly() {
    drop_locked(motion_.linear, core::kLockX);
    drop_locked(motion_.angular_momentum, core::kLockRx);
    now_ = external_force(step_, body_, step_.time, pose_.center, motion_.linear, motion_.angular);
    mean_torque_ = now_.torque;
    fly_center();
    fly_orientation();
  }

  // False if any number has stopped being one.
  bool finite() const {
    return pose_.center.allFinite() && pose_.orientation.coeffs().allFinite() &&
           motion_.linear.allFinite() && motion_.angular.allFinite() &&
           motion_.angular_momentum.allFinite();
  }

  void store() const {
    step_.bodies->pose[body_] = pose_;
    step_.bodies->motion[body_] = motion_;
  }

 private:
  void drop_locked(Vec3& v, std::uint32_t first_lock) const {
    if (!(flags_ & core::kLockMask)) return;
    for (int axis = 0; axis < 3; ++axis)
      if (flags_ & (first_lock << axis)) v[axis] = 0;
  }

  void fly_center() {
    const Integrator integrator = step_.settings->integrator;
    if (integrator == Integrator::exact && !varying_) {
      parabola();
      return;
    }
    // Damping as a factor before and after: second order whatever the integrator (Strang splitting).
    const double half_decay = decay_over(0.5 * mass_.linear_damping * step_.dt).decay;
    Point p = {pose_.center, motion_.linear * half_decay};
    switch (integrator) {
      case Integrator::explicit_euler:
        p = explicit_euler(p);
        break;
      case Integrator::semi_implicit_euler:
        p = semi_implicit_euler(p);
        break;
      case Integrator::velocity_verlet:
        p = velocity_verlet(p);
        break;
      case Integrator::rk4:
      case Integrator::exact:
        p = rk4(p);
        break;
    }
    pose_.center = p.r;
    motion_.linear = p.v * half_decay;
  }

  void parabola() {
    const double h = step_.dt;
    const Vec3 a = now_.force * mass_.inv_mass;
    const Decay d = decay_over(mass_.linear_damping * h);
    pose_.center += motion_.linear * (h * d.first) + a * (h * h * d.second);
    motion_.linear = motion_.linear * d.decay + a * (h * d.first);
  }

  Point explicit_euler(const Point& p) const {
    const double h = step_.dt;
    return {p.r + p.v * h, p.v + now_.force * (mass_.inv_mass * h)};
  }

  Point semi_implicit_euler(const Point& p) const {
    const double h = step_.dt;
    const Vec3 v = p.v + now_.force * (mass_.inv_mass * h);
    return {p.r + v * h, v};
  }

  // A force that depends on the velocity sees the predicted one at the end, which keeps the order.
  Point velocity_verlet(const Point& p) {
    const double h = step_.dt;
    const Vec3 a = now_.force * mass_.inv_mass;
    const Vec3 r = p.r + p.v * h + a * (0.5 * h * h);
    const ExternalForce end = force_at(h, {r, p.v + a * h}, now_.torque);
    mean_torque_ = (now_.torque + end.torque) * 0.5;
    return {r, p.v + (a + end.force * mass_.inv_mass) * (0.5 * h)};
  }

  Point rk4(const Point& p) {
    const double h = step_.dt, half = 0.5 * h;
    const Vec3 v1 = p.v, a1 = now_.force * mass_.inv_mass;
    const Vec3 v2 = p.v + a1 * half;
    const ExternalForce f2 = force_at(half, {p.r + v1 * half, v2}, now_.torque);
    const Vec3 a2 = f2.force * mass_.inv_mass;
    const Vec3 v3 = p.v + a2 * half;
    const ExternalForce f3 = force_at(half, {p.r + v2 * half, v3}, f2.torque);
    const Vec3 a3 = f3.force * mass_.inv_mass;
    const Vec3 v4 = p.v + a3 * h;
    const ExternalForce f4 = force_at(h, {p.r + v3 * h, v4}, f3.torque);
    const Vec3 a4 = f4.force * mass_.inv_mass;
    mean_torque_ = (now_.torque + (f2.torque + f3.torque) * 2 + f4.torque) / 6;
    return {p.r + (v1 + (v2 + v3) * 2 + v4) * (h / 6), p.v + (a1 + (a2 + a3) * 2 + a4) * (h / 6)};
  }

  // The force at a later stage; the body has turned under `torque` until then.
  ExternalForce force_at(double after, const Point& p, const Vec3& torque) const {
    if (!varying_) return now_;
    const Vec3 momentum = motion_.angular_momentum + torque * after;
    const Quat orientation = orientation_after(after, mass_, flags_, pose_.orientation,
                                               motion_.angular_momentum, torque);
    const Vec3 omega = solver::angular_velocity(mass_, flags_, orientation, momentum);
    return external_force(step_, body_, step_.time + after, p.r, p.v, omega);
  }

  // Damping scales L by e^-ct; the path of the orientation is the undamped one, run through in the
  // time (1 - e^-ct)/c instead of t. Exact without torque, second order with.
  void fly_orientation() {
    const double h = step_.dt;
    Vec3& momentum = motion_.angular_momentum;
    const Decay d = decay_over(mass_.angular_damping * h);
    pose_.orientation =
        orientation_after(h * d.first, mass_, flags_, pose_.orientation, momentum, mean_torque_);
    if (mass_.angular_damping > 0) momentum *= d.decay;
    if (!mean_torque_.isZero(0)) momentum += mean_torque_ * (h * d.first);
    motion_.angular = solver::angular_velocity(mass_, flags_, pose_.orientation, momentum);
  }

  const StepContext& step_;
  const core::BodyMass& mass_;
  const std::uint32_t flags_;
  const BodyIndex body_;
  BodyPose pose_;
  BodyMotion motion_;
  const bool varying_;
  ExternalForce now_;  // at the start of the step
  Vec3 mean_torque_;   // over the step, as the integrator weighs its stages
};

void quarantine(core::Bodies& bodies, BodyIndex body) {
  bodies.motion[body] = {};
  bodies.flags[body] |= core::kQuarantined;
}

void fly_kinematic(const StepContext& step, BodyIndex body) {
  core::Bodies& bodies = *step.bodies;
  const BodyMotion& motion = bodies.motion[body];
  BodyPose pose = bodies.pose[body];
  pose.center += motion.linear * step.dt;
  if (!motion.angular.isZero(0))
    pose.orientation = turned(pose.orientation, motion.angular * step.dt);
  if (pose.center.allFinite() && pose.orientation.coeffs().allFinite())
    bodies.pose[body] = pose;
  else
    quarantine(bodies, body);
}

}  // namespace

void fly_free(const StepContext& step, BodyIndex body) {
  core::Bodies& bodies = *step.bodies;
  if (bodies.flags[body] & core::kQuarantined) return;
  if (bodies.flags[body] & core::kKinematic) {
    fly_kinematic(step, body);
    return;
  }
  Flight flight(step, body);
  flight.fly();
  if (flight.finite())
    flight.store();
  else
    quarantine(bodies, body);
}

}  // namespace skerry::solver
