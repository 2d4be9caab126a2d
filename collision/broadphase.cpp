#include "collision/broadphase.h"

#include "collision/broadphase_kinds.h"

namespace skerry::collision {

std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind) {
  switch (kind) {
    case BroadphaseKind::tree:
      return make_tree_broadphase();
    case BroadphaseKind::sweep_and_prune:
      return make_sweep_broadphase();
    case BroadphaseKind::fcl:
      return make_fcl_broadphase();
  }
  return nullptr;
}

void drop_pairs_of(core::ContactTable& contacts, ColliderIndex collider) {
  std::size_t kept = 0;
  for (std::size_t row = 0; row < contacts.pairs.size(); ++row) {
    const core::ContactPair& pair = contacts.pairs[row];
    if (pair.a == collider || pair.b == collider) {
      core::give_manifolds(contacts, pair.first_manifold, pair.manifold_capacity);
      if (pair.flags & core::kTouching) contacts.ended.push_back(pair);
      continue;
    }
    if (kept != row) contacts.pairs[kept] = pair;
    ++kept;
  }
  if (kept == contacts.pairs.size()) return;
  contacts.pairs.resize(kept);
  contacts.active.clear();  // its rows have shifted
}

void refit_broadphase(const StepContext& step, IndexRange, Task& task) {
  step.broadphase->refit(step, task);
}

void query_pairs(const StepContext& step, IndexRange moved, Task& task) {
  step.broadphase->query_pairs(step, moved, task);
}

void merge_pairs(const StepContext& step, IndexRange, Task&) { step.broadphase->merge_pairs(step); }

}  // namespace skerry::collision
