#include "solver/impacts.h"

#include <algorithm>
#include <cmath>

#include "core/growth.h"
#include "core/rounding.h"
#include "solver/rotation.h"
#include "solver/row_helpers.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {
namespace {

using namespace core;

constexpr float kTouch = 1e-5f;  // m: a smaller gap counts as none where bodies bounce
constexpr double kSlow = 8;      // what gravity gives in so many steps is slow for an impact
constexpr double kDeep = 1e-3;   // m: what overlaps by more is pushed apart before it flies

// m: of the point that is nearest to touching.
float gap_of(const Manifold& manifold) {
  float gap = manifold.points[0].separation;
  for (std::uint32_t k = 1; k < manifold.point_count; ++k)
    gap = std::min(gap, manifold.points[k].separation);
  return gap;
}

}  // namespace

// Impacts among several bodies of an island all happen when the first of them does.
void Impacts::begin(GroupData& group, bool may_bounce) {
  group_ = &group;
  bounces_.store(false, std::memory_order_relaxed);
  core::refill(held_, group_->row_count, std::uint8_t{0});
  if (!may_bounce) return;
  core::grow(flown_, group_->padded_rows);
  core::grow(flown_from_, group_->row_count);
  if (group_->joined) return;
  find_held();
  core::refill(impact_time_, group_->row_count, 0.0f);
  std::uint32_t contact = 0, row = 1;
  for (std::uint32_t i = 0; i < group_->islands.count; ++i) {
    const Island& island = group_->island(i);
    const float time = first_impact(contact, contact + island.contact_count);
    std::fill_n(impact_time_.begin() + row, island.body_count, time);
    contact += island.contact_count;
    row += island.body_count;
  }
}

// Bodies under a force that contacts withstood in the last step, or that overlap with others and come on no
// faster than forces make them: substeps move them, and their contacts have no time of their own.
void Impacts::find_held() {
  std::uint32_t contact = 0;
  for (std::uint32_t i = 0; i < group_->islands.count; ++i) {
    const std::uint32_t count = group_->island(i).contact_count;
    for (const std::uint32_t end = contact + count; contact < end; ++contact) {
      const Manifold& manifold = group_->manifold(contact);
      const std::uint32_t a = group_->row_a[contact], b = group_->row_b[contact];
      const float* n = manifold.normal_impulse;
      const bool pushed = (n[0] + n[1]) + (n[2] + n[3]) > 0;
      if ((pushed || is_pressed(manifold, count == 1)) && (is_forced(a) || is_forced(b)))
        held_[a] = held_[b] = 1;
    }
  }
}

// `alone`: no other contact is near; then it is not if its bounce leads out of the overlap.
bool Impacts::is_pressed(const Manifold& manifold, bool alone) const {
  const double depth = -double(gap_of(manifold)), speed = double(manifold.approach_speed);
  const double dt = group_->step->dt, gained = group_->step->settings->gravity.norm() * dt;
  if (depth <= kDeep || speed >= kSlow * gained) return false;
  return !alone || (double(manifold.restitution) * speed - 0.5 * gained) * dt <= depth;
}

bool Impacts::is_forced(std::uint32_t row) const {
  if (row - 1 >= group_->body_count) return false;
  const BodyIndex body = group_->body[row];
  return (group_->step->bodies->flags[body] & kForced) != 0 ||
         (group_->step->bodies->mass[body].gravity_scale != 0 &&
          !group_->step->settings->gravity.isZero(0));
}

// s: when the first of these contacts bounces.
float Impacts::first_impact(std::uint32_t begin, std::uint32_t end) const {
  float first = core::rounded_to_float(group_->step->dt);
  const float threshold =
      core::rounded_to_float(group_->step->settings->solver.restitution_threshold);
  bool any = false;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Manifold& manifold = group_->manifold(i);
    const bool fast =
        manifold.approach_speed > core::slowest_bounce(threshold, manifold.restitution);
    if (!(manifold.restitution > 0) || !(fast || manifold.touch_time > 0)) continue;
    const float gap = std::max(gap_of(manifold), 0.0f);
    const float time =
        manifold.touch_time > 0 ? manifold.touch_time : gap / manifold.approach_speed;
    first = std::min(first, time);
    any = true;
  }
  return any ? first : 0;
}

bool Impacts::touches(std::uint32_t contact) const {
  return gap_of(group_->manifold(contact)) <= kTouch;
}

Vec3 Impacts::way(std::uint32_t row, double time) const {
  if (row == 0) return Vec3::Zero();
  if (row - 1 >= group_->body_count) {
    const IslandScratch& islands = group_->step->solver->islands;
    return time * islands.kinematics[islands.slot[group_->body[row]] & ~kKinematicSlot].linear;
  }
  const Vec3& linear = group_->step->bodies->motion[group_->body[row]].linear;
  return time * linear +
         (0.5 * time * time / group_->step->dt) * (group_->outlook[row].linear - linear);
}

Vec3 Impacts::offset_after(std::uint32_t contact, double from, double time) const {
  const double* offset = group_->contacts[contact].offset;
  const std::uint32_t a = group_->row_a[contact], b = group_->row_b[contact];
  return Vec3(offset[0], offset[1], offset[2]) +
         ((way(b, time) - way(b, from)) - (way(a, time) - way(a, from)));
}

// N m, external.
Vec3 Impacts::torque_on(std::uint32_t row) const {
  return (group_->outlook[row].angular_momentum -
          group_->step->bodies->motion[group_->body[row]].angular_momentum) /
         group_->step->dt;
}

