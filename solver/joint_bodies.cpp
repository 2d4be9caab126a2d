#include "solver/joint_bodies.h"

#include <algorithm>

namespace skerry::solver {
namespace {

Sym3d symmetric(const Mat3& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
}
core::V3f to_float(const V3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
// What a float row gained on the double it was rounded from; exactly zero if nothing.
V3d gain(const core::V3f& now, const V3d& from) {
  const core::V3f was = to_float(from);
  return {double(now.x) - double(was.x), double(now.y) - double(was.y),
          double(now.z) - double(was.z)};
}
// I w, w in world axes.
V3d momentum(const Sym3d& inertia_b, const Q4d& orientation, const V3d& angular) {
  return rotate(orientation, inertia_b * rotate(conjugate(orientation), angular));
}

}  // namespace

void JointBodies::begin(std::uint32_t rows, std::uint32_t dynamic_end) {
  if (bodies_.size() < rows) {
    bodies_.resize(rows);
    moves_.resize(rows);
  }
  for (std::uint32_t row = 0; row < rows; ++row) moves_[row].owned = moves_[row].smooth = false;
  bodies_[0] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0, 0, 0, 0}, {{0, 0, 0}, {0, 0, 0, 1}}};
  dynamic_end_ = dynamic_end;
  any_smooth_ = false;
}

void JointBodies::own(std::uint32_t first, std::uint32_t count, bool smooth) {
  for (std::uint32_t row = first; row < first + count; ++row) {
    moves_[row].owned = true;
    moves_[row].smooth = smooth;
  }
  any_smooth_ = any_smooth_ || smooth;
}

void JointBodies::gather(const core::StepContext& step, std::uint32_t row, core::BodyIndex index,
                         const ExternalForce& force) {
  const core::Bodies& bodies = *step.bodies;
  const core::BodyMass& mass = bodies.mass[index];
  const core::BodyPose& pose = bodies.pose[index];
  const core::BodyMotion& motion = bodies.motion[index];
  const std::uint32_t flags = bodies.flags[index];
  const double m = mass.inv_mass;
  JointBody& body = bodies_[row];
  body.linear = scalars(motion.linear);
  body.angular = scalars(motion.angular);
  body.inv_mass = {flags & core::kLockX ? 0 : m, flags & core::kLockY ? 0 : m,
                   flags & core::kLockZ ? 0 : m};
  body.pose = {scalars(pose.center), scalars(pose.orientation)};
  body.inv_inertia = symmetric(core::inv_inertia_w(mass, pose.orientation, flags));
  Move& move = moves_[row];
  move.inertia_b = symmetric(mass.inertia_b);
  move.inv_inertia_b = symmetric(mass.inv_inertia_b);
  move.acceleration = scalars(Vec3(force.force * m));
  move.torque = scalars(force.torque);
  move.linear_damping = mass.linear_damping;
  move.angular_damping = mass.angular_damping;
  move.start = body.pose;
  move.locks = flags & (core::kLockRx | core::kLockRy | core::kLockRz);
  move.isotropic = (flags & core::kIsotropic) != 0;
  move.spins = !move.isotropic && move.locks == 0;
  move.mass = &mass;
}

void JointBodies::gather_kinematic(std::uint32_t row, const JointPose& pose, const V3d& linear,
                                   const V3d& angular) {
  bodies_[row] = {linear, angular, {0, 0, 0}, {0, 0, 0, 0, 0, 0}, pose};
  moves_[row] = {};
  moves_[row].owned = true;
  moves_[row].isotropic = true;
  moves_[row].start = pose;
}

void JointBodies::absorb(std::uint32_t row) {
  JointBody& body = bodies_[row];
  body.linear = body.linear + gain(velocity_[row].linear, body.linear);
  body.angular = body.angular + gain(velocity_[row].angular, body.angular);
}

void JointBodies::publish(std::uint32_t row) {
  velocity_[row].linear = to_float(bodies_[row].linear);
  velocity_[row].angular = to_float(bodies_[row].angular);
}

void JointBodies::publish_velocities(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = begin; row < end; ++row) {
    if (moves_[row].owned) publish(row);
  }
}

void JointBodies::kick(std::uint32_t begin, std::uint32_t end, double h, double fraction,
                       bool only_smooth) {
  for (std::uint32_t row = std::max(begin, 1u); row < std::min(end, dynamic_end_); ++row) {
    const Move& move = moves_[row];
    if (!move.owned || (only_smooth && !move.smooth)) continue;
    absorb(row);
    JointBody& body = bodies_[row];
    const double dt = move.smooth ? h * fraction : h;
    body.linear = (body.linear + move.acceleration * dt) * (1 / (1 + dt * move.linear_damping));
    body.angular = (body.angular + body.inv_inertia * (move.torque * dt)) *
                   (1 / (1 + dt * move.angular_damping));
    publish(row);
  }
}

void JointBodies::turn(JointBody& body, const Move& move, double h) {
  Q4d& q = body.pose.orientation;
  if (!move.spins) {
    q = turned(q, body.angular * h);
    if (move.isotropic && move.locks == 0) return;
    if (move.locks != 0) {
      body.inv_inertia = symmetric(
          core::inv_inertia_w(*move.mass, Quat(q.w, q.x, q.y, q.z), move.locks));
    }
    return;
  }
  const V3d spin = momentum(move.inertia_b, q, body.angular);
  const auto velocity = [&](const Q4d& at) { return momentum(move.inv_inertia_b, at, spin); };
  const V3d middle = velocity(turned(q, body.angular * (0.5 * h)));
  q = turned(q, middle * h);
  body.inv_inertia = rotated(move.inv_inertia_b, core::to_matrix(q));
  body.angular = body.inv_inertia * spin;
}

void JointBodies::drift(std::uint32_t begin, std::uint32_t end, double h) {
  for (std::uint32_t row = std::max(begin, 1u); row < end; ++row) {
    const Move& move = moves_[row];
    if (!move.owned) continue;
    if (solved(row)) absorb(row);
    JointBody& body = bodies_[row];
    body.pose.center = body.pose.center + body.linear * h;
    turn(body, move, h);
    delta_[row].translation = to_float(body.pose.center - move.start.center);
    const Q4d turn = body.pose.orientation * conjugate(move.start.orientation);
    delta_[row].rotation = {static_cast<float>(turn.x), static_cast<float>(turn.y),
                            static_cast<float>(turn.z), static_cast<float>(turn.w)};
    publish(row);
  }
}

void JointBodies::result(const core::Bodies& bodies, std::uint32_t row, core::BodyIndex index,
                         core::BodyPose& pose, core::BodyMotion& motion) {
  absorb(row);
  const JointBody& body = bodies_[row];
  const Q4d& q = body.pose.orientation;
  pose = {vector(body.pose.center), Quat(q.w, q.x, q.y, q.z)};
  motion.linear = vector(body.linear);
  motion.angular = vector(body.angular);
  const Move& move = moves_[row];
  if (move.locks != 0) {
    motion.angular_momentum =
        core::inertia_w(bodies.mass[index], pose.orientation) * motion.angular;
  } else {
    motion.angular_momentum = vector(momentum(move.inertia_b, q, body.angular));
  }
}

}  // namespace skerry::solver
