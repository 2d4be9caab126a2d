// The step as a table: what runs, on what, in which order.
#pragma once

#include <skerry/jobs/task_graph.h>

#include "core/step_context.h"

namespace skerry::pipeline {

struct WorldData;

// What stages read and write.
enum class Data : std::uint64_t {
  inbox = 1u << 0,       // posted commands
  poses = 1u << 1,       // poses of bodies
  velocities = 1u << 2,  // velocities and angular momenta
  forces = 1u << 3,      // user forces gathered for this step
  masses = 1u << 4,
  shapes = 1u << 5,      // colliders
  awake_set = 1u << 6,   // which bodies are simulated, sleeping islands
  bounds = 1u << 7,      // tight and fat boxes, moved marks
  tree = 1u << 8,        // the broadphase's structure
  candidates = 1u << 9,  // pairs that the queries found
  pairs = 1u << 10,      // the pair list
  contacts = 1u << 11,   // manifolds and their impulses
  joints = 1u << 12,
  islands = 1u << 13,     // islands, groups, sleep timers
  transforms = 1u << 14,  // poses of body frames, for the game
  events = 1u << 15,
  snapshot = 1u << 16,
  sweeps = 1u << 17,  // fast bodies, what they meet and when
  flags = 1u << 18,   // marks of bodies: awake, changed, forced, fast, set aside
};

// How a stage's work splits.
enum class Per : jobs::Domain {
  step = jobs::kOnce,
  body,
  moved_collider,
  pair,
  island_group,
  fast_pair
};

// Builds the table. The context of a run is a WorldData.
jobs::TaskGraph describe_step();

}  // namespace skerry::pipeline