Impacts::Spin Impacts::spin_after(std::uint32_t row, double time) const {
  const BodyIndex body = group_->body[row];
  const BodyMass& mass = group_->step->bodies->mass[body];
  const std::uint32_t flags = group_->step->bodies->flags[body];
  const Vec3& start = group_->step->bodies->motion[body].angular_momentum;
  const Vec3 torque = torque_on(row), momentum = start + time * torque;
  if (flags & kIsotropic)
    return {group_->mass[row].inv_inertia, to_float(Vec3(momentum * mass.inv_inertia_b(0, 0)))};
  const Mat3 inverse =
      inv_inertia_w(mass,
                    orientation_after(time, mass, flags,
                                      group_->step->bodies->pose[body].orientation, start, torque),
                    flags);
  return {rounded(inverse), to_float(Vec3(inverse * momentum))};
}

double Impacts::time_of_impacts(std::uint32_t contact) const {
  const std::uint32_t a = group_->row_a[contact];
  return double(impact_time_[a - 1 < group_->body_count ? a : group_->row_b[contact]]);
}

// Whether a struck body that bears no load is kept by the substeps where it touched. It has the same height after
// the impact as before, and so it has the same speed if the impact comes halfway through the rest of the step.
bool Impacts::stays(std::uint32_t row) const {
  return held_[row] != 0 && group_->velocity[row].pushes < kBearing && !group_->joined &&
         !group_->outlook[row].from_rows && group_->mass[row].lock_flags == 0;
}

void Impacts::rebalance(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = begin; row < end; ++row) {
    VelocityRow& velocity = group_->velocity[row];
    if (!(velocity.struck > 0) || !(flies(row) || stays(row))) continue;
    const BodyIndex body = group_->body[row];
    const BodyMotion& motion = group_->step->bodies->motion[body];
    auto time = double(impact_time_[row]);
    if (!flies(row)) time = 0.5 * (time + group_->step->dt);
    velocity.linear = to_float(Vec3(motion.linear + (group_->outlook[row].linear - motion.linear) *
                                                        (time / group_->step->dt)));
    velocity.angular = spin_after(row, time).angular;
  }
}

void Impacts::fly(std::uint32_t begin, std::uint32_t end) {
  if (!bounces()) return;
  for (std::uint32_t row = begin; row < end; ++row) {
    flown_[row] = group_->delta[row];
    flown_from_[row] = group_->delta[row].translation;
    const double time = row - 1 < group_->body_count ? time_of_impact(row) : -1;
    if (time < 0) continue;
    const BodyPose& pose = group_->step->bodies->pose[group_->body[row]];
    const BodyPose next = pose_after(row, time);
    flown_[row].translation = flown_from_[row] = to_float(Vec3(next.center - pose.center));
    flown_[row].rotation = to_float(Quat(next.orientation * pose.orientation.conjugate()));
  }
}

BodyPose Impacts::pose_after(std::uint32_t row, double time) const {
  const BodyIndex index = group_->body[row];
  const BodyPose& pose = group_->step->bodies->pose[index];
  const BodyMass& mass = group_->step->bodies->mass[index];
  const std::uint32_t flags = group_->step->bodies->flags[index];
  const Vec3& momentum = group_->step->bodies->motion[index].angular_momentum;
  const Ledger& ledger = group_->ledger[row];
  const double rest = group_->step->dt - time;
  const Vec3 impulse(ledger.impulse[0], ledger.impulse[1], ledger.impulse[2]);
  const Vec3 spin(ledger.angular_impulse[0], ledger.angular_impulse[1], ledger.angular_impulse[2]);
  const Vec3 torque = torque_on(row);
  const Quat there = orientation_after(time, mass, flags, pose.orientation, momentum, torque);
  return {pose.center + way(row, group_->step->dt) + (rest * mass.inv_mass) * impulse,
          orientation_after(rest, mass, flags, there, momentum + time * torque + spin, torque)};
}

Vec3 Impacts::parted(std::uint32_t row) const {
  return to_double(flown_[row].translation) - to_double(flown_from_[row]);
}

// A fixed body that stops a flight early lifts what would have fallen on: the speed along the force is that
// of the place where it stopped. What this cannot pay, all else that moves does. Two that part keep their common
// centre of mass, and thus their energy.
void Impacts::pay_for_parting(std::uint32_t row, const Quat& orientation,
                              BodyMotion& motion) const {
  const auto fallen = double(flown_[row].fallen);
  if (fallen == 0) return;
  const BodyIndex body = group_->body[row];
  const Vec3 force = group_->outlook[row].linear - group_->step->bodies->motion[body].linear;
  const Vec3 along = force.normalized();
  const double before = motion.linear.dot(along), squared = before * before + 2 * fallen;
  const double after = std::copysign(std::sqrt(std::max(0.0, squared)), before);
  motion.linear += (after - before) * along;
  if (squared >= 0) return;
  const BodyMass& mass = group_->step->bodies->mass[body];
  const Mat3 inverse = inv_inertia_w(mass, orientation, group_->step->bodies->flags[body]);
  const double turning = motion.angular_momentum.dot(inverse * motion.angular_momentum);
  const double moving = motion.linear.squaredNorm() + mass.inv_mass * turning;
  if (!(moving > 0)) return;
  const double part = std::sqrt(std::max(0.0, 1 + squared / moving));
  motion.linear *= part;
  motion.angular_momentum *= part;
}

}  // namespace skerry::solver
