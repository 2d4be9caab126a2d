#include "solver/joint_solver.h"

#include <algorithm>
#include <cmath>

#include "core/trig.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;
using core::Joint;
using core::JointType;
using core::Q4f;
using core::Sym3f;
using core::V3f;

constexpr int kMaxRows = 5;
constexpr double kPi = 3.14159265358979323846;

Q4f operator*(const Q4f& a, const Q4f& b) {
  return {((a.w * b.x + a.x * b.w) + a.y * b.z) - a.z * b.y,
          ((a.w * b.y + a.y * b.w) + a.z * b.x) - a.x * b.z,
          ((a.w * b.z + a.z * b.w) + a.x * b.y) - a.y * b.x,
          ((a.w * b.w - a.x * b.x) - a.y * b.y) - a.z * b.z};
}

V3f rotate(const Q4f& q, const V3f& v) {
  const V3f u = {q.x, q.y, q.z};
  const V3f t = cross(u, v) * 2.0f;
  return (v + t * q.w) + cross(u, t);
}

// L D L^T of a symmetric positive semidefinite matrix; a direction without stiffness (pivot lost in
// rounding) gets inv_d = 0 and takes no part in solutions.
struct Factor {
  float l[kMaxRows][kMaxRows];
  float inv_d[kMaxRows];
};

void factorise(const float (&k)[kMaxRows][kMaxRows], int n, Factor& f) {
  for (int i = 0; i < n; ++i) {
    float scaled[kMaxRows];  // l_ij d_j
    float pivot = k[i][i];
    for (int j = 0; j < i; ++j) {
      float s = k[i][j];
      for (int m = 0; m < j; ++m) s -= scaled[m] * f.l[j][m];
      scaled[j] = s;
      f.l[i][j] = s * f.inv_d[j];
      pivot -= s * f.l[i][j];
    }
    constexpr float kLost = 1e-6f;
    f.inv_d[i] = pivot > kLost * k[i][i] ? 1 / pivot : 0.0f;
  }
}

void solve_factored(const Factor& f, int n, float (&x)[kMaxRows]) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) x[i] -= f.l[i][j] * x[j];
  for (int i = 0; i < n; ++i) x[i] *= f.inv_d[i];
  for (int i = n - 1; i >= 0; --i)
    for (int j = i + 1; j < n; ++j) x[i] -= f.l[j][i] * x[j];
}

}  // namespace

struct JointConstraint {
  std::uint32_t joint;  // row of core::Joints
  std::uint32_t row_a, row_b;
  int rows;  // of the block: 3 of the common point, then 2 of the common axis for a hinge
  bool has_motor, has_lower, has_upper;

  // At the start of the step, world axes.
  V3f anchor_a0, anchor_b0;  // m, from the centres of mass
  V3f separation0;           // m, of b's anchor from a's
  Q4f frame_a0, frame_b0;    // the joint frame as each body carries it; axis = z
  float motor_speed, motor_max_impulse;
  float lower, upper, middle;  // rad; angles are taken within pi of the middle

  // Accumulated impulses: point (3), swing (2); the others about the axis.
  float impulse[kMaxRows];
  float motor_impulse, lower_impulse, upper_impulse;

  // At the present poses.
  V3f arm_a, arm_b;
  V3f swing_u, swing_v, axis;
  float error[kMaxRows];
  float angle;
  Factor factor;
  float axial_mass;  // kg m^2
};

