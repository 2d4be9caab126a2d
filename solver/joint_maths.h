// Small algebra of the joint solver, in double. Operation order is fixed.
#pragma once

#include <cmath>

#include "core/vec.h"

namespace skerry::solver {

using V3d = core::V3<double>;
using Sym3d = core::Sym3<double>;
using M3d = core::M3<double>;
using Q4d = core::Q4<double>;

inline V3d scalars(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Vec3 vector(const V3d& v) { return {v.x, v.y, v.z}; }
inline Q4d scalars(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
inline double length(const V3d& v) { return std::sqrt(dot(v, v)); }
inline V3d scaled(const V3d& a, const V3d& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Q4d conjugate(const Q4d& q) { return {-q.x, -q.y, -q.z, q.w}; }

inline Q4d operator*(const Q4d& a, const Q4d& b) {
  return {((a.w * b.x + a.x * b.w) + a.y * b.z) - a.z * b.y,
          ((a.w * b.y + a.y * b.w) + a.z * b.x) - a.x * b.z,
          ((a.w * b.z + a.z * b.w) + a.x * b.y) - a.y * b.x,
          ((a.w * b.w - a.x * b.x) - a.y * b.y) - a.z * b.z};
}
inline V3d rotate(const Q4d& q, const V3d& v) {
  const V3d u = {q.x, q.y, q.z};
  const V3d t = cross(u, v) * 2.0;
  return (v + t * q.w) + cross(u, t);
}
inline Q4d normalised(const Q4d& q) {
  const double s = 1 / std::sqrt(((q.x * q.x + q.y * q.y) + q.z * q.z) + q.w * q.w);
  return {q.x * s, q.y * s, q.z * s, q.w * s};
}
// q turned by |turn| rad about `turn` (world). Exact to the fifth order of the angle: the half angle is
// lengthened to its tangent and the sum normalised.
inline Q4d turned(const Q4d& q, const V3d& turn) {
  V3d t = turn * 0.5;
  t = t * (1 + dot(t, t) * (1.0 / 3));
  return normalised(Q4d{t.x, t.y, t.z, 1} * q);
}

// R A R^T.
inline Sym3d rotated(const Sym3d& a, const M3d& r) {
  const V3d p0 = a * V3d{r.c0.x, r.c1.x, r.c2.x}, p1 = a * V3d{r.c0.y, r.c1.y, r.c2.y},
            p2 = a * V3d{r.c0.z, r.c1.z, r.c2.z};
  const auto entry = [&r](int row, const V3d& p) {
    const double* c0 = &r.c0.x;
    const double* c1 = &r.c1.x;
    const double* c2 = &r.c2.x;
    return (c0[row] * p.x + c1[row] * p.y) + c2[row] * p.z;
  };
  return {entry(0, p0), entry(0, p1), entry(0, p2), entry(1, p1), entry(1, p2), entry(2, p2)};
}

inline constexpr int kMaxLocks = 6;

// L D L^T of a symmetric positive semidefinite matrix of up to six rows. A direction without stiffness
// (its pivot lost in rounding) takes no part in solutions.
struct BlockFactor {
  double l[kMaxLocks * (kMaxLocks - 1) / 2];  // below the diagonal, row by row
  double inv_d[kMaxLocks];
};

// `k` holds the lower triangle; a pivot below `lost` times `scale` of its row is none.
inline void factorise(const double (&k)[kMaxLocks][kMaxLocks], const double (&scale)[kMaxLocks],
                      int n, double lost, BlockFactor& f) {
  double* row = f.l;
  for (int i = 0; i < n; row += i, ++i) {
    double pivot = k[i][i];
    const double* other = f.l;
    double part[kMaxLocks];  // l_ij d_j
    for (int j = 0; j < i; other += j, ++j) {
      double s = k[i][j];
      for (int m = 0; m < j; ++m) s -= part[m] * other[m];
      part[j] = s;
      row[j] = s * f.inv_d[j];
      pivot -= s * row[j];
    }
    f.inv_d[i] = pivot > lost * scale[i] ? 1 / pivot : 0.0;
  }
}
inline void solve_factored(const BlockFactor& f, int n, double* x) {
  const double* row = f.l;
  for (int i = 0; i < n; row += i, ++i)
    for (int j = 0; j < i; ++j) x[i] -= row[j] * x[j];
  for (int i = 0; i < n; ++i) x[i] *= f.inv_d[i];
  for (int i = n - 1; i > 0; --i) {
    row -= i;
    for (int j = 0; j < i; ++j) x[j] -= row[j] * x[i];
  }
}

}  // namespace skerry::solver
