// Bodies of a group: into rows before its substeps, and out of them.
#include <algorithm>
#include <cmath>

#include "core/rounding.h"
#include "solver/effect_watch.h"
#include "solver/fast_watch.h"
#include "solver/forces.h"
#include "solver/free_flight.h"
#include "solver/group_solver.h"
#include "solver/rotation.h"
#include "solver/row_helpers.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {
namespace {

using namespace core;

// A ball is flat over a hundredth of its radius where it touches, and pressed there as Hertz says: friction
// about the normal has a mean lever of 3 pi / 16 of that (docs/decisions/0026). Of the ball inside a shape.
constexpr float kPatchLever = 0.01f * 0.589f;

bool is_finite(const Vec3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

// Takes over a body's new state, or sets the body aside if it is not finite.
void accept(Bodies& bodies, BodyIndex index, const BodyPose& pose, const BodyMotion& motion) {
  if (is_finite(pose.center) && pose.orientation.coeffs().allFinite() && is_finite(motion.linear) &&
      is_finite(motion.angular) && is_finite(motion.angular_momentum)) {
    bodies.pose[index] = pose;
    bodies.motion[index] = motion;
  } else {
    bodies.motion[index] = BodyMotion{};
    bodies.flags[index] |= kQuarantined;
  }
}

// Of a quaternion that is a unit one but for what a step's rounding and a small turn add. To third order,
// which is below rounding, without a root and a division.
Quat made_unit(Quat q) {
  const double excess = q.squaredNorm() - 1;
  if (std::fabs(excess) > 1e-5) return q.normalized();
  q.coeffs() *= 1 - 0.5 * excess + 0.375 * excess * excess;
  return q;
}

}  // namespace

void GroupSolver::gather_rows(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = begin; row < end; ++row) {
    group_.delta[row] = {{0, 0, 0}, 0, {0, 0, 0, 1}};
    if (row - 1 < group_.body_count) {
      const BodyIndex ahead = group_.body[std::min(row + kPrefetch, group_.body_count)];
      prefetch(group_.step->bodies->pose[ahead]);
      prefetch(group_.step->bodies->motion[ahead]);
      __builtin_prefetch(&group_.step->bodies->mass[ahead]);
      gather_body(row);
      continue;
    }
    start_[row] = {{0, 0, 0}, 0, {0, 0, 0}, 0};
    group_.mass[row] = {0, {0, 0, 0, 0, 0, 0}, 0};
    base_[row] = {{0, 0, 0}, 0, {0, 0, 0, 1}};
    spin_[row] = {{0, 0, 0}, 1, {0, 0, 0, 0, 0, 0}, 1, 0};
    if (row > group_.body_count && row < group_.row_count) gather_kinematic(row);
    group_.velocity[row] = start_[row];
  }
}

void GroupSolver::gather_kinematic(std::uint32_t row) {
  const IslandScratch& islands = group_.step->solver->islands;
  const KinematicStart& start =
      islands.kinematics[islands.slot[group_.body[row]] & ~kKinematicSlot];
  start_[row] = {to_float(start.linear), 0, to_float(start.angular), 0};
  base_[row].orientation = to_float(start.orientation);
  if (!joints_.empty()) {
    joints_.bodies.gather_kinematic(row, {scalars(start.center), scalars(start.orientation)},
                                    scalars(start.linear), scalars(start.angular));
  }
}

float GroupSolver::damping_factor(double damping) const {
  if (damping == 0) return 1;
  const double h = group_.step->dt / group_.step->settings->solver.substeps;
  return core::rounded_to_float(1 / (1 + h * damping));
}

