// The little mathematics that scenes need, with the same bits from every compiler and machine:
// plain sums and products, sqrt, and sine and cosine of our own.
#pragma once

#include <skerry/types.h>

namespace skerry::scenes {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kRadiansPerDegree = kPi / 180;

struct SinCos {
  double sin = 0, cos = 1;
};
// Error below 1e-15 for |angle| up to 1e5 rad.
SinCos sin_cos(double angle);

// `axis` need not be unit. Identity for a zero axis.
Quat axis_angle(const Vec3& axis, double angle);
// Turns about the fixed x axis first, then y, then z.
Quat euler_xyz(const Vec3& angles);
// Unit quaternion in the direction given; identity for zero.
Quat normalized(double x, double y, double z, double w);

Quat product(const Quat& a, const Quat& b);
Vec3 rotated(const Quat& q, const Vec3& v);
// `inner` given in the frame `outer`.
Pose compose(const Pose& outer, const Pose& inner);
Vec3 transformed(const Pose& pose, const Vec3& point);

}  // namespace skerry::scenes
