// Cheap upper bounds of how far bodies move.
#pragma once

#include <cmath>

#include <skerry/types.h>

namespace skerry::collision {

inline double sum_of_sizes(double x, double y, double z) {
  return std::abs(x) + std::abs(y) + std::abs(z);
}
// The 1-norm: no shorter than the vector, and without a root.
inline double sum_of_sizes(const Vec3& v) { return sum_of_sizes(v.x(), v.y(), v.z()); }

// Upper bound of twice the chord between two unit quaternions (w, x, y, z): a point at distance r from
// the centre has moved by less than r times this. (2 sin(a/2) <= 2 |q - p|, a the angle between.)
template <class Number>
double twice_chord(const Number q[4], const Number p[4]) {
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += std::abs(double(q[i]) - double(p[i]));
  return 2 * sum;
}

}  // namespace skerry::collision