void GroupSolver::gather_body(std::uint32_t row) {
  const BodyIndex index = group_.body[row];
  const Bodies& bodies = *group_.step->bodies;
  const std::uint32_t flags = bodies.flags[index];
  const BodyPose& pose = bodies.pose[index];
  const BodyMotion& motion = bodies.motion[index];
  const BodyMass& mass = bodies.mass[index];
  const ExternalForce force = external_force(*group_.step, index, group_.step->time, pose.center,
                                             motion.linear, motion.angular);
  start_[row] = {to_float(motion.linear), 0, to_float(motion.angular), 0};
  group_.velocity[row] = start_[row];
  const Vec3 acceleration = force.force * mass.inv_mass;
  base_[row] = {to_float(acceleration), kPatchLever * mass.inner_radius,
                to_float(pose.orientation)};

  const bool isotropic = (flags & kIsotropic) != 0;
  const bool round = isotropic && !(flags & kLockMask);
  MassRow& m = group_.mass[row];
  m.inv_mass = core::rounded_to_float(mass.inv_mass);
  m.lock_flags = flags & kLockMask;
  SpinRow& spin = spin_[row];
  Vec3 angular_acceleration;
  if (round) {
    const auto inverse = core::rounded_to_float(mass.inv_inertia_b(0, 0));
    m.inv_inertia = {inverse, 0, 0, inverse, 0, inverse};
    std::fill_n(spin.inertia, 6, 0.0f);
    angular_acceleration = force.torque * mass.inv_inertia_b(0, 0);
  } else {
    const Mat3 inverse = inv_inertia_w(mass, pose.orientation, flags);
    m.inv_inertia = rounded(inverse);
    const Mat3 inertia = inertia_w(mass, pose.orientation);
    const double six[6] = {inertia(0, 0), inertia(0, 1), inertia(0, 2),
                           inertia(1, 1), inertia(1, 2), inertia(2, 2)};
    for (int k = 0; k < 6; ++k) spin.inertia[k] = core::rounded_to_float(six[k]);
    angular_acceleration = inverse * force.torque;
  }
  spin.angular_acceleration = to_float(angular_acceleration);
  spin.linear_factor = damping_factor(mass.linear_damping);
  spin.angular_factor = damping_factor(mass.angular_damping);
  // What turns so far in a step turns exactly, after its impacts (FastWatch).
  const bool turns_later =
      (flags & kContinuous) && motion.angular.norm() * group_.step->dt > kLargeTurn;
  spin.gyroscopic = isotropic || turns_later || (flags & kLockMask) ? 0.0f : 1.0f;

  group_.ledger[row] = {};
  Outlook& outlook = group_.outlook[row];
  outlook.linear = motion.linear + acceleration * group_.step->dt;
  outlook.angular_momentum = motion.angular_momentum + force.torque * group_.step->dt;
  outlook.smooth_change = core::rounded_to_float(2 * group_.step->dt * acceleration.norm());
  outlook.from_rows = mass.linear_damping > 0 || mass.angular_damping > 0;
  if (!joints_.empty() && joints_.bodies.owns(row)) {
    joints_.bodies.gather(*group_.step, row, index, force);
    const Sym3d& inverse = joints_.bodies.at(row).inv_inertia;
    m.inv_inertia = {core::rounded_to_float(inverse.xx), core::rounded_to_float(inverse.xy),
                     core::rounded_to_float(inverse.xz), core::rounded_to_float(inverse.yy),
                     core::rounded_to_float(inverse.yz), core::rounded_to_float(inverse.zz)};
  }
}

void GroupSolver::finish_rows(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = std::max(begin, 1u); row < end; ++row) {
    FastWatch watch(*group_.step, group_.body[row]);
    EffectWatch effect(*group_.step, group_.body[row]);
    const Ledger& ledger = group_.ledger[row];
    const Outlook& outlook = group_.outlook[row];
    const Vec3 push(ledger.impulse[0], ledger.impulse[1], ledger.impulse[2]);
    const Vec3 spin(ledger.angular_impulse[0], ledger.angular_impulse[1],
                    ledger.angular_impulse[2]);
    const bool from_rows = outlook.from_rows;
    if (!joints_.empty() && joints_.bodies.owns(row)) {
      finish_jointed(row);
      effect.finish(push, spin);
      watch.finish(FastFlight::joined);
    } else if (!ledger.pushed && !from_rows) {
      fly_free(*group_.step, group_.body[row]);  // near others, but nothing touched it
      if (balance_.is_idle() || balance_.shift(row).isZero(0)) {
        watch.finish(FastFlight::free);
      } else {
        move_unpushed(row);
        watch.finish(FastFlight::pushed, 0);
      }
    } else {
      finish_body(row);
      if (from_rows) {
        effect.finish(push, spin);
      } else if (effect.on()) {
        const double mass = group_.step->bodies->mass[group_.body[row]].mass;
        const BodyMotion& before = effect.before();
        effect.finish_balanced(push, spin, mass * (outlook.linear - before.linear),
                               outlook.angular_momentum - before.angular_momentum);
      }
      watch.finish(from_rows ? FastFlight::joined : FastFlight::pushed, balance_.time_of_turn(row));
    }
  }
}

