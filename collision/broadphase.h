// Broadphase: which colliders may touch. Keeps the pair list of ContactTable, in (a, b) order.
#pragma once

#include <memory>

#include <skerry/settings.h>

#include "collision/apart_pairs.h"
#include "collision/bounds.h"

namespace skerry::collision {

// How far a pair may be apart and still get a manifold, beside what its velocity adds.
inline constexpr float kSpeculativeDistance = 0.005f;  // m

// The three kinds (our tree, sweep and prune, FCL's manager) differ in how they find pairs and in
// nothing else: the pair list after merge_pairs is "all pairs of fat boxes that overlap, whose
// filters meet, of different bodies, one of them dynamic - or one kinematic and one a sensor's -,
// not joined" - the same list whatever the kind.
class Broadphase {
 public:
  virtual ~Broadphase() = default;

  // Between steps. `add` takes in those colliders of a body that are not in yet; a collider is in
  // from there to remove. `touch` gives all of a body new bounds at its present pose and has its
  // pairs checked anew: after a teleport, a change of the body's type, of a filter, or of a shape's
  // place or size. What it knows of a collider it copies here. Joints need no touch: changes of
  // Joints::no_collide are seen.
  virtual void add(const core::Bodies& bodies, const core::Colliders& colliders,
                   core::BodyIndex body) = 0;
  virtual void remove(ColliderIndex collider) = 0;
  virtual void touch(const core::Bodies& bodies, const core::Colliders& colliders,
                     core::BodyIndex body) = 0;

  // Fat box of a collider.
  virtual const Aabb& fat_bounds(ColliderIndex collider) const = 0;
  // Appends the colliders whose fat box meets this one, ascending; as of the last refit. Any number
  // of threads at once.
  virtual void collect(const Aabb& box, std::vector<ColliderIndex>& found) const = 0;

  // Whether the pair list has the two, as of the last merge_pairs. Any number of threads at once.
  virtual bool is_pair(ColliderIndex a, ColliderIndex b) const = 0;

  // Of the bodies, as of the last update_bounds.
  virtual Travels& travels() = 0;

  // -- Stages; see the functions below.
  virtual void update_bounds(const StepContext& step, IndexRange awake_bodies, Task& task) = 0;
  virtual void refit(const StepContext& step, Task& task) = 0;
  virtual std::uint32_t moved_count() const = 0;
  // How often the last step's stages read or wrote a proxy: those that moved, those they found near
  // them, and those whose pairs were listed anew. Fixed and sleeping bodies add nothing to it.
  virtual std::uint64_t proxies_touched() const = 0;
  // How often the structure was built anew beside the queries of a step.
  virtual std::uint32_t built_ahead_count() const { return 0; }
  virtual void query_pairs(const StepContext& step, IndexRange moved, Task& task) = 0;
  virtual void merge_pairs(const StepContext& step, Task& task) = 0;
};

std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind);

// Removes all pairs of a collider, or of a body's colliders, from the table. Touching ones go to
// ContactTable::ended, so that their "end" events come with the next step. ContactTable::active is
// empty afterwards if there were any, until merge_pairs fills it.
void drop_pairs_of(core::ContactTable& contacts, ColliderIndex collider);
void drop_pairs_of_body(core::ContactTable& contacts, core::BodyIndex body);

// Stages. refit_broadphase, once: gathers the moved colliders in ascending order and updates the
// structure. query_pairs, per moved collider: finds partners. merge_pairs, once: brings
// ContactTable::pairs up to date (new pairs in, pairs whose fat boxes parted out), keeps manifolds
// of persisting pairs, and fills ContactTable::active.
void refit_broadphase(const StepContext& step, IndexRange, Task& task);
void query_pairs(const StepContext& step, IndexRange moved, Task& task);
void merge_pairs(const StepContext& step, IndexRange, Task& task);

}  // namespace skerry::collision
