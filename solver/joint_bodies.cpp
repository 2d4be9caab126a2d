#include "solver/joint_bodies.h"
#include "core/rounding.h"

#include <algorithm>

namespace skerry::solver {
namespace {

Sym3d symmetric(const Mat3& m) { return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)}; }
core::V3f to_float(const V3d& v) {
  return {core::rounded_to_float(v.x), core::rounded_to_float(v.y), core::rounded_to_float(v.z)};
}
// What a float row gained since it was written; exactly zero if nothing.
V3d gain(const core::V3f& now, const core::V3f& was) {
  return {double(now.x) - double(was.x), double(now.y) - double(was.y),
          double(now.z) - double(was.z)};
}
// I w, w in world axes.
V3d momentum(const Sym3d& inertia_b, const Q4d& orientation, const V3d& angular) {
  return rotate(orientation, inertia_b * rotate(conjugate(orientation), angular));
}

// The rotation from world to body axes.
Q4d body_axes(const Q4d& orientation) { return conjugate(orientation); }

Sym3d inverse(const Sym3d& m) {
  const double a = m.yy * m.zz - m.yz * m.yz, b = m.xz * m.yz - m.xy * m.zz,
               c = m.xy * m.yz - m.xz * m.yy;
  const double s = 1 / ((m.xx * a + m.xy * b) + m.xz * c);
  return {a * s,
          b * s,
          c * s,
          (m.xx * m.zz - m.xz * m.xz) * s,
          (m.xy * m.xz - m.xx * m.yz) * s,
          (m.xx * m.yy - m.xy * m.xy) * s};
}

// Part of h^2 times a stiffness that a body's inertia is at least: oscillations then take at least
// 2 pi / sqrt(2) substeps, inside the limit of 2 pi / 2.
constexpr double kStiffInertia = 0.5;

}  // namespace

void JointBodies::begin(std::uint32_t rows, std::uint32_t dynamic_end) {
  if (bodies_.size() < rows) {
    bodies_.resize(rows);
    before_.resize(rows);
    published_.resize(rows);
    touched_.resize(rows);
    moves_.resize(rows);
  }
  for (std::uint32_t row = 0; row < rows; ++row) moves_[row].owned = moves_[row].smooth = false;
  std::fill_n(touched_.begin(), rows, std::uint8_t{0});
  bodies_[0] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0, 0, 0, 0}, {{0, 0, 0}, {0, 0, 0, 1}}};
  before_[0] = {{0, 0, 0}, {0, 0, 0}};
  dynamic_end_ = dynamic_end;
  any_smooth_ = false;
}

void JointBodies::own(std::uint32_t first, std::uint32_t count, bool smooth, bool touched) {
  for (std::uint32_t row = first; row < first + count; ++row) {
    moves_[row].owned = true;
    moves_[row].smooth = smooth;
    touched_[row] = touched;
    moves_[row].stiffness = {0, 0, 0, 0, 0, 0};
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
  move.inv_inertia_b = move.response_b = symmetric(mass.inv_inertia_b);
  move.stiff = false;
  move.acceleration = scalars(Vec3(force.force * m));
  move.torque = scalars(force.torque);
  move.linear_damping = mass.linear_damping;
  move.angular_damping = mass.angular_damping;
  move.start = body.pose;
  move.locks = flags & (core::kLockRx | core::kLockRy | core::kLockRz);
  move.isotropic = (flags & core::kIsotropic) != 0;
  move.spins = !move.isotropic && move.locks == 0;
  move.mass = &mass;
  publish(row);
  stiffen(row, step.dt / step.settings->solver.substeps);
}

void JointBodies::gather_kinematic(std::uint32_t row, const JointPose& pose, const V3d& linear,
                                   const V3d& angular) {
  bodies_[row] = {linear, angular, {0, 0, 0}, {0, 0, 0, 0, 0, 0}, pose};
  before_[row] = {linear, angular};
  moves_[row] = {};
  moves_[row].owned = true;
  moves_[row].isotropic = true;
  moves_[row].start = pose;
}

void JointBodies::absorb(std::uint32_t row) {
  JointBody& body = bodies_[row];
  body.linear = body.linear + gain(velocity_[row].linear, published_[row].linear);
  body.angular = body.angular + gain(velocity_[row].angular, published_[row].angular);
  published_[row] = velocity_[row];  // taken over once, however often the body is loaded
}

void JointBodies::publish(std::uint32_t row) {
  // The copy is what absorb() compares with.
  published_[row] = {to_float(bodies_[row].linear), 0, to_float(bodies_[row].angular), 0};
  velocity_[row] = published_[row];
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
    if (touched_[row]) absorb(row);
    JointBody& body = bodies_[row];
    before_[row] = {body.linear, body.angular};
    const double dt = move.smooth ? h * fraction : h;
    body.linear = (body.linear + move.acceleration * dt) * (1 / (1 + dt * move.linear_damping));
    body.angular = (body.angular + body.inv_inertia * (move.torque * dt)) *
                   (1 / (1 + dt * move.angular_damping));
    publish(row);
  }
}