namespace {

struct Side {
  V3f linear, angular;
  V3f inv_mass;  // per axis
  Sym3f inv_inertia;
};

V3f inv_mass_of(const MassRow& mass) {
  const float m = mass.inv_mass;
  return {mass.lock_flags & core::kLockX ? 0 : m, mass.lock_flags & core::kLockY ? 0 : m,
          mass.lock_flags & core::kLockZ ? 0 : m};
}

Side load(const SolverBodies& bodies, std::uint32_t row) {
  if (row == 0) return {};
  return {bodies.velocity[row].linear, bodies.velocity[row].angular, inv_mass_of(bodies.mass[row]),
          bodies.mass[row].inv_inertia};
}

void store_velocity(const SolverBodies& bodies, std::uint32_t row, const Side& side) {
  if (row == 0 || bodies.mass[row].inv_mass == 0) return;
  bodies.velocity[row].linear = side.linear;
  bodies.velocity[row].angular = side.angular;
}

V3f scaled(const V3f& a, const V3f& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

// Equal and opposite impulses of the block at the arms.
void apply_block(const JointConstraint& c, const float (&p)[kMaxRows], Side& a, Side& b) {
  const V3f push = {p[0], p[1], p[2]};
  V3f twist = {0, 0, 0};
  if (c.rows == 5) twist = c.swing_u * p[3] + c.swing_v * p[4];
  a.linear = a.linear - scaled(a.inv_mass, push);
  b.linear = b.linear + scaled(b.inv_mass, push);
  a.angular = a.angular - a.inv_inertia * (cross(c.arm_a, push) + twist);
  b.angular = b.angular + b.inv_inertia * (cross(c.arm_b, push) + twist);
}

void apply_axial(const JointConstraint& c, float p, Side& a, Side& b) {
  a.angular = a.angular - a.inv_inertia * (c.axis * p);
  b.angular = b.angular + b.inv_inertia * (c.axis * p);
}

void block_velocity(const JointConstraint& c, const Side& a, const Side& b, float (&v)[kMaxRows]) {
  const V3f point = (b.linear + cross(b.angular, c.arm_b)) - (a.linear + cross(a.angular, c.arm_a));
  const V3f turning = b.angular - a.angular;
  v[0] = point.x;
  v[1] = point.y;
  v[2] = point.z;
  v[3] = dot(c.swing_u, turning);
  v[4] = dot(c.swing_v, turning);
}

// Angular parts of the rows on one body: arm x unit axes, then the swing axes.
void angular_rows(const JointConstraint& c, const V3f& arm, V3f (&rows)[kMaxRows]) {
  rows[0] = {0, arm.z, -arm.y};
  rows[1] = {-arm.z, 0, arm.x};
  rows[2] = {arm.y, -arm.x, 0};
  rows[3] = c.swing_u;
  rows[4] = c.swing_v;
}

void add_angular(const JointConstraint& c, const V3f& arm, const Sym3f& inv_inertia,
                 float (&k)[kMaxRows][kMaxRows]) {
  V3f rows[kMaxRows];
  angular_rows(c, arm, rows);
  for (int j = 0; j < c.rows; ++j) {
    const V3f moved = inv_inertia * rows[j];
    for (int i = j; i < c.rows; ++i) k[i][j] += dot(rows[i], moved);
  }
}

void factorise_block(JointConstraint& c, const Side& a, const Side& b) {
  float k[kMaxRows][kMaxRows] = {};
  add_angular(c, c.arm_a, a.inv_inertia, k);
  add_angular(c, c.arm_b, b.inv_inertia, k);
  k[0][0] += a.inv_mass.x + b.inv_mass.x;
  k[1][1] += a.inv_mass.y + b.inv_mass.y;
  k[2][2] += a.inv_mass.z + b.inv_mass.z;
  factorise(k, c.rows, c.factor);
}

// Angle about z of a relative rotation, rad in (-pi, pi] (within pi of zero).
float twist_of(const Q4f& q) {
  return q.w < 0 ? 2 * core::trig::atan2(-q.z, -q.w) : 2 * core::trig::atan2(q.z, q.w);
}

void present_axes(JointConstraint& c, const Q4f& turn_a, const Q4f& turn_b, const Side& a,
                  const Side& b) {
  const Q4f frame_a = turn_a * c.frame_a0, frame_b = turn_b * c.frame_b0;
  c.swing_u = rotate(frame_a, {1, 0, 0});
  c.swing_v = rotate(frame_a, {0, 1, 0});
  c.axis = rotate(frame_a, {0, 0, 1});
  const V3f tilt = cross(c.axis, rotate(frame_b, {0, 0, 1}));
  c.error[3] = dot(c.swing_u, tilt);
  c.error[4] = dot(c.swing_v, tilt);
  const float k = dot(c.axis, a.inv_inertia * c.axis) + dot(c.axis, b.inv_inertia * c.axis);
  c.axial_mass = k > 0 ? 1 / k : 0.0f;
  if (!c.has_lower && !c.has_upper) return;
  const Q4f inverse_a = {-frame_a.x, -frame_a.y, -frame_a.z, frame_a.w};
  c.angle = twist_of(inverse_a * frame_b);
  constexpr float kTurn = static_cast<float>(2 * kPi);
  if (c.angle > c.middle + kTurn / 2) c.angle -= kTurn;
  if (c.angle < c.middle - kTurn / 2) c.angle += kTurn;
}

// Arms, axes, errors and effective masses at the present poses.
void refresh(const SolverBodies& bodies, JointConstraint& c) {
  static constexpr DeltaRow kStill = {{0, 0, 0}, 0, {0, 0, 0, 1}};
  const DeltaRow& da = c.row_a ? bodies.delta[c.row_a] : kStill;
  const DeltaRow& db = c.row_b ? bodies.delta[c.row_b] : kStill;
  const Side a = load(bodies, c.row_a), b = load(bodies, c.row_b);
  c.arm_a = rotate(da.rotation, c.anchor_a0);
  c.arm_b = rotate(db.rotation, c.anchor_b0);
  const V3f moved =
      (db.translation - da.translation) + ((c.arm_b - c.anchor_b0) - (c.arm_a - c.anchor_a0));
  const V3f separation = c.separation0 + moved;
  c.error[0] = separation.x;
  c.error[1] = separation.y;
  c.error[2] = separation.z;
  if (c.rows == 5) present_axes(c, da.rotation, db.rotation, a, b);
  factorise_block(c, a, b);
}

float axial_speed(const JointConstraint& c, const Side& a, const Side& b) {
  return dot(c.axis, b.angular - a.angular);
}

void solve_motor(JointConstraint& c, Side& a, Side& b) {
  const float wanted = c.motor_impulse - c.axial_mass * (axial_speed(c, a, b) - c.motor_speed);
  const float now = std::clamp(wanted, -c.motor_max_impulse, c.motor_max_impulse);
  apply_axial(c, now - c.motor_impulse, a, b);
  c.motor_impulse = now;
}

// Softness of one solve: of the pass with bias, or rigid.
struct Pass {
  float bias_rate, mass_scale, impulse_scale;
  bool use_bias;
};

// `room` >= 0: how far the limit is; `side` +1 for the lower limit, -1 for the upper. A limit that
// is not reached may be closed in on, but not passed, within the substep.
void solve_limit(const JointConstraint& c, const Pass& pass, float room, float side, float inv_dt,
                 float& impulse, Side& a, Side& b) {
  float bias = 0, mass_scale = 1, impulse_scale = 0;
  if (room > 0) {
    bias = room * inv_dt;
  } else if (pass.use_bias) {
    bias = room * pass.bias_rate;
    mass_scale = pass.mass_scale;
    impulse_scale = pass.impulse_scale;
  }
  const float speed = side * axial_speed(c, a, b);
  const float change = -c.axial_mass * mass_scale * (speed + bias) - impulse_scale * impulse;
  const float now = std::max(impulse + change, 0.0f);
  apply_axial(c, side * (now - impulse), a, b);
  impulse = now;
}

void solve_block(JointConstraint& c, const Pass& pass, Side& a, Side& b) {
  float x[kMaxRows];
  block_velocity(c, a, b, x);
  for (int i = 0; i < c.rows; ++i) x[i] += pass.bias_rate * c.error[i];
  solve_factored(c.factor, c.rows, x);
  float change[kMaxRows] = {};
  for (int i = 0; i < c.rows; ++i) {
    change[i] = -pass.mass_scale * x[i] - pass.impulse_scale * c.impulse[i];
    c.impulse[i] += change[i];
  }
  apply_block(c, change, a, b);
}

Q4f frame_in_world(const Quat& orientation, const Quat& frame) {
  return core::to_float(Quat(orientation * frame));
}

void set_up_axis(const Joint& joint, const core::BodyPose& a, const core::BodyPose& b, float dt,
                 JointConstraint& c) {
  c.frame_a0 = frame_in_world(a.orientation, joint.frame_a);
  c.frame_b0 = frame_in_world(b.orientation, joint.frame_b);
  c.has_motor = joint.motor_max_torque > 0;
  c.motor_speed = static_cast<float>(joint.motor_speed);
  c.motor_max_impulse = static_cast<float>(joint.motor_max_torque) * dt;
  c.has_lower = joint.has_lower;
  c.has_upper = joint.has_upper;
  c.lower = static_cast<float>(joint.lower);
  c.upper = static_cast<float>(joint.upper);
  c.middle = c.has_lower && c.has_upper ? 0.5f * (c.lower + c.upper) : 0;
  c.impulse[3] = joint.angular_impulse[0];
  c.impulse[4] = joint.angular_impulse[1];
  c.motor_impulse = c.has_motor ? joint.angular_impulse[2] : 0;
  c.lower_impulse = c.has_lower ? joint.lower_impulse : 0;
  c.upper_impulse = c.has_upper ? joint.upper_impulse : 0;
}

JointConstraint set_up(const core::StepContext& step, std::uint32_t row,
                       const std::uint32_t* row_of, float dt) {
  const Joint& joint = step.joints->rows[row];
  const core::BodyPose& a = step.bodies->pose[joint.a];
  const core::BodyPose& b = step.bodies->pose[joint.b];
  JointConstraint c = {};
  c.joint = row;
  c.row_a = row_of[joint.a];
  c.row_b = row_of[joint.b];
  c.rows = joint.type == JointType::hinge ? 5 : 3;
  const Vec3 arm_a = a.orientation * joint.anchor_a, arm_b = b.orientation * joint.anchor_b;
  c.anchor_a0 = core::to_float(arm_a);
  c.anchor_b0 = core::to_float(arm_b);
  c.separation0 = core::to_float(Vec3((b.center - a.center) + (arm_b - arm_a)));
  c.impulse[0] = joint.linear_impulse.x;
  c.impulse[1] = joint.linear_impulse.y;
  c.impulse[2] = joint.linear_impulse.z;
  if (c.rows == 5) set_up_axis(joint, a, b, dt, c);
  return c;
}

void warm_start_joint(const SolverBodies& bodies, JointConstraint& c) {
  refresh(bodies, c);
  Side a = load(bodies, c.row_a), b = load(bodies, c.row_b);
  apply_block(c, c.impulse, a, b);
  if (c.rows == 5) apply_axial(c, (c.motor_impulse + c.lower_impulse) - c.upper_impulse, a, b);
  store_velocity(bodies, c.row_a, a);
  store_velocity(bodies, c.row_b, b);
}

void solve_joint(const SolverBodies& bodies, const Pass& pass, float inv_dt, JointConstraint& c) {
  if (!pass.use_bias) refresh(bodies, c);
  Side a = load(bodies, c.row_a), b = load(bodies, c.row_b);
  if (c.has_motor) solve_motor(c, a, b);
  if (c.has_lower) solve_limit(c, pass, c.angle - c.lower, 1, inv_dt, c.lower_impulse, a, b);
  if (c.has_upper) solve_limit(c, pass, c.upper - c.angle, -1, inv_dt, c.upper_impulse, a, b);
  solve_block(c, pass, a, b);
  store_velocity(bodies, c.row_a, a);
  store_velocity(bodies, c.row_b, b);
}

bool all_finite(const JointConstraint& c) {
  float sum = (c.motor_impulse + c.lower_impulse) + c.upper_impulse;
  for (const float p : c.impulse) sum += p;
  return std::isfinite(sum);
}

}  // namespace

JointBatch::JointBatch() = default;
JointBatch::~JointBatch() = default;
JointBatch::JointBatch(JointBatch&&) noexcept = default;
JointBatch& JointBatch::operator=(JointBatch&&) noexcept = default;

void JointBatch::prepare(const core::StepContext& step, std::span<const std::uint32_t> joints,
                         const SolverBodies&, const std::uint32_t* row_of, float substep_dt) {
  dt_ = substep_dt;
  inv_dt_ = 1 / substep_dt;
  const SolverSettings& solver = step.settings->solver;
  // Stiffer than half the substep rate would ring.
  const double hertz = std::min(solver.joint_hertz, 0.5 / double(substep_dt));
  const double omega = 2 * kPi * hertz, zeta = solver.joint_damping_ratio, h = double(substep_dt);
  const double a1 = 2 * zeta + h * omega, a2 = h * omega * a1, a3 = 1 / (1 + a2);
  soft_ = {static_cast<float>(omega / a1), static_cast<float>(a2 * a3), static_cast<float>(a3)};
  constraints_.clear();
  for (const std::uint32_t row : joints) constraints_.push_back(set_up(step, row, row_of, dt_));
}

void JointBatch::warm_start(const SolverBodies& bodies) {
  for (JointConstraint& c : constraints_) warm_start_joint(bodies, c);
}

void JointBatch::solve(const SolverBodies& bodies, bool use_bias) {
  const Pass pass = use_bias ? Pass{soft_.bias_rate, soft_.mass_scale, soft_.impulse_scale, true}
                             : Pass{0, 1, 0, false};
  for (JointConstraint& c : constraints_) solve_joint(bodies, pass, inv_dt_, c);
}

void JointBatch::store(const core::StepContext& step) {
  for (const JointConstraint& c : constraints_) {
    Joint& joint = step.joints->rows[c.joint];
    // A joint whose bodies went non-finite starts cold.
    const auto kept = [finite = all_finite(c)](float p) { return finite ? p : 0.0f; };
    joint.linear_impulse = {kept(c.impulse[0]), kept(c.impulse[1]), kept(c.impulse[2])};
    joint.angular_impulse[0] = kept(c.impulse[3]);
    joint.angular_impulse[1] = kept(c.impulse[4]);
    joint.angular_impulse[2] = kept(c.motor_impulse);
    joint.lower_impulse = kept(c.lower_impulse);
    joint.upper_impulse = kept(c.upper_impulse);
  }
}

bool JointBatch::empty() const { return constraints_.empty(); }

double hinge_angle(const Joint& joint, const core::Bodies& bodies) {
  const Quat a = bodies.pose[joint.a].orientation * joint.frame_a;
  const Quat b = bodies.pose[joint.b].orientation * joint.frame_b;
  const Quat q = a.conjugate() * b;
  const double angle =
      q.w() < 0 ? 2 * core::trig::atan2(-q.z(), -q.w()) : 2 * core::trig::atan2(q.z(), q.w());
  return angle <= -kPi ? kPi : angle;
}

}  // namespace skerry::solver
