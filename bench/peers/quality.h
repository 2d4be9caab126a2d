// What became of a scene: one judge for all engines.
#pragma once

#include "bench/peers/overlap.h"

namespace skerry::peers {

struct Quality {
  Penetration penetration;
  double kinetic_energy = 0;  // J
  double largest_drift = 0;   // m, of a moving body from where it started
  double mean_y = 0;          // m, of the moving bodies
  double top_y = 0;           // m, of the highest
  std::size_t escaped = 0;    // below the floor's top (y = 0), or beyond the fixed bodies sideways
};
Quality measure_quality(const PeerScene& scene, std::span<const BodyState> states);

}  // namespace skerry::peers
