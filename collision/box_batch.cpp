// The box kernel with float for lanes: the reference, and what runs where there is no SIMD.
#include "collision/box_batch.h"

#include <cmath>

namespace skerry::collision {
namespace float_lanes {

struct Lane {
  using Mask = bool;
  static constexpr int kLanes = 1;
  float v;

  Lane() = default;
  explicit Lane(float value) : v(value) {}
  static Lane load(const float* from) { return Lane(*from); }
  void store(float* to) const { *to = v; }

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

#define SKERRY_LANES
#include "collision/box_lanes-inl.h"
#undef SKERRY_LANES

}  // namespace float_lanes

void collide_boxes_reference(BoxBatch& batch, int count) {
  float_lanes::collide_box_batch<float_lanes::Lane>(batch, count);
}

}  // namespace skerry::collision
