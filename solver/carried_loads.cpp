#include "solver/carried_loads.h"

#include <cstdint>

namespace skerry::solver {
namespace {

using core::Manifold;

// m, at the start of the step.
float deepest(const Manifold& manifold) {
  float depth = 0;
  for (std::uint32_t i = 0; i < manifold.point_count; ++i)
    depth = std::max(depth, -manifold.points[i].separation);
  return depth;
}

}  // namespace

// What statics knows the load of has its depth taken off. A depth that cannot go, in a loop that does not
// fit, is held by some load all the same: there it ends.
void carry_deep(const Carrying& by, float usual, Manifold& manifold) {
  float carries = usual, part = by.part;
  const float depth = deepest(manifold);
  if (depth > by.deep && !(manifold.statics_impulse > 0)) {
    const float* n = manifold.normal_impulse;
    const float most = std::max(std::max(n[0], n[1]), std::max(n[2], n[3]));
    const float shallow = by.deep / depth, square = shallow * shallow;
    carries += (1 - square * square) * (most - usual);
    part = by.deep_part;
  }
  manifold.carried_impulse += part * (carries - manifold.carried_impulse);
}

}  // namespace skerry::solver
