#include "solver/rotation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/trig.h"
#include "core/vec.h"

namespace skerry::solver {
namespace {

using V3d = core::V3<double>;
using Q4d = core::Q4<double>;
using M3d = core::M3<double>;
using Sym3d = core::Sym3<double>;

constexpr std::uint32_t kRotationLocks = core::kLockRx | core::kLockRy | core::kLockRz;

V3d scalars(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Vec3 vector(const V3d& v) { return {v.x, v.y, v.z}; }
Q4d scalars(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
Sym3d symmetric(const Mat3& m) { return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)}; }

Q4d operator*(const Q4d& a, const Q4d& b) {
  return {((a.w * b.x + a.x * b.w) + a.y * b.z) - a.z * b.y,
          ((a.w * b.y + a.y * b.w) + a.z * b.x) - a.x * b.z,
          ((a.w * b.z + a.z * b.w) + a.x * b.y) - a.y * b.x,
          ((a.w * b.w - a.x * b.x) - a.y * b.y) - a.z * b.z};
}

Quat normalised(const Q4d& q) {
  const double scale = 1 / std::sqrt(((q.x * q.x + q.y * q.y) + q.z * q.z) + q.w * q.w);
  return Quat(q.w * scale, q.x * scale, q.y * scale, q.z * scale);
}

Q4d turn_quaternion(const V3d& turn) {
  const double angle = std::sqrt(dot(turn, turn));
  if (angle == 0) return {0, 0, 0, 1};
  const auto [s, c] = core::trig::sin_cos(0.5 * angle);
  const V3d v = turn * (s / angle);
  return {v.x, v.y, v.z, c};
}

// Isotropic: omega = omega0 + alpha t keeps its law in the world frame. Magnus series to fourth
// order; exact when alpha is zero or along omega0.
Quat isotropic_after(double h, double inv_inertia, const Quat& start, const V3d& momentum,
                     const V3d& torque) {
  const V3d omega = momentum * inv_inertia, alpha = torque * inv_inertia;
  const V3d turn = (omega + alpha * (0.5 * h)) * h - cross(omega, alpha) * (h * h * h / 12);
  if (turn.x == 0 && turn.y == 0 && turn.z == 0) return start;
  return normalised(turn_quaternion(turn) * scalars(start));
}

// The axis of symmetry, 0 to 2, of an inertia that is diagonal with two equal moments; -1: none.
int symmetry_axis(const Sym3d& m) {
  if (m.xy != 0 || m.xz != 0 || m.yz != 0) return -1;
  return m.yy == m.zz ? 0 : m.zz == m.xx ? 1 : m.xx == m.yy ? 2 : -1;
}

// Torque-free symmetric top: precession about L, after a spin about the body's axis.
Quat symmetric_after(double h, const Sym3d& inv_inertia, int axis, const Quat& start,
                     const V3d& momentum) {
  const double along[3] = {inv_inertia.xx, inv_inertia.yy, inv_inertia.zz};
  const double across = along[(axis + 1) % 3];
  const V3d l = transposed_times(core::to_matrix(scalars(start)), momentum);
  const double l_axis = axis == 0 ? l.x : axis == 1 ? l.y : l.z;
  const auto [s, c] = core::trig::sin_cos(0.5 * h * ((along[axis] - across) * l_axis));
  const Q4d spin = {axis == 0 ? s : 0, axis == 1 ? s : 0, axis == 2 ? s : 0, c};
  return normalised(turn_quaternion(momentum * (across * h)) * (scalars(start) * spin));
}

// Terms of the power series in t/h about the start of a sub-step.
struct Series {
  static constexpr int kOrder = 18;
  V3d l[kOrder + 1];       // body angular momentum
  V3d w[kOrder + 1];       // body angular velocity
  V3d torque[kOrder + 1];  // in body axes
  Q4d d[kOrder + 1];       // rotation since the start
  int last = 0;            // terms d[0..last] are there

