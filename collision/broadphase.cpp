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

namespace {

template <class Condition>
void drop_pairs_if(core::ContactTable& contacts, const Condition& condition) {
  std::size_t kept = 0;
  for (std::size_t row = 0; row < contacts.pairs.size(); ++row) {
    const core::ContactPair& pair = contacts.pairs[row];
    if (condition(pair)) {
      core::give_manifolds(contacts, pair.first_manifold, pair.manifold_capacity);
      if (pair.flags & (core::kTouching | core::kBegun)) contacts.ended.push_back(pair);
      continue;
    }
    if (kept != row) contacts.pairs[kept] = pair;
    ++kept;
  }
  if (kept == contacts.pairs.size()) return;
  contacts.pairs.resize(kept);
  contacts.active.clear();  // its rows have shifted
}

}  // namespace

void drop_pairs_of(core::ContactTable& contacts, ColliderIndex collider) {
  drop_pairs_if(contacts, [collider](const core::ContactPair& pair) {
    return pair.a == collider || pair.b == collider;
  });
}

void drop_pairs_of_body(core::ContactTable& contacts, core::BodyIndex body) {
  drop_pairs_if(contacts, [body](const core::ContactPair& pair) {
    return pair.body_a == body || pair.body_b == body;
  });
}

void refit_broadphase(const StepContext& step, IndexRange, Task& task) {
  step.broadphase->refit(step, task);
}

void query_pairs(const StepContext& step, IndexRange moved, Task& task) {
  step.broadphase->query_pairs(step, moved, task);
}

void merge_pairs(const StepContext& step, IndexRange, Task& task) {
  step.broadphase->merge_pairs(step, task);
}

}  // namespace skerry::collision
