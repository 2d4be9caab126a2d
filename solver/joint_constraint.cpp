#include "solver/joint_constraint.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "core/trig.h"

namespace skerry::solver {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Pivots below this part of their row's own inverse mass are what rounding left of nothing.
constexpr double kLostPivot = 1e-9;

constexpr double kFastestPull = 20;  // m/s or rad/s

struct Side {
  V3d linear, angular, inv_mass;
  Sym3d inv_inertia;
};
Side load(JointBodies& bodies, std::uint32_t row) {
  const JointBody& body = bodies.load(row);
  return {body.linear, body.angular, body.inv_mass, body.inv_inertia};
}

double speed(const JointRow& row, const Side& a, const Side& b) {
  return dot(row.linear, b.linear - a.linear) +
         (dot(row.angular_b, b.angular) - dot(row.angular_a, a.angular));
}
[[gnu::always_inline]] inline void apply(const JointRow& row, double impulse, Side& a, Side& b) {
  const V3d push = row.linear * impulse;
  a.linear = a.linear - scaled(a.inv_mass, push);
  b.linear = b.linear + scaled(b.inv_mass, push);
  a.angular = a.angular - a.inv_inertia * (row.angular_a * impulse);
  b.angular = b.angular + b.inv_inertia * (row.angular_b * impulse);
}

double rate_before(const JointBodies& bodies, const JointConstraint& c, const JointRow& row) {
  const JointVelocity &a = bodies.before_kick(c.row_a), &b = bodies.before_kick(c.row_b);
  return dot(row.linear, b.linear - a.linear) +
         (dot(row.angular_b, b.angular) - dot(row.angular_a, a.angular));
}

// A row times the inverse mass of both bodies.
struct Response {
  V3d linear, angular_a, angular_b;
};
Response response(const JointRow& row, const JointBody& a, const JointBody& b) {
  return {scaled(a.inv_mass + b.inv_mass, row.linear), a.inv_inertia * row.angular_a,
          b.inv_inertia * row.angular_b};
}
double coupling(const JointRow& row, const Response& r) {
  return dot(row.linear, r.linear) +
         (dot(row.angular_a, r.angular_a) + dot(row.angular_b, r.angular_b));
}

void factorise_locks(std::span<const JointRow> locks, const JointBody& a, const JointBody& b,
                     BlockFactor& factor) {
  double k[kMaxLocks][kMaxLocks], scale[kMaxLocks];
  const int n = static_cast<int>(locks.size());
  for (int j = 0; j < n; ++j) {
    const Response r = response(locks[static_cast<std::size_t>(j)], a, b);
    for (int i = j; i < n; ++i) k[i][j] = coupling(locks[static_cast<std::size_t>(i)], r);
    scale[j] = k[j][j];
  }
  factorise(k, scale, n, kLostPivot, factor);
}

// Takes out of an axis what the locks answer, and finds its effective mass.
void clear_of_locks(std::span<const JointRow> locks, const BlockFactor& factor, const JointBody& a,
                    const JointBody& b, JointAxisState& axis) {
  const Response raw = response(axis.row, a, b);
  const double bare = coupling(axis.row, raw);
  double answer[kMaxLocks];
  for (std::size_t i = 0; i < locks.size(); ++i) answer[i] = coupling(locks[i], raw);
  solve_factored(factor, static_cast<int>(locks.size()), answer);
  for (std::size_t i = 0; i < locks.size(); ++i) {
    axis.row.linear = axis.row.linear - locks[i].linear * answer[i];
    axis.row.angular_a = axis.row.angular_a - locks[i].angular_a * answer[i];
    axis.row.angular_b = axis.row.angular_b - locks[i].angular_b * answer[i];
  }
  const double k = coupling(axis.row, response(axis.row, a, b));
  axis.mass = k > kLostPivot * bare ? 1 / k : 0.0;
}

// How the rate of a translation changes by itself: the centripetal accelerations of the anchors,
// and for coordinates that a carries along the Coriolis term; half a substep of it.
struct Drift {
  V3d fixed, carried;  // m/s^2, of b's anchor from a's
  V3d velocity;        // m/s, of b's anchor from a's
  double half_h;
};
Drift drift_of(const JointGeometry& g, const JointBody& a, const JointBody& b, double h) {
  const V3d arm_a = g.arm_a - g.offset;
  const V3d of_b = cross(b.angular, cross(b.angular, g.arm_b));
  Drift d;
  d.velocity = (b.linear + cross(b.angular, g.arm_b)) - (a.linear + cross(a.angular, arm_a));
  d.fixed = of_b - cross(a.angular, cross(a.angular, arm_a));
  const V3d in_a = d.velocity - cross(a.angular, g.offset);
  d.carried = (of_b - cross(a.angular, cross(a.angular, g.arm_a))) - cross(a.angular, in_a) * 2.0;
  d.half_h = 0.5 * h;
  return d;
}
double along(const Drift& d, const JointGeometry& g, JointCoordinate coordinate,
             const JointRow& row) {
  if (is_angular(coordinate)) return 0;
  double rate = 0;
  if (coordinate == JointCoordinate::distance) {
    const double distance = std::max(length(g.offset), 1e-9);
    const V3d across = d.velocity - row.linear * dot(row.linear, d.velocity);
    rate = dot(row.linear, d.fixed) + dot(across, across) / distance;
  } else {
    rate = dot(row.linear, d.carried);
  }
  return std::clamp(d.half_h * rate, -kFastestPull, kFastestPull);
}

// e^-x for x >= 0: Taylor series of x / 2^n, squared n times.
double decay(double x) {
  int halvings = 0;
  for (; x > 0.25 && halvings < 60; ++halvings) x *= 0.5;
  double sum = 1;
  for (int n = 12; n > 0; --n) sum = 1 - sum * x / n;
  for (; halvings > 0; --halvings) sum *= sum;
  return sum;
}

// A spring over a substep of kick and drift. Between substeps its position is that of the damped
// oscillator exactly, at rest its stretch is right under any load, and two half kicks make a whole one
// (docs/joints.md). Where it is stiff for the substep it is damped, so that coupled springs are stable.
void set_spring(double frequency, double damping_ratio, double distance, double rate_before,
                const JointPass& pass, JointLawState& law) {
  const double omega = 2 * kPi * std::min(frequency, 0.25 / pass.h);
  const double u = omega * pass.h, y = damping_ratio * u;
  const double square = u * u - y * y;
  const double turn = std::sqrt(std::abs(square));
  const double trace =
      square >= 0 ? 2 * decay(y) * core::trig::cos(turn) : decay(y - turn) + decay(y + turn);
  const double slow = 1 / (1 + (u * u) * (u * u) * (u * u));
  const double kept = slow * decay(2 * y);  // of the velocity before the substep
  const double passed = slow * (1 - trace + decay(2 * y)) / (u * u);  // of what others change it by
  const double root = std::sqrt(kept);
  const bool half = pass.kick < 1;
  const double p = half ? 2 * passed / (1 + root) : passed;
  law.keep = law.mass_scale = 1 - p;
  law.push = p * omega * u * pass.kick * distance - ((half ? root : kept) - p) * rate_before;
}

// An angle with limits is the one nearest to their middle.
double value_at_limits(const core::DrivenAxis& desc, double value) {
  const JointLimits& limits = desc.limits;
  if (!is_angular(desc.coordinate)) return value;
  const double middle = limits.lower && limits.upper ? 0.5 * (*limits.lower + *limits.upper) : 0.0;
  return within_turn(value, middle);
}

// Whether a hard limit is reached and the motor pushes towards it: neither moves anything then.
bool stands_at_limit(const core::DrivenAxis& desc, double value) {
  const JointLimits& limits = desc.limits;
  const double target = desc.drive.motor.target;
  if (limits.frequency > 0 || (!limits.lower && !limits.upper)) return false;
  const double at = value_at_limits(desc, value);
  return (limits.upper && at >= *limits.upper && target > 0) ||
         (limits.lower && at <= *limits.lower && target < 0);
}

void set_motor(const core::DrivenAxis& desc, const JointPass& pass, const JointAxisState& axis,
               JointLawState& law) {
  const JointMotor& motor = desc.drive.motor;
  const bool angular = is_angular(desc.coordinate);
  law.hi = motor.max_force * (pass.h * pass.kick);
  law.lo = -law.hi;
  if (motor.mode == JointMotorMode::velocity) {
    if (stands_at_limit(desc, axis.value)) law.lo = law.hi = 0;
    law.keep = law.mass_scale = 1;
    law.push = -motor.target;
  } else {
    const double distance =
        angular ? within_turn(axis.value - motor.target, 0) : axis.value - motor.target;
    set_spring(motor.frequency, motor.damping_ratio, distance, axis.rate_before, pass, law);
  }
}

// `past`: value less bound. A bound that is not reached may be closed in on within the substep, but
// not passed; softness acts where it is passed.
void set_limit(const JointLimits& limits, double past, bool passed, const JointAxisState& axis,
               const JointPass& pass, JointLawState& law) {
  if (!passed) {
    law.keep = law.mass_scale = 1;
    law.push = past * pass.inv_h + axis.drift;
  } else if (limits.frequency > 0) {
    if (pass.use_bias)
      set_spring(limits.frequency, limits.damping_ratio, past, axis.rate_before, pass, law);
  } else if (pass.use_bias) {
    law.keep = pass.keep;
    law.mass_scale = pass.mass_scale;
    law.push = pass.mass_scale * pass.bias_rate * past + axis.drift;
  } else {
    law.keep = law.mass_scale = 1;
    law.push = 0;
  }
}

void set_drives(const core::DrivenAxis& desc, const JointPass& pass, JointAxisState& axis) {
  const bool angular = is_angular(desc.coordinate);
  if (auto& law = axis.law[core::kSpring]; law.active) {
    const JointSpring& spring = desc.drive.spring;
    const double distance =
        angular ? within_turn(axis.value - spring.rest, 0) : axis.value - spring.rest;
    set_spring(spring.frequency, spring.damping_ratio, distance, axis.rate_before, pass, law);
    law.lo = -kInfinity;
    law.hi = kInfinity;
  }
  if (auto& law = axis.law[core::kMotor]; law.active) {
    set_motor(desc, pass, axis, law);
  }
  if (auto& law = axis.law[core::kFriction]; law.active) {
    law.hi = desc.drive.friction * (pass.h * pass.kick);
    law.lo = -law.hi;
  }
}

void set_limits(const core::DrivenAxis& desc, const JointPass& pass, JointAxisState& axis) {
  const JointLimits& limits = desc.limits;
  if (!limits.lower && !limits.upper) return;
  const double value = value_at_limits(desc, axis.value);
  if (auto& law = axis.law[core::kLower]; law.active) {
    law.hi = kInfinity;
    set_limit(limits, value - *limits.lower, value <= *limits.lower, axis, pass, law);
  }
  if (auto& law = axis.law[core::kUpper]; law.active) {
    law.lo = -kInfinity;
    set_limit(limits, value - *limits.upper, value >= *limits.upper, axis, pass, law);
  }
}

// Trees pull all the way in one substep, but a joint that is far apart no faster than this.
double lock_error(const core::Joint& joint, std::size_t i, const JointGeometry& g,
                  const JointPass& pass) {
  const bool distance = joint.locks[i] == JointCoordinate::distance;
  const double error = value_of(g, joint.locks[i]) - (distance ? joint.length : 0);
  const double most = kFastestPull * pass.h;
  return std::clamp(error, -most, most);
}

std::span<JointRow> locks_of(const JointArrays& arrays, const JointConstraint& c) {
  return arrays.locks.subspan(c.first_lock, c.lock_count);
}
std::span<JointAxisState> axes_of(const JointArrays& arrays, const JointConstraint& c) {
  return arrays.axes.subspan(c.first_axis, c.axis_count);
}

void solve_law(const JointRow& row, double mass, JointLawState& law, Side& a, Side& b,
               JointConstraint& c) {
  const double wanted =
      law.keep * law.impulse - mass * (law.mass_scale * speed(row, a, b) + law.push);
  const double now = std::clamp(wanted, law.lo, law.hi);
  const double change = now - law.impulse;
  law.impulse = now;
  apply(row, change, a, b);
  book(c, row, change);
}

// A motor without bound and a limit that push against each other would do so ever harder: what they
// only do to each other is taken back. The sum, which moves the bodies, stays.
void part_opponents(JointAxisState& axis) {
  JointLawState& motor = axis.law[core::kMotor];
  if (!motor.active || motor.keep < 1) return;
  for (const core::JointLaw limit : {core::kLower, core::kUpper}) {
    double& against = axis.law[limit].impulse;
    if (motor.impulse * against >= 0) continue;
    const double sum = motor.impulse + against;
    const bool motor_wins = std::abs(motor.impulse) > std::abs(against);
    motor.impulse = motor_wins ? sum : 0;
    against = motor_wins ? 0 : sum;
  }
}

void solve_locks(const JointPass& pass, std::span<const JointRow> locks, Side& a, Side& b,
                 JointConstraint& c) {
  double x[kMaxLocks];
  const int n = c.lock_count;
  const double scale = pass.use_bias ? pass.mass_scale : 1, keep = pass.use_bias ? pass.keep : 1;
  for (int i = 0; i < n; ++i) {
    x[i] = speed(locks[static_cast<std::size_t>(i)], a, b) +
           (pass.use_bias ? pass.bias_rate * c.error[i] + c.drift[i] : 0.0);
  }
  solve_factored(c.factor, n, x);
  for (int i = 0; i < n; ++i) {
    const double change = (keep - 1) * c.impulse[i] - scale * x[i];
    c.impulse[i] += change;
    apply(locks[static_cast<std::size_t>(i)], change, a, b);
    book(c, locks[static_cast<std::size_t>(i)], change);
  }
}

}  // namespace