  double size(int k) const {
    return std::max(std::max(std::fabs(d[k].x), std::fabs(d[k].y)),
                    std::max(std::fabs(d[k].z), std::fabs(d[k].w)));
  }
};

// Even and odd terms may vanish by symmetry, so two in a row must be small.
bool converged(const Series& s) {
  constexpr double kTolerance = 1e-16;
  return s.last >= 2 && s.size(s.last) < kTolerance && s.size(s.last - 1) < kTolerance;
}

// The terms of order k + 1 from those up to k.
void extend(Series& s, int k, double h, const Sym3d& inv_inertia, bool has_torque) {
  s.w[k] = inv_inertia * s.l[k];
  V3d dl = {0, 0, 0}, dt = {0, 0, 0}, dv = {0, 0, 0};
  double dw = 0;
  for (int j = 0; j <= k; ++j) {
    const V3d& w = s.w[k - j];
    const Q4d& d = s.d[j];
    const V3d v = {d.x, d.y, d.z};
    dl = dl + cross(s.l[j], w);
    dv = dv + (w * d.w + cross(v, w));
    dw = dw - dot(v, w);
  }
  const double scale = h / (k + 1);
  if (has_torque) {
    for (int j = 0; j <= k; ++j) dt = dt + cross(s.torque[j], s.w[k - j]);
    s.torque[k + 1] = dt * scale;
    dl = dl + s.torque[k];
  }
  s.l[k + 1] = dl * scale;
  const double half = 0.5 * scale;
  s.d[k + 1] = {dv.x * half, dv.y * half, dv.z * half, dw * half};
  s.last = k + 1;
}

// Expresses the series of d in t/(h/2).
void halve(Series& s) {
  double scale = 1;
  for (int k = 0; k <= s.last; ++k, scale *= 0.5)
    s.d[k] = {s.d[k].x * scale, s.d[k].y * scale, s.d[k].z * scale, s.d[k].w * scale};
}

Q4d sum(const Series& s) {
  Q4d d = s.d[s.last];
  for (int k = s.last - 1; k >= 0; --k)
    d = {d.x + s.d[k].x, d.y + s.d[k].y, d.z + s.d[k].z, d.w + s.d[k].w};
  return d;
}

// One sub-step from `start`; halves `h` until the series converges.
Quat series_step(double& h, const Sym3d& inv_inertia, const Quat& start, const V3d& momentum,
                 const V3d& torque) {
  const M3d r = core::to_matrix(scalars(start));
  const bool has_torque = torque.x != 0 || torque.y != 0 || torque.z != 0;
  Series s;
  s.d[0] = {0, 0, 0, 1};
  s.l[0] = transposed_times(r, momentum);
  s.torque[0] = transposed_times(r, torque);
  const V3d w = inv_inertia * s.l[0];
  const double speed = std::sqrt(dot(w, w));
  while (speed * h > 1) h *= 0.5;
  for (int k = 0; k < Series::kOrder && !converged(s); ++k)
    extend(s, k, h, inv_inertia, has_torque);
  for (int i = 0; i < 64 && !converged(s); ++i) {
    h *= 0.5;
    halve(s);
  }
  return normalised(scalars(start) * sum(s));
}

// Sub-steps are powers of two of the whole, so that their sum is exact.
Quat series_after(double duration, const Sym3d& inv_inertia, Quat orientation, const V3d& momentum,
                  const V3d& torque) {
  double done = 0, trial = duration;
  for (int i = 0; i < kMaxSeries && done < duration; ++i) {
    double h = std::min(trial, duration - done);
    orientation = series_step(h, inv_inertia, orientation, momentum + torque * done, torque);
    done += h;
    trial = 2 * h;
  }
  return orientation;
}

// Midpoint rule; exact about a single axis, where omega changes with the torque alone.
Quat locked_after(double h, const core::BodyMass& mass, std::uint32_t flags, const Quat& start,
                  const Vec3& momentum, const Vec3& torque) {
  const Vec3 middle = momentum + torque * (0.5 * h);
  const Vec3 omega = angular_velocity(mass, flags, start, middle);
  if (omega.isZero(0)) return start;
  const Quat half = turned(start, omega * (0.5 * h));
  return turned(start, angular_velocity(mass, flags, half, middle) * h);
}

}  // namespace

Quat turned(const Quat& orientation, const Vec3& turn) {
  return normalised(turn_quaternion(scalars(turn)) * scalars(orientation));
}

Vec3 angular_velocity(const core::BodyMass& mass, std::uint32_t flags, const Quat& orientation,
                      const Vec3& angular_momentum) {
  const V3d momentum = scalars(angular_momentum);
  if (flags & kRotationLocks) {
    const Mat3 w = core::inv_inertia_w(mass, orientation, flags);
    return vector(symmetric(w) * momentum);
  }
  if (flags & core::kIsotropic) return vector(momentum * mass.inv_inertia_b(0, 0));
  const M3d r = core::to_matrix(scalars(orientation));
  return vector(r * (symmetric(mass.inv_inertia_b) * transposed_times(r, momentum)));
}

Quat orientation_after(double duration, const core::BodyMass& mass, std::uint32_t flags,
                       const Quat& orientation, const Vec3& angular_momentum, const Vec3& torque) {
  const bool no_torque = torque.isZero(0);
  if (no_torque && angular_momentum.isZero(0)) return orientation;
  if (!angular_momentum.allFinite() || !torque.allFinite()) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    return Quat(kNan, kNan, kNan, kNan);  // the caller's check for finite state takes it from here
  }
  if (flags & kRotationLocks)
    return locked_after(duration, mass, flags, orientation, angular_momentum, torque);
  const V3d momentum = scalars(angular_momentum), turning = scalars(torque);
  if (flags & core::kIsotropic)
    return isotropic_after(duration, mass.inv_inertia_b(0, 0), orientation, momentum, turning);
  const Sym3d inv_inertia = symmetric(mass.inv_inertia_b);
  const int axis = no_torque ? symmetry_axis(inv_inertia) : -1;
  if (axis >= 0) return symmetric_after(duration, inv_inertia, axis, orientation, momentum);
  return series_after(duration, inv_inertia, orientation, momentum, turning);
}

}  // namespace skerry::solver
