// What contacts did in a step, kept on request (WorldSettings::measure_steps).
#pragma once

#include <cstdint>
#include <vector>

#include <skerry/types.h>

namespace skerry::core {

struct BodyEffect {
  Vec3 impulse = Vec3::Zero();  // N s, world
  double energy_lost = 0;       // J
};

// How far a manifold is from the law of contact after the solve; see skerry::ContactLaw.
struct ContactResidual {
  double total_impulse = 0;   // N s along the normal, over the step
  double normal_impulse = 0;  // N s, sum over the points, of the last pass
  double pull = 0, cone = 0, normal = 0, friction = 0;  // N s
};

// Rows that the step did not solve are zero. Each is written by whoever solves its island.
struct ContactEffects {
  std::vector<BodyEffect> bodies;         // [body rows]
  std::vector<ContactResidual> contacts;  // [ContactTable::manifolds]
};

}  // namespace skerry::core