void JointBodies::turn(JointBody& body, const Move& move, double h) {
  Q4d& q = body.pose.orientation;
  if (move.spins) {
    const V3d spin = momentum(move.inertia_b, q, body.angular);
    const auto velocity = [&](const Q4d& at) { return momentum(move.inv_inertia_b, at, spin); };
    const V3d middle = velocity(turned(q, body.angular * (0.5 * h)));
    q = turned(q, middle * h);
    body.angular = velocity(q);
  } else {
    q = turned(q, body.angular * h);
  }
  if (move.locks != 0) {
    body.inv_inertia =
        symmetric(core::inv_inertia_w(*move.mass, Quat(q.w, q.x, q.y, q.z), move.locks));
  } else if (!move.isotropic || move.stiff) {
    body.inv_inertia = rotated(move.response_b, core::to_matrix(q));
  }
}

JointPose JointBodies::pose_after(std::uint32_t row, double h) {
  if (row == 0) return bodies_[0].pose;
  JointBody body = load(row);
  body.pose.center = body.pose.center + body.linear * h;
  turn(body, moves_[row], h);
  return body.pose;
}

void JointBodies::add_stiffness(std::uint32_t row, const Sym3d& k) {
  Sym3d& sum = moves_[row].stiffness;
  sum = {sum.xx + k.xx, sum.xy + k.xy, sum.xz + k.xz, sum.yy + k.yy, sum.yz + k.yz, sum.zz + k.zz};
}

void JointBodies::stiffen(std::uint32_t row, double h) {
  Move& move = moves_[row];
  if (move.locks != 0) return;
  const M3d axes = core::to_matrix(body_axes(bodies_[row].pose.orientation));
  const Sym3d k = rotated(move.stiffness, axes);
  const Sym3d& i = move.inertia_b;
  const auto more = [h](double stiff, double inertia) {
    return std::max(kStiffInertia * (h * h) * stiff - inertia, 0.0);
  };
  const V3d extra = {more(k.xx, i.xx), more(k.yy, i.yy), more(k.zz, i.zz)};
  if (!(extra.x > 0 || extra.y > 0 || extra.z > 0)) return;
  move.stiff = true;
  move.response_b = inverse({i.xx + extra.x, i.xy, i.xz, i.yy + extra.y, i.yz, i.zz + extra.z});
  bodies_[row].inv_inertia =
      rotated(move.response_b, core::to_matrix(bodies_[row].pose.orientation));
}

void JointBodies::drift(std::uint32_t begin, std::uint32_t end, double h) {
  for (std::uint32_t row = std::max(begin, 1u); row < end; ++row) {
    const Move& move = moves_[row];
    if (!move.owned) continue;
    if (touched_[row]) absorb(row);
    JointBody& body = bodies_[row];
    body.pose.center = body.pose.center + body.linear * h;
    turn(body, move, h);
    delta_[row].translation = to_float(body.pose.center - move.start.center);
    const Q4d turn = body.pose.orientation * conjugate(move.start.orientation);
    delta_[row].rotation = {core::rounded_to_float(turn.x), core::rounded_to_float(turn.y),
                            core::rounded_to_float(turn.z), core::rounded_to_float(turn.w)};
    publish(row);
  }
}

void JointBodies::result(const core::Bodies& bodies, std::uint32_t row, core::BodyIndex index,
                         core::BodyPose& pose, core::BodyMotion& motion) {
  if (touched_[row]) absorb(row);
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
