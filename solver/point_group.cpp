#include "solver/point_group.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"
#include "solver/fast_watch.h"
#include "solver/forces.h"
#include "solver/free_flight.h"
#include "solver/rotation.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {
namespace {

using namespace core;

Vec3 across(const Vec3& n) {
  const Vec3 t = n.x() * n.x() < 1.0 / 3 ? Vec3(0, n.z(), -n.y()) : Vec3(n.y(), -n.x(), 0);
  return t / t.norm();
}

bool is_finite(const Vec3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

}  // namespace

void PointGroup::begin(const StepContext& step, const IslandGroup& group) {
  step_ = &step;
  grain_ = group.kind == GroupKind::wide ? kGrain : 0x7fffffff;
  const Islands& islands = *step.islands;
  const Island& first = islands.islands[group.first];
  const Island& last = islands.islands[group.first + group.count - 1];
  first_body_ = first.first_body;
  body_count_ = last.first_body + last.body_count - first_body_;
  bodies.assign(1, PointBody{});
  start_center_.assign(1, Vec3::Zero());
  for (std::uint32_t i = 0; i < body_count_; ++i) add_body(islands.bodies[first_body_ + i]);
  for (const std::uint32_t kinematic : used_kinematics_) kinematic_row_[kinematic] = 0;
  used_kinematics_.clear();
  kinematic_row_.resize(std::max(kinematic_row_.size(), step.solver->islands.kinematics.size()));

  const ContactRef* refs = islands.contacts.data() + first.first_contact;
  const std::uint32_t count = last.first_contact + last.contact_count - first.first_contact;
  row_a_.clear();
  row_b_.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    row_a_.push_back(row_of(step.contacts->pairs[refs[i].pair].body_a));
    row_b_.push_back(row_of(step.contacts->pairs[refs[i].pair].body_b));
  }
  colouring_.run(row_a_.data(), row_b_.data(), count, 1 + body_count_);
  colour_end_.assign(colouring_.colours, 0);
  for (std::uint32_t i = 0; i < count; ++i) ++colour_end_[colouring_.colour[i]];
  std::uint32_t sum = 0;
  for (std::uint32_t& end : colour_end_) {
    const std::uint32_t size = end;
    end = sum;
    sum += size;
  }
  order_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) order_[colour_end_[colouring_.colour[i]]++] = i;
  contacts.clear();
  for (const std::uint32_t i : order_) add_contact(refs[i], row_a_[i], row_b_[i]);
}

// Bodies that do not move share row 0; a kinematic one gets a row when it is first met.
std::uint32_t PointGroup::row_of(BodyIndex body) {
  const IslandScratch& islands = step_->solver->islands;
  const std::uint32_t slot = islands.slot[body];
  if (slot == kNone) return 0;
  if (!(slot & kKinematicSlot)) return slot - first_body_ + 1;
  std::uint32_t& row = kinematic_row_[slot & ~kKinematicSlot];
  if (row == 0) {
    row = static_cast<std::uint32_t>(bodies.size());
    used_kinematics_.push_back(slot & ~kKinematicSlot);
    add_kinematic(body, slot & ~kKinematicSlot);
  }
  return row;
}

void PointGroup::add_body(BodyIndex index) {
  const Bodies& all = *step_->bodies;
  const BodyMass& mass = all.mass[index];
  const BodyMotion& motion = all.motion[index];
  const BodyPose& pose = all.pose[index];
  const ExternalForce force =
      external_force(*step_, index, step_->time, pose.center, motion.linear, motion.angular);
  PointBody body;
  body.body = index;
  body.solved = true;
  body.linear = motion.linear;
  body.angular = motion.angular;
  body.angular_momentum = motion.angular_momentum;
  body.orientation = pose.orientation;
  for (int k = 0; k < 3; ++k)
    body.inv_mass[k] = all.flags[index] & (kLockX << k) ? 0 : mass.inv_mass;
  body.inv_inertia = inv_inertia_w(mass, pose.orientation, all.flags[index]);
  body.acceleration = force.force * mass.inv_mass;
  body.torque = force.torque;
  bodies.push_back(body);
  start_center_.push_back(pose.center);
}

void PointGroup::add_kinematic(BodyIndex index, std::uint32_t kinematic) {
  const KinematicStart& start = step_->solver->islands.kinematics[kinematic];
  PointBody body;
  body.body = index;
  body.linear = start.linear;
  body.angular = start.angular;
  body.orientation = start.orientation;
  bodies.push_back(body);
  start_center_.push_back(start.center);
}