void refresh(const core::Joint& joint, const JointPass& pass, const JointArrays& arrays,
             JointConstraint& c) {
  const JointBody& a = arrays.bodies.load(c.row_a);
  const JointBody& b = arrays.bodies.load(c.row_b);
  const JointGeometry g = joint_geometry(c.mounts, a.pose, b.pose, c.with_angles);
  const Drift drift = drift_of(g, a, b, pass.h);
  const std::span<JointRow> locks = locks_of(arrays, c);
  c.arm_b = g.arm_b;
  for (std::size_t i = 0; i < locks.size(); ++i) {
    const JointCoordinate coordinate = joint.locks[i];
    locks[i] = row_of(g, coordinate);
    c.error[i] = lock_error(joint, i, g, pass);
    c.drift[i] = along(drift, g, coordinate, locks[i]);
  }
  if (!c.in_tree || c.axis_count > 0) factorise_locks(locks, a, b, c.factor);
  const std::span<JointAxisState> axes = axes_of(arrays, c);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const core::DrivenAxis& desc = joint.axes[i];
    axes[i].row = row_of(g, desc.coordinate);
    axes[i].value = value_of(g, desc.coordinate);
    axes[i].drift = along(drift, g, desc.coordinate, axes[i].row);
    clear_of_locks(locks, c.factor, a, b, axes[i]);
    if (pass.use_bias) axes[i].rate_before = rate_before(arrays.bodies, c, axes[i].row);
    if (pass.use_bias) set_drives(desc, pass, axes[i]);
    set_limits(desc, pass, axes[i]);
  }
}

