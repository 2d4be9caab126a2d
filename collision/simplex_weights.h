// Weights of the points of a simplex: where it is nearest to the origin.
#pragma once

#include <algorithm>

#include "core/vec.h"

namespace skerry::collision {

inline void weigh_segment(const core::V3<double>& a, const core::V3<double>& b, double (&w)[3]) {
  const core::V3<double> ab = b - a;
  const double squared = dot(ab, ab);
  const double t = squared > 0 ? std::clamp(-dot(a, ab) / squared, 0.0, 1.0) : 0.0;
  w[0] = 1 - t;
  w[1] = t;
  w[2] = 0;
}

// Of a triangle (Ericson, "Real-Time Collision Detection", 2005, 5.1.5).
inline void weigh_triangle(const core::V3<double>& a, const core::V3<double>& b,
                           const core::V3<double>& c, double (&w)[3]) {
  const auto give = [&w](double u, double v, double t) {
    w[0] = u;
    w[1] = v;
    w[2] = t;
  };
  const core::V3<double> ab = b - a, ac = c - a;
  const double d1 = -dot(ab, a), d2 = -dot(ac, a);
  if (d1 <= 0 && d2 <= 0) return give(1, 0, 0);
  const double d3 = -dot(ab, b), d4 = -dot(ac, b);
  if (d3 >= 0 && d4 <= d3) return give(0, 1, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return give(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0);
  const double d5 = -dot(ab, c), d6 = -dot(ac, c);
  if (d6 >= 0 && d5 <= d6) return give(0, 0, 1);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return give(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return give(0, 1 - t, t);
  }
  const double sum = va + vb + vc;
  give(1 - (vb + vc) / sum, vb / sum, vc / sum);
}

}  // namespace skerry::collision
