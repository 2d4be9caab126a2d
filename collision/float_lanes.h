// One float as a SIMD lane type: the reference for kernels that are written for any width.
#pragma once

#include <cmath>

namespace skerry::collision::float_lanes {

struct Lane {
  using Mask = bool;
  static constexpr int kLanes = 1;
  float v;

  Lane() = default;
  explicit Lane(float value) : v(value) {}
  static Lane load(const float* from) { return Lane(*from); }
  void store(float* to) const { *to = v; }
  static Lane counting(float first) { return Lane(first); }

  friend Lane operator+(Lane a, Lane b) { return Lane(a.v + b.v); }
  friend Lane operator-(Lane a, Lane b) { return Lane(a.v - b.v); }
  friend Lane operator*(Lane a, Lane b) { return Lane(a.v * b.v); }
  friend Lane operator/(Lane a, Lane b) { return Lane(a.v / b.v); }
  friend Lane operator-(Lane a) { return Lane(-a.v); }
  friend bool operator<(Lane a, Lane b) { return a.v < b.v; }
  friend bool operator>(Lane a, Lane b) { return a.v > b.v; }
  friend bool operator==(Lane a, Lane b) { return a.v == b.v; }
};
// As the SSE instructions: the second operand if either is NaN or both are zero.
inline Lane min(Lane a, Lane b) { return a < b ? a : b; }
inline Lane max(Lane a, Lane b) { return a > b ? a : b; }
inline Lane abs(Lane a) { return Lane(std::fabs(a.v)); }
inline Lane square_root(Lane a) { return Lane(std::sqrt(a.v)); }
inline Lane select(bool mask, Lane yes, Lane no) { return mask ? yes : no; }
inline bool all(bool mask) { return mask; }
// Over the lanes.
inline float lowest(Lane a) { return a.v; }
inline float highest(Lane a) { return a.v; }
inline unsigned bits(bool mask) { return mask; }  // lane 0 is bit 0
inline void pack(bool mask, Lane a, float* to) { *to = mask ? a.v : 0; }

}  // namespace skerry::collision::float_lanes
