#include "solver/pgs_solver.h"

#include <algorithm>
#include <cmath>

namespace skerry::solver {
namespace {

using namespace core;

enum : std::uint8_t { kKick, kPrepare, kWarmStart, kIterate, kRestitute, kStore, kDrift, kFinish };

double sum_of(const PointContact& c) {
  double sum = 0;
  for (std::uint32_t i = 0; i < c.count; ++i) sum += c.impulse[i];
  return sum;
}

}  // namespace

void PgsSolver::begin(const StepContext& step, const IslandGroup& group) {
  group_.begin(step, group);
  dt_ = step.dt;
  settings_ = step.settings->solver.pgs;
  rows_.resize(std::max(rows_.size(), group_.contacts.size()));
  clear_phases();
  add_bodies(kKick);
  add_contacts(kPrepare);
  add_contacts(kWarmStart);
  for (int i = 0; i < settings_.iterations; ++i) add_contacts(kIterate);
  add_contacts(kRestitute);
  add_contacts(kStore);
  add_bodies(kDrift);
  add_bodies(kFinish);
}

void PgsSolver::run_body(Op op, std::uint32_t row) {
  if (op == kKick) return group_.kick(row, dt_);
  if (op == kDrift) return group_.drift(row, dt_);
  group_.finish(row);
}

void PgsSolver::run_contact(Op op, PointContact& c) {
  Row& row = rows_[static_cast<std::size_t>(&c - group_.contacts.data())];
  switch (op) {
    case kPrepare:
      return prepare(c, row);
    case kWarmStart:
      return warm_start(c);
    case kIterate:
      solve_friction(c, row);
      solve_normals(c, row);
      if (settings_.correction == PositionCorrection::split_impulse) solve_overlap(c, row);
      return;
    case kRestitute:
      return restitute(c, row);
    default:
      return store(c);
  }
}

void PgsSolver::prepare(PointContact& c, Row& row) const {
  const double most = group_.step().settings->solver.max_push_velocity;
  const bool split = settings_.correction == PositionCorrection::split_impulse;
  for (std::uint32_t i = 0; i < c.count; ++i) {
    const Vec3& arm = c.points[i];
    row.mass[i] = inverse_or_zero(group_.response(c, arm, arm - c.offset, c.normal, c.normal));
    const double s = c.separation[i];
    const double push =
        std::min(most, settings_.correction_rate / dt_ * std::max(0.0, -s - settings_.slop));
    row.bias[i] = s > 0 ? -s / dt_ : (split ? 0 : push);
    row.push_speed[i] = split ? push : 0;
    row.push_mass_impulse[i] = 0;
  }
  const auto responses = [](const auto& response, const Vec3& t1, const Vec3& t2, double* k) {
    k[0] = response(t1, t1);
    k[1] = response(t1, t2);
    k[2] = response(t2, t2);
  };
  responses([&](const Vec3& in,
                const Vec3& out) { return group_.response(c, c.arm_a, c.arm_b, in, out); },
            c.t1, c.t2, row.slide);
  const Mat3 spin = group_.bodies[c.row_a].inv_inertia + group_.bodies[c.row_b].inv_inertia;
  responses([&](const Vec3& in, const Vec3& out) { return out.dot(spin * in); }, c.t1, c.t2,
            row.roll);
  row.twist = inverse_or_zero(c.normal.dot(spin * c.normal));
  if (c.count < 2) c.twist = 0;
}

void PgsSolver::warm_start(PointContact& c) {
  for (std::uint32_t i = 0; i < c.count; ++i) {
    if (c.impulse[i] > 0)
      group_.push(c, c.points[i], c.points[i] - c.offset, c.impulse[i] * c.normal);
  }
  group_.push(c, c.arm_a, c.arm_b, c.slide[0] * c.t1 + c.slide[1] * c.t2);
  group_.twist(c, c.twist * c.normal + c.roll[0] * c.t1 + c.roll[1] * c.t2);
}

void PgsSolver::solve_friction(PointContact& c, const Row& row) {
  const double total = sum_of(c);
  const Vec3 v = group_.velocity_at(c, c.arm_a, c.arm_b);
  const double old[2] = {c.slide[0], c.slide[1]};
  limit_to_disc(row.slide[0], row.slide[1], row.slide[2], c.friction * total, c.t1.dot(v),
                c.t2.dot(v), c.slide);
  group_.push(c, c.arm_a, c.arm_b, (c.slide[0] - old[0]) * c.t1 + (c.slide[1] - old[1]) * c.t2);
  if (c.count > 1) {
    double limit = 0;
    for (std::uint32_t i = 0; i < c.count; ++i) limit += c.friction * c.lever[i] * c.impulse[i];
    const Vec3 spin = group_.bodies[c.row_b].angular - group_.bodies[c.row_a].angular;
    const double twist = std::clamp(c.twist - row.twist * c.normal.dot(spin), -limit, limit);
    group_.twist(c, (twist - c.twist) * c.normal);
    c.twist = twist;
  }
  if (c.rolling > 0) {
    const Vec3 spin = group_.bodies[c.row_b].angular - group_.bodies[c.row_a].angular;
    const double before[2] = {c.roll[0], c.roll[1]};
    limit_to_disc(row.roll[0], row.roll[1], row.roll[2], c.rolling * total, c.t1.dot(spin),
                  c.t2.dot(spin), c.roll);
    group_.twist(c, (c.roll[0] - before[0]) * c.t1 + (c.roll[1] - before[1]) * c.t2);
  }
}

void PgsSolver::solve_normals(PointContact& c, Row& row) {
  for (std::uint32_t i = 0; i < c.count; ++i) {
    const Vec3 &arm_a = c.points[i], arm_b = arm_a - c.offset;
    const double speed = c.normal.dot(group_.velocity_at(c, arm_a, arm_b));
    const double impulse = std::max(0.0, c.impulse[i] + row.mass[i] * (row.bias[i] - speed));
    if (impulse != c.impulse[i]) group_.push(c, arm_a, arm_b, (impulse - c.impulse[i]) * c.normal);
    c.impulse[i] = impulse;
  }
}

void PgsSolver::solve_overlap(PointContact& c, Row& row) {
  PointBody &a = group_.bodies[c.row_a], &b = group_.bodies[c.row_b];
  for (std::uint32_t i = 0; i < c.count; ++i) {
    if (row.push_speed[i] <= 0) continue;
    const Vec3 &arm_a = c.points[i], arm_b = arm_a - c.offset;
    const double speed = c.normal.dot(b.correction_linear + b.correction_angular.cross(arm_b) -
                                      a.correction_linear - a.correction_angular.cross(arm_a));
    const double impulse =
        std::max(0.0, row.push_mass_impulse[i] + row.mass[i] * (row.push_speed[i] - speed));
    const Vec3 given = (impulse - row.push_mass_impulse[i]) * c.normal;
    row.push_mass_impulse[i] = impulse;
    if (a.solved) {
      a.correction_linear -= a.inv_mass.cwiseProduct(given);
      a.correction_angular -= a.inv_inertia * arm_a.cross(given);
    }
    if (b.solved) {
      b.correction_linear += b.inv_mass.cwiseProduct(given);
      b.correction_angular += b.inv_inertia * arm_b.cross(given);
    }
  }
}

void PgsSolver::restitute(PointContact& c, const Row& row) {
  for (std::uint32_t i = 0; i < c.count; ++i) c.total += c.impulse[i];
  if (c.restitution <= 0) return;
  const double threshold = group_.step().settings->solver.restitution_threshold;
  for (std::uint32_t i = 0; i < c.count; ++i) {
    if (c.impulse[i] <= 0 || c.start_speed[i] >= -threshold) continue;
    const Vec3 &arm_a = c.points[i], arm_b = arm_a - c.offset;
    const double speed = c.normal.dot(group_.velocity_at(c, arm_a, arm_b));
    const double more = std::max(0.0, row.mass[i] * (-c.restitution * c.start_speed[i] - speed));
    group_.push(c, arm_a, arm_b, more * c.normal);
    c.total += more;
  }
}

void PgsSolver::store(PointContact& c) {
  double gap[4] = {};
  for (std::uint32_t i = 0; i < c.count; ++i) {
    const Vec3& arm = c.points[i];
    gap[i] = c.separation[i] + dt_ * c.normal.dot(group_.velocity_at(c, arm, arm - c.offset));
  }
  group_.store(c, gap, dt_);
}

}  // namespace skerry::solver
