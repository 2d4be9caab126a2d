#include "core/bodies.h"

#include <algorithm>
#include <functional>

#include "core/assert.h"
#include "core/vec.h"

namespace skerry::core {
namespace {

using V3d = V3<double>;
using M3d = M3<double>;

M3d rotation(const Quat& q) { return to_matrix(Q4<double>{q.x(), q.y(), q.z(), q.w()}); }
V3d scalars(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Vec3 vector(const V3d& v) { return {v.x, v.y, v.z}; }

// R A R^T for symmetric A, exactly symmetric.
Mat3 rotated(const Mat3& a, const M3d& r) {
  const V3d row[3] = {{r.c0.x, r.c1.x, r.c2.x}, {r.c0.y, r.c1.y, r.c2.y}, {r.c0.z, r.c1.z, r.c2.z}};
  const V3d column[3] = {
      {a(0, 0), a(1, 0), a(2, 0)}, {a(0, 1), a(1, 1), a(2, 1)}, {a(0, 2), a(1, 2), a(2, 2)}};
  Mat3 out;
  for (int i = 0; i < 3; ++i) {
    const V3d ra = {dot(row[i], column[0]), dot(row[i], column[1]), dot(row[i], column[2])};
    for (int j = i; j < 3; ++j) out(i, j) = out(j, i) = dot(ra, row[j]);
  }
  return out;
}

bool locked(std::uint32_t flags, int axis, std::uint32_t first) {
  return (flags & (first << axis)) != 0;
}

// L with omega = W L, where W is the inverse inertia with locked rows and columns cleared; omega is
// zero on locked axes, and so is L. Solves the block of the free axes (2x2 or 1x1).
Vec3 momentum_under_locks(const Mat3& w, std::uint32_t flags, const Vec3& omega) {
  int axes[3], count = 0;
  for (int i = 0; i < 3; ++i)
    if (!locked(flags, i, kLockRx)) axes[count++] = i;
  Vec3 momentum = Vec3::Zero();
  if (count == 1) {
    momentum[axes[0]] = omega[axes[0]] / w(axes[0], axes[0]);
  } else if (count == 2) {
    const int i = axes[0], j = axes[1];
    const double determinant = w(i, i) * w(j, j) - w(i, j) * w(j, i);
    momentum[i] = (w(j, j) * omega[i] - w(i, j) * omega[j]) / determinant;
    momentum[j] = (w(i, i) * omega[j] - w(j, i) * omega[i]) / determinant;
  }
  return momentum;
}

}  // namespace

Mat3 inv_inertia_w(const BodyMass& mass, const Quat& orientation, std::uint32_t flags) {
  Mat3 w = rotated(mass.inv_inertia_b, rotation(orientation));
  for (int i = 0; i < 3; ++i) {
    if (!locked(flags, i, kLockRx)) continue;
    for (int j = 0; j < 3; ++j) w(i, j) = w(j, i) = 0;
  }
  return w;
}

Mat3 inertia_w(const BodyMass& mass, const Quat& orientation) {
  return rotated(mass.inertia_b, rotation(orientation));
}

BodyIndex take_row(Bodies& bodies) {
  if (!bodies.free_rows.empty()) {
    const BodyIndex body = bodies.free_rows.back();
    bodies.free_rows.pop_back();
    bodies.flags[body] = kAlive;
    ++bodies.generation[body];
    return body;
  }
  const BodyIndex body = bodies.rows();
  bodies.flags.push_back(kAlive);
  bodies.pose.emplace_back();
  bodies.motion.emplace_back();
  bodies.mass.emplace_back();
  bodies.as_dynamic.emplace_back();
  bodies.force.emplace_back();
  bodies.still_time.push_back(0);
  bodies.still_energy.push_back(0);
  bodies.sleep_island.push_back(kNone);
  bodies.lock_joints.push_back(0);
  bodies.first_collider.push_back(kNone);
  bodies.generation.push_back(1);  // 0 is the generation of an id that names nothing
  bodies.user_data.push_back(0);
  return body;
}

void free_row(Bodies& bodies, BodyIndex body) {
  SKERRY_ASSERT(body < bodies.rows() && bodies.is(body, kAlive), "a free body row is freed again");
  if (bodies.flags[body] & kAwake) bodies.awake_stale = true;
  bodies.flags[body] = 0;
  bodies.pose[body] = {};
  bodies.motion[body] = {};
  bodies.mass[body] = {};
  bodies.as_dynamic[body] = {};
  bodies.force[body] = {};
  bodies.still_time[body] = 0;
  bodies.sleep_island[body] = kNone;
  bodies.first_collider[body] = kNone;
  bodies.user_data[body] = 0;
  auto& rows = bodies.free_rows;
  rows.insert(std::lower_bound(rows.begin(), rows.end(), body, std::greater<>()), body);
}

void set_motion(Bodies& bodies, BodyIndex body, const Vec3& linear, const Vec3& angular) {
  const std::uint32_t flags = bodies.flags[body];
  BodyMotion& motion = bodies.motion[body];
  motion.linear = linear;
  motion.angular = angular;
  for (int i = 0; i < 3; ++i) {
    if (locked(flags, i, kLockX)) motion.linear[i] = 0;
    if (locked(flags, i, kLockRx)) motion.angular[i] = 0;
  }
  motion.angular_momentum.setZero();
  if (!(flags & kDynamic)) return;
  const BodyMass& mass = bodies.mass[body];
  const Quat& orientation = bodies.pose[body].orientation;
  if (flags & (kLockRx | kLockRy | kLockRz)) {
    motion.angular_momentum =
        momentum_under_locks(inv_inertia_w(mass, orientation, flags), flags, motion.angular);
    return;
  }
  const Mat3 inertia = inertia_w(mass, orientation);
  const V3d omega = scalars(motion.angular);
  for (int i = 0; i < 3; ++i)
    motion.angular_momentum[i] = dot(V3d{inertia(i, 0), inertia(i, 1), inertia(i, 2)}, omega);
}

void disturb(Bodies& bodies, BodyIndex body) {
  if (bodies.flags[body] & (kDynamic | kDisturbed)) return;
  bodies.flags[body] |= kDisturbed;
  bodies.disturbed.push_back(body);
}

void forget_disturbed(Bodies& bodies) {
  for (const BodyIndex body : bodies.disturbed) bodies.flags[body] &= ~std::uint32_t{kDisturbed};
  bodies.disturbed.clear();
}

void add_force(Bodies& bodies, BodyIndex body, const Vec3& force, const Vec3& torque) {
  bodies.flags[body] |= kForced;
  bodies.force[body].force += force;
  bodies.force[body].torque += torque;
}

void refresh_awake(Bodies& bodies) {
  if (!bodies.awake_stale) return;
  bodies.awake.clear();
  for (BodyIndex body = 0; body < bodies.rows(); ++body) {
    const std::uint32_t flags = bodies.flags[body];
    if ((flags & (kAlive | kAwake | kQuarantined)) == (kAlive | kAwake))
      bodies.awake.push_back(body);
  }
  bodies.awake_stale = false;
}

Pose body_frame(const Bodies& bodies, BodyIndex body) {
  const BodyPose& pose = bodies.pose[body];
  // Most bodies, and then without asking for a far line of their mass.
  if (bodies.flags[body] & kCentred) return {pose.center, pose.orientation};
  return body_frame(pose, bodies.mass[body].local_center);
}

Pose body_frame(const BodyPose& pose, const Vec3& local_center) {
  const V3d offset = rotation(pose.orientation) * scalars(local_center);
  return {vector(scalars(pose.center) - offset), pose.orientation};
}

BodyPose center_frame(const Pose& pose, const Vec3& local_center) {
  const V3d offset = rotation(pose.orientation) * scalars(local_center);
  return {vector(scalars(pose.position) + offset), pose.orientation};
}

}  // namespace skerry::core
