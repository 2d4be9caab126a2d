// How deep bodies stand in one another, from their final poses alone: the same judge for every
// engine, sharing no code with any of them.
#pragma once

#include <cstddef>
#include <span>

#include "bench/peers/engine.h"

namespace skerry::peers {

struct Placed {
  const PeerShape* shape;
  Pose pose;
};

// Least distance by which one must be moved to part them, m; negative or zero if they are apart
// (then its size means nothing). Polyhedra by separating axes over faces and pairs of edges;
// spheres by the distance to the nearest point of the surface.
double penetration(const Placed& a, const Placed& b);

struct Penetration {
  std::size_t pairs = 0;  // that overlap, fixed with fixed left out
  double mean = 0;        // m, over those
  double max = 0;         // m
};
Penetration measure_penetration(const PeerScene& scene, std::span<const BodyState> states);

}  // namespace skerry::peers
