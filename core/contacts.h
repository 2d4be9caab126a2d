// Pairs of colliders whose bounds overlap, and their contact manifolds.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/colliders.h"
#include "core/vec.h"

namespace skerry::core {

struct ManifoldPoint {
  V3f position;      // m, world axes, from the centre of mass of body a; halfway between the
                     // two surfaces
  float separation;  // m along the normal, negative when penetrating
};

// Up to four points that share a normal. Rows of four floats, as the solver loads and stores them.
struct alignas(32) Manifold {
  V3f normal{0, 0, 0};  // unit, world, from a to b
  std::uint32_t point_count = 0;
  ManifoldPoint points[4];
  // Warm start: impulses of the last substep.
  float normal_impulse[4] = {};   // N s, of the points; matched by feature from step to step
  V3f friction_impulse{0, 0, 0};  // N s, world, on b
  float twist_impulse = 0;        // N m s about the normal, on b
  V3f rolling_impulse{0, 0, 0};   // N m s, world, on b
  float total_impulse = 0;        // N s along the normal over the whole step, for events
  // Of the two materials together; written when the contact begins.
  float friction = 0, restitution = 0;
  float rolling_resistance = 0;   // m
  float approach_speed = 0;       // m/s at the start of the step, for events and restitution
  std::uint32_t feature[4] = {};  // of the points: which features touch; the same while they do
  // N s, normal, of a mean point in a substep: what the contact bears without giving way.
  float carried_impulse = 0;
  // m, radius of the rounding of a surface that touches with it, along the normal: as the body turns
  // another point of it comes to where this one was. 0: what touches turns with the body.
  float rounding_a = 0, rounding_b = 0;
  // Likewise: what it is held to bear for good, and at most by the statics of bodies at rest; 0 until that
  // is known (solver/standing_loads.h).
  float standing_impulse = 0, statics_impulse = 0;
  float pressed_time = 0;  // s, since when it has pressed without a break
  bool begins = false;     // with the two bodies at rest with each other; nothing has solved it yet
  bool placed = false;     // so it has begun, and not by a motion
  bool settled = false;    // loads of statics were shared since it began
  // s after the start of the step: when the two are foreseen to touch for a bounce. Normal and places
  // are those of that time, separations those that lead there (collision/touch_forecast.h). 0: of the
  // start of the step.
  float touch_time = 0;
};

enum PairFlag : std::uint32_t {
  kTouching = 1u << 0,  // a manifold has points, or a sensor overlaps
  kBegun = 1u << 1,     // its begin event was told, its end event was not
  kSensorPair = 1u << 2,
  kFallback = 1u << 3,  // the narrowphase went through FCL this step
  kUnseen = 1u << 4,    // new or changed while nobody in it is awake: active for one step
};

// Manifolds per pair: one for convex pairs, up to this many (one per cluster of normals) if a mesh
// takes part.
inline constexpr std::uint32_t kMeshManifolds = 4;

struct ContactPair {
  ColliderIndex a = 0, b = 0;  // a < b
  BodyIndex body_a = 0, body_b = 0;
  std::uint32_t first_manifold = 0;  // into ContactTable::manifolds
  std::uint16_t manifold_capacity = 1;
  std::uint16_t manifold_count = 0;  // of those, how many have points
  std::uint32_t flags = 0;
  std::uint32_t cache = 0;  // narrowphase's own (separating axis, feature); survives steps

  std::uint64_t key() const { return (std::uint64_t{a} << 32) | b; }
};

// Where the second of two shapes is in the frame of the first.
struct RelativePose {
  M3f rotation;  // axes of the second
  V3f offset;    // m, origin of the second
};

// What the narrowphase knows of two polytopes from earlier steps. Belongs to ContactPair::cache; means
// nothing while that is 0.
struct alignas(32) PolytopeMemory {
  // The last manifold made of features, and where the two were then.
  RelativePose made_at;
  // m: it stands for the features until some point of the second has come so far in the frame of the
  // first; negative: there is none.
  float budget = -1;
  std::uint32_t point_count = 0;
  V3f normal;                 // unit, from the first to the second, in the frame of the first
  bool turns_with_b = false;  // the normal is that of a face of the second
  // Which faces beside the edges that crossed last were taken for the contact.
  bool left_of_a = true, left_of_b = true;
  struct Point {
    V3f on_a;  // m, in the frame of the first
    float separation;
  } points[4];
  std::uint32_t feature[4];

  // When all separating axes were last compared: where the two were, and the best separation, m.
  RelativePose searched_at;
  float separation = 0;
};

struct ContactTable {
  std::vector<ContactPair> pairs;   // ascending key
  std::vector<Manifold> manifolds;  // pool; a pair's manifolds are consecutive
  // Of pairs with a hull, in the row of the first manifold; shorter than `manifolds` may be.
  std::vector<PolytopeMemory> polytope_memory;
  // [manifolds]: m, separations of the points at Manifold::touch_time, where that is not 0.
  std::vector<std::array<float, 4>> touch_gaps;
  // [manifolds], likewise: m, up to which the ways of the two bodies may add up (collision::Travels)
  // before the pair can have a contact; 0 for a new pair.
  std::vector<double> apart_until;
  std::vector<std::uint32_t> free_single;  // free rows of capacity 1
  std::vector<std::uint32_t> free_mesh;    // free runs of capacity kMeshManifolds
  // Rows, ascending, of pairs with an awake body or to be looked at once; the narrowphase's items.
  std::vector<std::uint32_t> active;
  // Pairs that vanished while touching or begun, for "end" events; ascending key.
  std::vector<ContactPair> ended;
};

// Manifold pool. What is taken holds anything but apart_until.
std::uint32_t take_manifolds(ContactTable& table, std::uint32_t capacity);
// Makes the row of a pair of polytopes in polytope_memory.
void take_memory(ContactTable& table, std::uint32_t first_manifold);
void give_manifolds(ContactTable& table, std::uint32_t first, std::uint32_t capacity);

float combined_restitution(const Collider& a, const Collider& b);
// m/s: approaches of bodies in flight that are slower do not bounce. `threshold`: of the settings. The bounces
// that would follow get fewer by 1 - restitution each: without a loss they go on for ever.
inline float slowest_bounce(float threshold, float restitution) {
  return threshold * std::max(0.0f, std::min(1.0f, 2 * (1 - restitution)));
}
// Combines the materials of a pair (see skerry::Material) into its manifolds.
void set_materials(ContactTable& table, const ContactPair& pair, const Collider& a,
                   const Collider& b);

}  // namespace skerry::core
