#include "scenes/rigid_maths.h"

#include <cmath>

namespace skerry::scenes {
namespace {

// Taylor series on |x| <= pi/4; the first term left out is below 1e-17.
double sin_small(double x) {
  const double y = x * x;
  double sum = 0;
  for (const double divisor : {272.0, 210.0, 156.0, 110.0, 72.0, 42.0, 20.0, 6.0}) {
    sum = -(y / divisor) * (1 + sum);
  }
  return x + x * sum;
}

double cos_small(double x) {
  const double y = x * x;
  double sum = 0;
  for (const double divisor : {306.0, 240.0, 182.0, 132.0, 90.0, 56.0, 30.0, 12.0, 2.0}) {
    sum = -(y / divisor) * (1 + sum);
  }
  return 1 + sum;
}

}  // namespace

SinCos sin_cos(double angle) {
  // pi/2 in two parts, the first with 33 bits, so that quarter * kHigh is exact.
  constexpr double kHigh = 1.57079632673412561417e+00;
  constexpr double kLow = 6.07710050650619224932e-11;
  const double quarters = std::floor(angle * (2 / kPi) + 0.5);
  const double x = (angle - quarters * kHigh) - quarters * kLow;
  const double s = sin_small(x);
  const double c = cos_small(x);
  switch (static_cast<long long>(quarters) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

Quat normalized(double x, double y, double z, double w) {
  const double length = std::sqrt(x * x + y * y + z * z + w * w);
  if (!(length > 0)) return Quat::Identity();
  return Quat(w / length, x / length, y / length, z / length);
}

Quat axis_angle(const Vec3& axis, double angle) {
  const double length = std::sqrt(axis.x() * axis.x() + axis.y() * axis.y() + axis.z() * axis.z());
  if (!(length > 0)) return Quat::Identity();
  const auto [s, c] = sin_cos(angle / 2);
  const double k = s / length;
  return normalized(axis.x() * k, axis.y() * k, axis.z() * k, c);
}

Quat euler_xyz(const Vec3& angles) {
  const Quat x = axis_angle(Vec3(1, 0, 0), angles.x());
  const Quat y = axis_angle(Vec3(0, 1, 0), angles.y());
  const Quat z = axis_angle(Vec3(0, 0, 1), angles.z());
  return product(z, product(y, x));
}

Quat product(const Quat& a, const Quat& b) {
  return Quat(a.w() * b.w() - a.x() * b.x() - a.y() * b.y() - a.z() * b.z(),
              a.w() * b.x() + a.x() * b.w() + a.y() * b.z() - a.z() * b.y(),
              a.w() * b.y() - a.x() * b.z() + a.y() * b.w() + a.z() * b.x(),
              a.w() * b.z() + a.x() * b.y() - a.y() * b.x() + a.z() * b.w());
}

Vec3 rotated(const Quat& q, const Vec3& v) {
  const double tx = 2 * (q.y() * v.z() - q.z() * v.y());
  const double ty = 2 * (q.z() * v.x() - q.x() * v.z());
  const double tz = 2 * (q.x() * v.y() - q.y() * v.x());
  return {v.x() + q.w() * tx + (q.y() * tz - q.z() * ty),
          v.y() + q.w() * ty + (q.z() * tx - q.x() * tz),
          v.z() + q.w() * tz + (q.x() * ty - q.y() * tx)};
}

Vec3 transformed(const Pose& pose, const Vec3& point) {
  return rotated(pose.orientation, point) + pose.position;
}

Pose compose(const Pose& outer, const Pose& inner) {
  return {transformed(outer, inner.position), product(outer.orientation, inner.orientation)};
}

}  // namespace skerry::scenes
