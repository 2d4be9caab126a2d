// The random numbers of scenes: a 32-bit linear congruential generator that anyone can rebuild.
#pragma once

#include <cstdint>

#include <skerry/types.h>

namespace skerry::scenes {

class Lcg {
 public:
  explicit Lcg(std::uint64_t seed) : state_(static_cast<std::uint32_t>(seed)) {}

  // In [0, 1), on a grid of 2^-24: exact in float and double.
  double unit() {
    state_ = state_ * 1664525u + 1013904223u;
    return (state_ >> 8) * (1.0 / 16777216.0);
  }
  // In [-amplitude, amplitude).
  double symmetric(double amplitude) { return amplitude * (2 * unit() - 1); }
  // x, y, z drawn in this order.
  Vec3 symmetric3(const Vec3& amplitude) {
    const double x = symmetric(amplitude.x());
    const double y = symmetric(amplitude.y());
    const double z = symmetric(amplitude.z());
    return {x, y, z};
  }
  // Four draws x, y, z, w, normalised.
  Quat orientation();

 private:
  std::uint32_t state_;
};

}  // namespace skerry::scenes
