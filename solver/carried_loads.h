// How what a contact carries without giving way follows what it bears, from step to step.
#pragma once

#include <algorithm>

#include "core/contacts.h"
#include "solver/standing_loads.h"

namespace skerry::solver {

struct Carrying {
  float dt = 0;  // s
  // Parts of the way to the present load that Manifold::carried_impulse goes in a step: as a rule, and in
  // a contact that is deeper than `deep`, m.
  float part = 0, deep_part = 0, deep = 0;
};

// The deeper a contact lies, the nearer it comes from its usual share, N s, to all that its most loaded
// point bears (docs/decisions/0029). Contacts that are not deep come to carry their share.
void carry_deep(const Carrying& by, float usual, core::Manifold& manifold);

// After a step. `load`: N s of a mean point in a substep.
inline void carry(const Carrying& by, float load, core::Manifold& manifold) {
  manifold.begins = false;
  manifold.pressed_time = load > 0 ? manifold.pressed_time + by.dt : 0;
  const float statics = manifold.statics_impulse;
  const float borne = stands(load, statics) ? statics : kNear * load;
  manifold.standing_impulse += by.part * (borne - manifold.standing_impulse);
  const float usual = carried_of(manifold, load);
  const core::ManifoldPoint* p = manifold.points;  // those that are not there may seem deep
  const float least = std::min(std::min(p[0].separation, p[1].separation),
                               std::min(p[2].separation, p[3].separation));
  if (least < -by.deep) return carry_deep(by, usual, manifold);
  manifold.carried_impulse += by.part * (usual - manifold.carried_impulse);
}

}  // namespace skerry::solver
