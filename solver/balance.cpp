#include "solver/balance.h"

#include <algorithm>

#include "core/growth.h"
#include "core/vec.h"
#include "solver/fast_watch.h"
#include "solver/rotation.h"

namespace skerry::solver {
namespace {

using namespace core;

// A body is shifted by this many inner radii at most, and by what it flies in so many steps.
constexpr double kMostShift = 0.25, kMostSteps = 4;
constexpr double kOnLine = 1e-6;     // of a spread of masses: added, for bodies on a line
constexpr double kRounding = 1e-13;  // of an island's energy: less is no gain

Vec3 vector(const double (&v)[3]) { return Vec3(v[0], v[1], v[2]); }

}  // namespace

void Balance::begin(GroupData& group, const Impacts& impacts) {
  group_ = &group;
  impacts_ = &impacts;
  acts_ = !group.joined && group.step->settings->gravity.isZero(0);
  if (!acts_) return;
  core::grow(kind_, group.islands.count);
  core::grow(spare_, group.islands.count);
  core::refill(shift_, group.row_count, Vec3(Vec3::Zero()));
  core::refill(turn_time_, group.row_count, -1.0);
}

// Whether no force acts on a body and no axis of it is locked.
bool Balance::is_free(std::uint32_t row) const {
  const BodyMotion& motion = group_->step->bodies->motion[group_->body[row]];
  const Outlook& outlook = group_->outlook[row];
  return outlook.linear == motion.linear && outlook.angular_momentum == motion.angular_momentum &&
         !outlook.from_rows && group_->mass[row].lock_flags == 0;
}

Balance::Kind Balance::kind_of(std::uint32_t island, std::uint32_t row,
                               std::uint32_t contact) const {
  const Island& members = group_->island(island);
  for (std::uint32_t i = 0; i < members.body_count; ++i)
    if (!is_free(row + i)) return Kind::acted_on;
  Kind kind = Kind::isolated;
  for (std::uint32_t i = contact; i < contact + members.contact_count; ++i) {
    for (const std::uint32_t side : {group_->row_a[i], group_->row_b[i]}) {
      if (side - 1 < group_->body_count || group_->manifold(i).total_impulse == 0) continue;
      if (side != 0) return Kind::acted_on;
      kind = Kind::grounded;
    }
  }
  return kind;
}

void Balance::lessen() {
  std::uint32_t row = 1, contact = 0;
  for (std::uint32_t i = 0; i < group_->islands.count; ++i) {
    const Island& island = group_->island(i);
    kind_[i] = kind_of(i, row, contact);
    spare_[i] = kind_[i] != Kind::acted_on ? lessen(row, row + island.body_count) : 0;
    row += island.body_count;
    contact += island.contact_count;
  }
}

// Where the substeps turned a body the energy of its spin depends on how; an island that gains by it turns
// freely instead, until a mean time of its impulses and on from it. Without them it would have gained nothing.
// Returns how much energy the impulses took, J.
double Balance::lessen(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t row = begin; row < end; ++row)
    if (turns_far(row) && by_substeps(row)) turn_time_[row] = 0;
  Energy energy = energy_of(begin, end);
  if (!(energy.gained > kRounding * energy.before)) return -energy.gained;
  for (std::uint32_t row = begin; row < end; ++row)
    if (by_substeps(row)) turn_time_[row] = mean_time(row);
  energy = energy_of(begin, end);
  if (!(energy.gained > 0) || !(energy.square > 0)) return -energy.gained;
  const double kept = std::max(0.0, 1 - energy.gained / energy.square);
  for (std::uint32_t row = begin; row < end; ++row) {
    Ledger& ledger = group_->ledger[row];
    for (int k = 0; k < 3; ++k) {
      ledger.impulse[k] *= kept;
      ledger.angular_impulse[k] *= kept;
    }
  }
  return 0;
}

// Whether substeps turned a body that contacts pushed.
bool Balance::by_substeps(std::uint32_t row) const {
  return group_->ledger[row].pushed && time_of_turn(row) < 0;
}

// Whether FastWatch may turn it on from its start.
bool Balance::turns_far(std::uint32_t row) const {
  constexpr double kAlmost = 0.9;
  const Vec3& before = group_->step->bodies->motion[group_->body[row]].angular;
  const double spin = std::max(before.norm(), to_double(group_->velocity[row].angular).norm());
  return spin * group_->step->dt > kAlmost * kLargeTurn;
}