void look_ahead(const core::Joint& joint, const JointPass& pass, JointBodies& bodies,
                JointConstraint& c) {
  const JointGeometry g = joint_geometry(c.mounts, bodies.pose_after(c.row_a, pass.h),
                                         bodies.pose_after(c.row_b, pass.h), c.with_angles);
  for (std::size_t i = 0; i < c.lock_count; ++i) c.error[i] = lock_error(joint, i, g, pass);
}

void restart_drives(const core::Joint& joint, const JointPass& pass, const JointArrays& arrays,
                    JointConstraint& c) {
  const std::span<JointAxisState> axes = axes_of(arrays, c);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i].rate_before = rate_before(arrays.bodies, c, axes[i].row);
    set_drives(joint.axes[i], pass, axes[i]);
  }
}

bool is_active(const core::DrivenAxis& axis, core::JointLaw law) {
  switch (law) {
    case core::kSpring:
      return axis.drive.spring.frequency > 0;
    case core::kMotor:
      return axis.drive.motor.mode != JointMotorMode::off && axis.drive.motor.max_force > 0;
    case core::kFriction:
      return axis.drive.friction > 0;
    case core::kLower:
      return axis.limits.lower.has_value();
    default:
      return axis.limits.upper.has_value();
  }
}

void warm_start(const JointArrays& arrays, JointConstraint& c, double scale) {
  Side a = load(arrays.bodies, c.row_a), b = load(arrays.bodies, c.row_b);
  for (JointAxisState& axis : axes_of(arrays, c)) {
    double sum = 0;
    for (JointLawState& law : axis.law) {
      law.impulse = std::clamp(law.impulse * scale, law.lo, law.hi);
      sum += law.impulse;
    }
    apply(axis.row, sum, a, b);
    book(c, axis.row, sum);
  }
  if (!c.in_tree) {
    const std::span<JointRow> locks = locks_of(arrays, c);
    for (std::size_t i = 0; i < locks.size(); ++i) {
      c.impulse[i] *= scale;
      apply(locks[i], c.impulse[i], a, b);
      book(c, locks[i], c.impulse[i]);
    }
  }
  arrays.bodies.store(c.row_a, a.linear, a.angular);
  arrays.bodies.store(c.row_b, b.linear, b.angular);
}

void solve(const JointPass& pass, const JointArrays& arrays, JointConstraint& c) {
  Side a = load(arrays.bodies, c.row_a), b = load(arrays.bodies, c.row_b);
  for (JointAxisState& axis : axes_of(arrays, c)) {
    for (JointLawState& law : axis.law) {
      if (law.active) solve_law(axis.row, axis.mass, law, a, b, c);
    }
    part_opponents(axis);
  }
  if (!c.in_tree) solve_locks(pass, locks_of(arrays, c), a, b, c);
  arrays.bodies.store(c.row_a, a.linear, a.angular);
  arrays.bodies.store(c.row_b, b.linear, b.angular);
}

}  // namespace skerry::solver
