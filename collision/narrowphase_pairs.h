// From a pair of colliders to a query in the pair's own frame, and from patches back to manifolds.
#pragma once

#include "collision/apart_pairs.h"
#include "collision/narrowphase_kernels.h"
#include "core/step_context.h"

namespace skerry::collision {

// Manifolds keep their impulses while their normals differ by less than this (cosine of 18 degrees).
inline constexpr float kSameNormal = 0.95f;
// m: Query::margin up to which a pair counts as slow without a look at its bodies.
inline constexpr float kSlowMargin = 2 * kSpeculativeDistance;
// Query::touch of a pair that is not fast.
inline constexpr float kNoTouch = 3e38f;

// How far two bodies are apart and how far they may come together: little to compute, and enough to
// leave out most pairs that do not touch.
struct PairApproach {
  V3f between;   // m, from the centre of mass of body a to that of body b
  V3f velocity;  // m/s, of b's centre relative to a's
  float margin;  // m, see Query
};
PairApproach pair_approach(const StepContext& step, const core::ContactPair& pair);

// See Query::touch. `between` as in PairApproach.
float fast_touch(const StepContext& step, const core::ContactPair& pair, const V3f& between);
// Whether the centres and axes of both colliders are those of their bodies.
bool in_place(const StepContext& step, const core::ContactPair& pair);

// m: how far the spheres about the two bodies that hold the colliders are apart; negative: they overlap.
float spheres_apart(const StepContext& step, const core::ContactPair& pair,
                    const PairApproach& approach);

// Fetches a manifold that will be written.
void prefetch(const core::Manifold& manifold);
// Fetches what will be read of a pair, and the manifold it had.
void prefetch_pair(const StepContext& step, const core::ContactPair& pair);

// Two spheres about the centres of their bodies, where no turning matters: the whole way from the
// pair to its manifold. False, and nothing done, for any other pair.
bool collide_centered_spheres(const StepContext& step, const ApartPairs& known,
                              core::ContactPair& pair);

// Two colliders, in the frame whose origin is the centre of mass of body a.
struct PairFrame {
  V3f between;                       // m, centre of mass of body b
  core::Q4f rotation_a, rotation_b;  // shape axes in world axes
  V3f center_a, center_b;            // m, origins of the shape frames
  V3f linear, angular;               // see Query
  float slop, margin;
  float dt;
  float touch;  // see Query
};
void pair_frame(const StepContext& step, const core::ContactPair& pair,
                const PairApproach& approach, PairFrame& frame);

// What pair_frame gives, with rotation matrices and, for planes, heights.
struct PlacedPair {
  PlacedShape a, b;
  Query query;
};
PlacedPair placed_pair(const StepContext& step, const core::ContactPair& pair,
                       const PairFrame& frame);

// The same two seen from the other side: b first.
PlacedPair swapped(const PlacedPair& pair);

// Patches of one pair, as many as its manifolds may be.
struct PatchSet {
  std::uint32_t count = 0;
  ContactPatch patch[core::kMeshManifolds];
};

// Leaves out the points of a fast pair that are farther apart than `touch` and come together fast.
// Where those meet, if they do, continuous collision finds out. Not of pairs that are to be stopped by
// contacts, in a crowd or with what joints hold to them (docs/decisions/0016). `linear`, `angular`: see
// Query. `triangles`: scratch.
void drop_foreseen(const StepContext& step, const core::ContactPair& pair, float touch,
                   const V3f& linear, const V3f& angular, std::vector<std::uint32_t>& triangles,
                   PatchSet& patches);

// Writes patches into the pair's manifolds: impulses are carried over from the manifolds they
// replace by feature, or, for points whose feature is new, from the nearest point that is left.
// Sets flags and manifold count, and the materials of a contact that begins. `linear`, `angular`: see
// Query.
void store_patches(const StepContext& step, core::ContactPair& pair, const PatchSet& patches,
                   const V3f& linear, const V3f& angular);

// See Manifold::rounding_a; `orientation` of the collider's body.
float rounding(const StepContext& step, core::ColliderIndex index, const Quat& orientation,
               const V3f& normal);

// Forgets the pair's contact.
void clear_contact(core::ContactPair& pair);

}  // namespace skerry::collision