Balance::Energy Balance::energy_of(std::uint32_t begin, std::uint32_t end) const {
  Energy energy;
  for (std::uint32_t row = begin; row < end; ++row) {
    const Ledger& ledger = group_->ledger[row];
    if (!ledger.pushed) continue;
    const BodyIndex body = group_->body[row];
    const BodyMass& mass = group_->step->bodies->mass[body];
    const BodyMotion& motion = group_->step->bodies->motion[body];
    const Vec3 impulse = vector(ledger.impulse), spin = vector(ledger.angular_impulse);
    const Quat there = orientation_after_step(row);
    const std::uint32_t flags = group_->step->bodies->flags[body];
    const Vec3 turn = angular_velocity(mass, flags, there, motion.angular_momentum);
    const Vec3 by_spin = angular_velocity(mass, flags, there, spin);
    const double square = 0.5 * (mass.inv_mass * impulse.squaredNorm() + spin.dot(by_spin));
    energy.before += kinetic_energy(motion, mass.mass);
    energy.square += square;
    energy.gained += motion.linear.dot(impulse) + turn.dot(spin) + square +
                     0.5 * motion.angular_momentum.dot(turn - motion.angular);
  }
  return energy;
}

// One that has the energy of the orientation after the step.
Quat Balance::orientation_after_step(std::uint32_t row) const {
  const BodyIndex body = group_->body[row];
  const Bodies& bodies = *group_->step->bodies;
  const Quat& start = bodies.pose[body].orientation;
  const double time = time_of_turn(row);
  if (time >= 0)
    return orientation_after(time, bodies.mass[body], bodies.flags[body], start,
                             bodies.motion[body].angular_momentum, Vec3::Zero());
  const Q4f& turn = group_->delta[row].rotation;
  return (Quat(double(turn.w), double(turn.x), double(turn.y), double(turn.z)) * start)
      .normalized();
}

double Balance::time_of_turn(std::uint32_t row) const {
  const double time = impacts_->time_of_impact(row);
  return time < 0 && acts_ ? turn_time_[row] : time;
}

// s: when the impulses of a body act in the mean, by how far it came.
double Balance::mean_time(std::uint32_t row) const {
  const Ledger& ledger = group_->ledger[row];
  const BodyMass& mass = group_->step->bodies->mass[group_->body[row]];
  const double dt = group_->step->dt;
  const Vec3 change = mass.inv_mass * vector(ledger.impulse);
  const double squared = change.squaredNorm();
  if (!(squared > 0)) return 0.5 * dt;
  const Vec3 late = way(row) - dt * velocity_after(row);
  return std::clamp(-late.dot(change) / squared, 0.0, dt);
}

Vec3 Balance::velocity_after(std::uint32_t row) const {
  const BodyIndex body = group_->body[row];
  return group_->step->bodies->motion[body].linear +
         group_->step->bodies->mass[body].inv_mass * vector(group_->ledger[row].impulse);
}

// m: of a body in the step, but for its shift.
Vec3 Balance::way(std::uint32_t row) const {
  const double dt = group_->step->dt, time = impacts_->time_of_impact(row);
  const Ledger& ledger = group_->ledger[row];
  if (ledger.pushed && time < 0) return to_double(group_->delta[row].translation);
  return impacts_->way(row, dt) +
         (ledger.pushed ? dt - time : 0.0) *
             (velocity_after(row) - group_->step->bodies->motion[group_->body[row]].linear);
}

void Balance::settle() {
  std::uint32_t row = 1;
  for (std::uint32_t i = 0; i < group_->islands.count; ++i) {
    const std::uint32_t end = row + group_->island(i).body_count;
    if (impacts_->timed())
      for (std::uint32_t k = row; k < end; ++k) shift_[k] = impacts_->parted(k);
    group_->step->islands->islands[group_->islands.first + i].isolated = kind_[i] == Kind::isolated;
    if (kind_[i] == Kind::isolated) settle(row, end, spare_[i]);
    row = end;
  }
}