void PointGroup::add_contact(const ContactRef& ref, std::uint32_t row_a, std::uint32_t row_b) {
  const ContactPair& pair = step_->contacts->pairs[ref.pair];
  const Manifold& manifold = step_->contacts->manifolds[ref.manifold];
  const auto center_of = [this](BodyIndex body, std::uint32_t row) {
    return row == 0 ? step_->bodies->pose[body].center : start_center_[row];
  };
  PointContact c;
  c.row_a = row_a;
  c.row_b = row_b;
  c.manifold = ref.manifold;
  c.count = manifold.point_count;
  c.offset = center_of(pair.body_b, row_b) - center_of(pair.body_a, row_a);
  c.normal = to_double(manifold.normal);
  c.t1 = across(c.normal);
  c.t2 = c.normal.cross(c.t1);
  c.arm_a = Vec3::Zero();
  for (std::uint32_t i = 0; i < c.count; ++i) {
    c.points[i] = to_double(manifold.points[i].position);
    c.separation[i] = double(manifold.points[i].separation);
    c.impulse[i] = double(manifold.normal_impulse[i]);
    c.arm_a += c.points[i] / c.count;
  }
  c.arm_b = c.arm_a - c.offset;
  for (std::uint32_t i = 0; i < c.count; ++i) {
    c.lever[i] = (c.points[i] - c.arm_a).norm();
    c.start_speed[i] = c.normal.dot(velocity_at(c, c.points[i], c.points[i] - c.offset));
    c.approach = std::max(c.approach, -c.start_speed[i]);
  }
  const Vec3 slide = to_double(manifold.friction_impulse);
  const Vec3 roll = to_double(manifold.rolling_impulse);
  c.slide[0] = c.t1.dot(slide);
  c.slide[1] = c.t2.dot(slide);
  c.roll[0] = c.t1.dot(roll);
  c.roll[1] = c.t2.dot(roll);
  c.twist = double(manifold.twist_impulse);
  c.friction = double(manifold.friction);
  c.restitution = double(manifold.restitution);
  c.rolling = double(manifold.rolling_resistance);
  contacts.push_back(c);
}

void PointGroup::push(PointContact& c, const Vec3& arm_a, const Vec3& arm_b, const Vec3& impulse) {
  const auto give = [&](PointBody& body, const Vec3& arm, const Vec3& given) {
    if (!body.solved) return;
    const Vec3 angular = arm.cross(given);
    body.linear += body.inv_mass.cwiseProduct(given);
    body.angular += body.inv_inertia * angular;
    body.angular_momentum += angular;
    body.impulse += given;
    body.angular_impulse += angular;
    body.pushed = true;
  };
  give(bodies[c.row_a], arm_a, -impulse);
  give(bodies[c.row_b], arm_b, impulse);
}

void PointGroup::twist(PointContact& c, const Vec3& angular_impulse) {
  const auto give = [&](PointBody& body, const Vec3& given) {
    if (!body.solved) return;
    body.angular += body.inv_inertia * given;
    body.angular_momentum += given;
    body.angular_impulse += given;
  };
  give(bodies[c.row_a], -angular_impulse);
  give(bodies[c.row_b], angular_impulse);
}

Vec3 PointGroup::velocity_at(const PointContact& c, const Vec3& arm_a, const Vec3& arm_b) const {
  return relative_velocity(bodies[c.row_a], bodies[c.row_b], arm_a, arm_b);
}

double PointGroup::response(const PointContact& c, const Vec3& arm_a, const Vec3& arm_b,
                            const Vec3& in, const Vec3& out) const {
  return solver::response(bodies[c.row_a], arm_a, in, out) +
         solver::response(bodies[c.row_b], arm_b, in, out);
}

void PointGroup::kick(std::uint32_t row, double h) {
  PointBody& body = bodies[row];
  if (!body.solved) return;
  const BodyMass& mass = step_->bodies->mass[body.body];
  body.linear = (body.linear + h * body.acceleration) / (1 + h * mass.linear_damping);
  body.angular_momentum =
      (body.angular_momentum + h * body.torque) / (1 + h * mass.angular_damping);
  body.angular = body.inv_inertia * body.angular_momentum;
}

void PointGroup::drift(std::uint32_t row, double h) {
  PointBody& body = bodies[row];
  body.center += h * (body.linear + body.correction_linear);
  const Vec3 turn = h * (body.angular + body.correction_angular);
  body.orientation = turned(body.orientation, turn);
  body.angle += turn;
  if (!body.solved) return;
  const std::uint32_t flags = step_->bodies->flags[body.body];
  const BodyMass& mass = step_->bodies->mass[body.body];
  if (!(flags & kIsotropic) || (flags & kLockMask))
    body.inv_inertia = inv_inertia_w(mass, body.orientation, flags);
  if (flags & (kLockRx | kLockRy | kLockRz)) {
    body.angular_momentum = inertia_w(mass, body.orientation) * body.angular;
  } else {
    body.angular = body.inv_inertia * body.angular_momentum;
  }
}

