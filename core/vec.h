// Small vectors over a scalar or a SIMD lane type, for kernels that are written once and run at any
// width. Operation order is spelled out here and nowhere else, so all widths give the same bits.
#pragma once

#include <cmath>

#include <skerry/types.h>

#include "core/rounding.h"

namespace skerry::core {

template <class T>
struct V3 {
  T x, y, z;

  friend V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend V3 operator-(const V3& a) { return {-a.x, -a.y, -a.z}; }
  friend V3 operator*(const V3& a, const T& s) { return {a.x * s, a.y * s, a.z * s}; }
  friend V3 operator*(const T& s, const V3& a) { return a * s; }
};

template <class T>
T dot(const V3<T>& a, const V3<T>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class T>
V3<T> cross(const V3<T>& a, const V3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Columns of a 3x3 matrix.
template <class T>
struct M3 {
  V3<T> c0, c1, c2;
  friend V3<T> operator*(const M3& m, const V3<T>& v) {
    return (m.c0 * v.x + m.c1 * v.y) + m.c2 * v.z;
  }
};
template <class T>
V3<T> transposed_times(const M3<T>& m, const V3<T>& v) {
  return {dot(m.c0, v), dot(m.c1, v), dot(m.c2, v)};
}

// Symmetric 3x3 matrix.
template <class T>
struct Sym3 {
  T xx, xy, xz, yy, yz, zz;
  friend V3<T> operator*(const Sym3& m, const V3<T>& v) {
    return {(m.xx * v.x + m.xy * v.y) + m.xz * v.z, (m.xy * v.x + m.yy * v.y) + m.yz * v.z,
            (m.xz * v.x + m.yz * v.y) + m.zz * v.z};
  }
};

template <class T>
struct Q4 {
  T x, y, z, w;
};
// Rotation matrix of a unit quaternion.
template <class T>
M3<T> to_matrix(const Q4<T>& q) {
  const T x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  const T xx = q.x * x2, yy = q.y * y2, zz = q.z * z2;
  const T xy = q.x * y2, xz = q.x * z2, yz = q.y * z2;
  const T wx = q.w * x2, wy = q.w * y2, wz = q.w * z2;
  const T one = T(1);
  return {{one - (yy + zz), xy + wz, xz - wy},
          {xy - wz, one - (xx + zz), yz + wx},
          {xz + wy, yz - wx, one - (xx + yy)}};
}

using V3f = V3<float>;
using M3f = M3<float>;
using Sym3f = Sym3<float>;
using Q4f = Q4<float>;

inline float length(const V3f& v) { return std::sqrt(dot(v, v)); }
inline V3f to_float(const Vec3& v) {
  return {rounded_to_float(v.x()), rounded_to_float(v.y()), rounded_to_float(v.z())};
}
inline Vec3 to_double(const V3f& v) { return {double(v.x), double(v.y), double(v.z)}; }
inline Q4f to_float(const Quat& q) {
  return {rounded_to_float(q.x()), rounded_to_float(q.y()), rounded_to_float(q.z()),
          rounded_to_float(q.w())};
}

}  // namespace skerry::core