// All that contacts moved take part. Their common centre of mass stays where it is. Where that would take
// large shifts, those that substeps moved fly with what they got from the start of the step on instead: contacts
// were made for where they were then. But slow ones that are pushed out of each other have to get apart: they
// turn about each other the more slowly for it, if that takes energy.
void Balance::settle(std::uint32_t begin, std::uint32_t end, double spare) {
  movers_.clear();
  for (std::uint32_t row = begin; row < end; ++row)
    if (group_->ledger[row].pushed || !shift_[row].isZero(0)) movers_.push_back(row);
  if (movers_.empty()) return;
  if (shift_back()) return;
  for (const std::uint32_t row : movers_)
    if (impacts_->time_of_impact(row) < 0 && flies_so_far(row))
      shift_[row] = group_->step->dt * velocity_after(row) - way(row);
  if (!shift_back()) turn_back(spare);
}

// Takes back what is left by a turn of all about their common centre of mass, each on its own, for no more
// than this energy, J.
void Balance::turn_back(double spare) {
  const Bodies& bodies = *group_->step->bodies;
  const auto mass = [&](std::uint32_t row) { return bodies.mass[group_->body[row]].mass; };
  const auto place = [&](std::uint32_t row) -> Vec3 {
    return bodies.pose[group_->body[row]].center + way(row) + shift_[row];
  };
  Vec3 middle = Vec3::Zero();
  double total = 0;
  turners_.clear();
  for (const std::uint32_t row : movers_)
    if (group_->ledger[row].pushed) turners_.push_back(row);
  if (turners_.size() < 2) return;
  for (const std::uint32_t row : turners_) {
    middle += mass(row) * place(row);
    total += mass(row);
  }
  middle /= total;
  Mat3 spread = Mat3::Zero();
  for (const std::uint32_t row : turners_) {
    const Vec3 arm = place(row) - middle;
    spread += mass(row) * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  spread += (kOnLine * spread.trace()) * Mat3::Identity();
  const Vec3 turn = -(spread.inverse() * moment_change());
  double given = 0;
  pushes_.clear();
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t row : turners_) {
    const Vec3 by = turn.cross(place(row) - middle);
    pushes_.push_back(mass(row) * by);
    sum += pushes_.back();
    given += mass(row) * by.dot(velocity_after(row) + 0.5 * by);
  }
  if (!(given <= spare)) return;
  pushes_.front() -= sum;  // of rounding
  for (std::size_t i = 0; i < turners_.size(); ++i)
    for (int k = 0; k < 3; ++k) group_->ledger[turners_[i]].impulse[k] += pushes_[i][k];
}

// Whether a body came no farther from where it would fly to than it flies.
bool Balance::flies_so_far(std::uint32_t row) const {
  const double dt = group_->step->dt;
  const Vec3& before = group_->step->bodies->motion[group_->body[row]].linear;
  const Vec3 after = velocity_after(row);
  return (way(row) - dt * after).norm() <= dt * (before - after).norm();
}

// Whether shifts took back nearly all.
bool Balance::shift_back() {
  const Bodies& bodies = *group_->step->bodies;
  Vec3 momentum = Vec3::Zero();
  double total = 0;
  for (const std::uint32_t row : movers_) {
    const double mass = bodies.mass[group_->body[row]].mass;
    momentum += mass * velocity_after(row);
    total += mass;
  }
  const Vec3 mean = momentum / total;
  moment_.begin(kMostShift, kMostSteps * group_->step->dt);
  for (const std::uint32_t row : movers_)
    moment_.add(bodies.mass[group_->body[row]], velocity_after(row) - mean);
  const bool all = moment_.solve(moment_change());
  for (std::size_t i = 0; i < movers_.size(); ++i) shift_[movers_[i]] += moment_.shift(i);
  return all;
}

// kg m^2/s: by how much the angular momentum of those that move differs from before.
Vec3 Balance::moment_change() const {
  const Bodies& bodies = *group_->step->bodies;
  const Vec3& origin = bodies.pose[group_->body[movers_.front()]].center;
  Vec3 change = Vec3::Zero();
  for (const std::uint32_t row : movers_) {
    const BodyIndex body = group_->body[row];
    change += (bodies.pose[body].center - origin).cross(vector(group_->ledger[row].impulse)) +
              (way(row) + shift_[row]).cross(bodies.mass[body].mass * velocity_after(row)) +
              vector(group_->ledger[row].angular_impulse);
  }
  return change;
}

}  // namespace skerry::solver
