#include "solver/penalty_solver.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/trig.h"

namespace skerry::solver {
namespace {

using namespace core;

enum : std::uint8_t { kPrepare, kPress, kMove, kStore, kFinish };

constexpr double kPi = std::numbers::pi;
constexpr double kSlowDamping = 0.7;  // damping ratio of what does not bounce

// A spring and dashpot with two components that slips at `limit`: the force, and the spring as long
// as that force says.
void slip(double stiffness, double damping, double limit, const double rate[2], double length[2],
          double force[2]) {
  for (int k = 0; k < 2; ++k) force[k] = -stiffness * length[k] - damping * rate[k];
  const double size = std::sqrt(force[0] * force[0] + force[1] * force[1]);
  if (size <= limit || stiffness <= 0) return;
  for (int k = 0; k < 2; ++k) {
    force[k] *= limit / size;
    length[k] = -(force[k] + damping * rate[k]) / stiffness;
  }
}

}  // namespace

double damping_ratio(double e) {
  if (e <= 0) return 1;
  const double log = trig::log(std::min(e, 1.0));
  return -log / std::sqrt(kPi * kPi + log * log);
}

void PenaltySolver::begin(const StepContext& step, const IslandGroup& group) {
  group_.begin(step, group);
  const PenaltySettings& settings = step.settings->solver.penalty;
  h_ = step.dt / settings.substeps;
  springs_.resize(std::max(springs_.size(), group_.contacts.size()));
  clear_phases();
  add_contacts(kPrepare);
  for (int i = 0; i < settings.substeps; ++i) {
    add_contacts(kPress);  // before the forces of this substep: at rest nothing then moves
    add_bodies(kMove);
  }
  add_contacts(kStore);
  add_bodies(kFinish);
}

void PenaltySolver::run_body(Op op, std::uint32_t row) {
  if (op == kFinish) return group_.finish(row);
  group_.kick(row, h_);
  group_.drift(row, h_);
}

void PenaltySolver::run_contact(Op op, PointContact& c) {
  Spring& spring = springs_[static_cast<std::size_t>(&c - group_.contacts.data())];
  if (op == kPrepare) return prepare(c, spring);
  if (op == kPress) return press(c, spring);
  store(c);
}

void PenaltySolver::prepare(PointContact& c, Spring& spring) const {
  const SolverSettings& settings = group_.step().settings->solver;
  const double omega = 2 * kPi * settings.penalty.hertz;
  // By the speed of its undamped swing, which lasts over several steps and stands still in between.
  double swing = 0;
  for (std::uint32_t i = 0; i < c.count; ++i) {
    const double depth = std::min(0.0, c.separation[i]) * omega;
    swing = std::max(swing, c.start_speed[i] * c.start_speed[i] + depth * depth);
  }
  const double threshold = settings.restitution_threshold;
  const bool bounces = c.restitution > 0 && swing > threshold * threshold;
  const double ratio = bounces ? damping_ratio(c.restitution) : kSlowDamping;
  const auto mass_along = [&](const Vec3& axis) {
    return inverse_or_zero(group_.response(c, c.arm_a, c.arm_b, axis, axis));
  };
  const Mat3 spin = group_.bodies[c.row_a].inv_inertia + group_.bodies[c.row_b].inv_inertia;
  const auto inertia_about = [&](const Vec3& axis) {
    return inverse_or_zero(axis.dot(spin * axis));
  };
  spring = {};
  const double mass = mass_along(c.normal) / c.count;
  spring.stiffness = mass * omega * omega;
  spring.damping = 2 * ratio * mass * omega;
  const auto set = [&](double& stiffness, double& damping, double inertia) {
    stiffness = inertia * omega * omega;
    damping = 2 * kSlowDamping * inertia * omega;
  };
  set(spring.shear, spring.shear_damping, std::min(mass_along(c.t1), mass_along(c.t2)));
  set(spring.turn, spring.turn_damping, inertia_about(c.normal));
  set(spring.bend, spring.bend_damping, std::min(inertia_about(c.t1), inertia_about(c.t2)));
  const auto length = [this](double impulse, double stiffness) {
    return stiffness > 0 ? -impulse / (stiffness * h_) : 0;
  };
  for (int k = 0; k < 2; ++k) {
    spring.slide[k] = length(c.slide[k], spring.shear);
    spring.roll[k] = length(c.roll[k], spring.bend);
  }
  spring.twist = length(c.twist, spring.turn);
}

// By how much a contact has opened at a point since the step began; turns to first order. (A ball
// turns about its centre, not about the place where it was touched.)
double PenaltySolver::opened(const PointContact& c, const Vec3& point) const {
  const PointBody &a = group_.bodies[c.row_a], &b = group_.bodies[c.row_b];
  return c.normal.dot(b.center + b.angle.cross(point - c.offset) - a.center - a.angle.cross(point));
}

// Arms of the place in the world where both sides are pushed: it goes along with the bodies.
void PenaltySolver::arms(const PointContact& c, const Vec3& point, Vec3& arm_a, Vec3& arm_b) const {
  const PointBody &a = group_.bodies[c.row_a], &b = group_.bodies[c.row_b];
  Vec3 shift = 0.5 * (a.center + b.center);
  if (!a.solved) shift = b.center;
  if (!b.solved) shift = a.center;
  arm_a = point + shift - a.center;
  arm_b = point - c.offset + shift - b.center;
}

// All forces of a contact come from one and the same state: those pushed first must not show in the
// rates of the others.
void PenaltySolver::press(PointContact& c, Spring& spring) {
  Vec3 center_a, center_b;
  arms(c, c.arm_a, center_a, center_b);
  const Vec3 v = group_.velocity_at(c, center_a, center_b);
  const Vec3 spin = group_.bodies[c.row_b].angular - group_.bodies[c.row_a].angular;
  double force = 0, moment = 0;
  for (std::uint32_t i = 0; i < c.count; ++i) {
    const double s = c.separation[i] + opened(c, c.points[i]);
    const double speed = c.normal.dot(v + spin.cross(c.points[i] - c.arm_a));
    const double push = s < 0 ? std::max(0.0, -spring.stiffness * s - spring.damping * speed) : 0;
    c.impulse[i] = h_ * push;
    c.total += c.impulse[i];
    force += push;
    moment += c.lever[i] * push;
  }
  for (std::uint32_t i = 0; i < c.count; ++i) {
    if (c.impulse[i] <= 0) continue;
    Vec3 arm_a, arm_b;
    arms(c, c.points[i], arm_a, arm_b);
    group_.push(c, arm_a, arm_b, c.impulse[i] * c.normal);
  }
  resist(c, spring, force, moment, v, spin);
  group_.push(c, center_a, center_b, c.slide[0] * c.t1 + c.slide[1] * c.t2);
}

void PenaltySolver::resist(PointContact& c, Spring& spring, double force, double moment,
                           const Vec3& v, const Vec3& spin) {
  const double slide_rate[2] = {c.t1.dot(v), c.t2.dot(v)};
  double given[2];
  for (int k = 0; k < 2; ++k) spring.slide[k] += h_ * slide_rate[k];
  slip(spring.shear, spring.shear_damping, c.friction * force, slide_rate, spring.slide, given);
  for (int k = 0; k < 2; ++k) c.slide[k] = h_ * given[k];

  if (c.count > 1) {
    const double rate[2] = {c.normal.dot(spin), 0};
    double length[2] = {spring.twist + h_ * rate[0], 0};
    slip(spring.turn, spring.turn_damping, c.friction * moment, rate, length, given);
    spring.twist = length[0];
    c.twist = h_ * given[0];
    group_.twist(c, c.twist * c.normal);
  }
  if (c.rolling > 0) {
    const double rate[2] = {c.t1.dot(spin), c.t2.dot(spin)};
    for (int k = 0; k < 2; ++k) spring.roll[k] += h_ * rate[k];
    slip(spring.bend, spring.bend_damping, c.rolling * force, rate, spring.roll, given);
    for (int k = 0; k < 2; ++k) c.roll[k] = h_ * given[k];
    group_.twist(c, c.roll[0] * c.t1 + c.roll[1] * c.t2);
  }
}

void PenaltySolver::store(PointContact& c) {
  double gap[4] = {};
  for (std::uint32_t i = 0; i < c.count; ++i) gap[i] = c.separation[i] + opened(c, c.points[i]);
  group_.store(c, gap, h_);
}

}  // namespace skerry::solver