// Of a body that parting or the balance has moved though nothing pushed it.
void GroupSolver::move_unpushed(std::uint32_t row) {
  const BodyIndex index = group_.body[row];
  Bodies& bodies = *group_.step->bodies;
  BodyPose& pose = bodies.pose[index];
  BodyMotion& motion = bodies.motion[index];
  pose.center += balance_.shift(row);
  if (!impacts_.timed()) return;
  impacts_.pay_for_parting(row, pose.orientation, motion);
  motion.angular = angular_velocity(bodies.mass[index], bodies.flags[index], pose.orientation,
                                    motion.angular_momentum);
}

// Where the substeps have brought a body that has these velocities after the step, m/s and rad/s.
void GroupSolver::go_by_substeps(std::uint32_t row, const Vec3& linear, const Vec3& spin,
                                 BodyPose& next) const {
  const BodyIndex index = group_.body[row];
  const BodyPose& pose = group_.step->bodies->pose[index];
  const BodyMotion& motion = group_.step->bodies->motion[index];
  const double radius = group_.step->bodies->mass[index].radius;
  const Ledger& ledger = group_.ledger[row];
  const DeltaRow& delta = group_.delta[row];
  next.center = pose.center + to_double(delta.translation);
  Quat turn(double(delta.rotation.w), double(delta.rotation.x), double(delta.rotation.y),
            double(delta.rotation.z));
  // Substeps moved the body by the velocity after each: half a substep's change too far. Taken
  // back where the change is the work of forces; an impact's place is exact as it is.
  const Vec3 change = ledger.held.free_part(linear - motion.linear);
  const Vec3 turn_change = ledger.held.free_turn(spin - motion.angular);
  const auto limit = double(group_.outlook[row].smooth_change);
  const double square = limit * limit;
  if (!ledger.impact && change.squaredNorm() <= square &&
      turn_change.squaredNorm() * (radius * radius) <= square) {
    const double half = 0.5 * group_.step->dt / group_.step->settings->solver.substeps;
    next.center -= half * change;
    const Vec3 back = -0.5 * half * turn_change;
    turn = Quat(1, back.x(), back.y(), back.z()) * turn;
  }
  next.orientation = made_unit(turn * pose.orientation);
}

void GroupSolver::finish_body(std::uint32_t row) {
  const BodyIndex index = group_.body[row];
  Bodies& bodies = *group_.step->bodies;
  const std::uint32_t flags = bodies.flags[index];
  const BodyMass& mass = bodies.mass[index];
  const Ledger& ledger = group_.ledger[row];
  const Outlook& outlook = group_.outlook[row];
  const Vec3 spin = to_double(group_.velocity[row].angular);
  BodyMotion after;
  if (outlook.from_rows) {
    after.linear = to_double(group_.velocity[row].linear);
  } else {
    after.linear =
        outlook.linear +
        unlocked(Vec3(ledger.impulse[0], ledger.impulse[1], ledger.impulse[2]), flags, kLockX) *
            mass.inv_mass;
    after.angular_momentum =
        outlook.angular_momentum +
        Vec3(ledger.angular_impulse[0], ledger.angular_impulse[1], ledger.angular_impulse[2]);
  }

  const double impact = impacts_.time_of_impact(row);
  BodyPose next;
  if (impact < 0)
    go_by_substeps(row, after.linear, spin, next);
  else
    next = impacts_.pose_after(row, impact);
  if (!balance_.is_idle()) {
    if (impact < 0 && balance_.time_of_turn(row) >= 0)
      next.orientation = impacts_.pose_after(row, balance_.time_of_turn(row)).orientation;
    next.center += balance_.shift(row);
    if (impacts_.timed() && !outlook.from_rows)
      impacts_.pay_for_parting(row, next.orientation, after);
  }
  after.angular = outlook.from_rows
                      ? spin
                      : angular_velocity(mass, flags, next.orientation, after.angular_momentum);
  if (outlook.from_rows) {
    after.angular_momentum = flags & kIsotropic
                                 ? Vec3(after.angular * mass.inertia_b(0, 0))
                                 : Vec3(inertia_w(mass, next.orientation) * after.angular);
  } else if (flags & (kLockRx | kLockRy | kLockRz)) {
    after.angular_momentum = inertia_w(mass, next.orientation) * after.angular;
  }

  accept(bodies, index, next, after);
}

void GroupSolver::finish_jointed(std::uint32_t row) {
  BodyPose next;
  BodyMotion after;
  joints_.bodies.result(*group_.step->bodies, row, group_.body[row], next, after);
  accept(*group_.step->bodies, group_.body[row], next, after);
}

}  // namespace skerry::solver