void PointGroup::store(const PointContact& c, const double gap[4], double h) {
  Manifold& manifold = step_->contacts->manifolds[c.manifold];
  for (std::uint32_t i = 0; i < c.count; ++i)
    manifold.normal_impulse[i] = rounded_to_float(c.impulse[i]);
  manifold.friction_impulse = to_float(c.slide[0] * c.t1 + c.slide[1] * c.t2);
  manifold.rolling_impulse = to_float(c.roll[0] * c.t1 + c.roll[1] * c.t2);
  manifold.twist_impulse = rounded_to_float(c.twist);
  manifold.total_impulse = rounded_to_float(c.total);
  manifold.approach_speed = rounded_to_float(c.approach);
  if (!step_->effects) return;
  step_->effects->contacts[c.manifold] =
      contact_residual(*step_, manifold, c.offset, bodies[c.row_a], bodies[c.row_b], gap, h);
}

void PointGroup::finish(std::uint32_t row) {
  const PointBody& body = bodies[row];
  if (!body.solved) return;
  FastWatch watch(*step_, body.body);
  if (!body.pushed) {
    fly_free(*step_, body.body);
    watch.finish(FastFlight::free);
    return;
  }
  EffectWatch effect(*step_, body.body);
  Bodies& all = *step_->bodies;
  const BodyMass& mass = all.mass[body.body];
  if (is_finite(body.center) && body.orientation.coeffs().allFinite() && is_finite(body.linear) &&
      is_finite(body.angular) && is_finite(body.angular_momentum)) {
    all.pose[body.body] = {start_center_[row] + body.center, body.orientation};
    all.motion[body.body] = {body.linear, body.angular, body.angular_momentum};
  } else {
    all.motion[body.body] = BodyMotion{};
    all.flags[body.body] |= kQuarantined;
  }
  if (mass.linear_damping > 0 || mass.angular_damping > 0) {
    effect.finish(body.impulse, body.angular_impulse);
  } else {
    effect.finish_balanced(body.impulse, body.angular_impulse,
                           step_->dt * mass.mass * body.acceleration, step_->dt * body.torque);
  }
  watch.finish(FastFlight::pushed);
}

std::uint32_t PointProgram::block_count(std::uint32_t phase) const {
  const std::uint32_t size = phases_[phase].items.size();
  return (size + group_.grain() - 1) / group_.grain();
}

void PointProgram::run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t) {
  const Phase& p = phases_[phase];
  const std::uint32_t begin = p.items.begin + block * group_.grain();
  const std::uint32_t end = std::min(p.items.end - begin, group_.grain()) + begin;
  for (std::uint32_t i = begin; i < end; ++i) {
    if (p.bodies) {
      run_body(p.op, i);
    } else {
      run_contact(p.op, group_.contacts[i]);
    }
  }
}

void PointProgram::run_serially() {
  for (std::uint32_t phase = 0; phase < phase_count(); ++phase) {
    for (std::uint32_t block = 0; block < block_count(phase); ++block) run_block(phase, block, 0);
  }
}

void PointProgram::add_contacts(Op op) {
  for (std::uint32_t c = 0; c < group_.colours(); ++c)
    phases_.push_back({op, false, group_.colour(c)});
}

void PointProgram::add_bodies(Op op) {
  phases_.push_back({op, true, {1, static_cast<std::uint32_t>(group_.bodies.size())}});
}

void limit_to_disc(double k11, double k12, double k22, double limit, double v1, double v2,
                   double p[2]) {
  const double det = k11 * k22 - k12 * k12;
  double stick1 = p[0] - inverse_or_zero(k11) * v1, stick2 = p[1] - inverse_or_zero(k22) * v2;
  if (det > 1e-9 * k11 * k22) {
    stick1 = p[0] - (k22 * v1 - k12 * v2) / det;
    stick2 = p[1] - (k11 * v2 - k12 * v1) / det;
  }
  if (stick1 * stick1 + stick2 * stick2 > limit * limit) {
    const double mean = 0.5 * (k11 + k22), difference = 0.5 * (k11 - k22);
    const double slide = inverse_or_zero(mean + std::sqrt(difference * difference + k12 * k12));
    stick1 = p[0] - slide * v1;
    stick2 = p[1] - slide * v2;
    const double size = std::sqrt(stick1 * stick1 + stick2 * stick2);
    if (size > limit) {
      stick1 *= limit / size;
      stick2 *= limit / size;
    }
  }
  p[0] = stick1;
  p[1] = stick2;
}

}  // namespace skerry::solver
