// Islands of one step, and the groups in which they become jobs.
#pragma once

#include <cstdint>
#include <vector>

#include "core/bodies.h"

namespace skerry::core {

// Bodies that touch or are joined, directly or through others; fixed and kinematic bodies do not
// connect. Bodies ascend by index, contacts by (pair key, manifold), joints by row.
struct Island {
  std::uint32_t first_body = 0, body_count = 0;        // into Islands::bodies
  std::uint32_t first_contact = 0, contact_count = 0;  // into Islands::contacts
  std::uint32_t first_joint = 0, joint_count = 0;      // into Islands::joints
  float still_time = 0;   // s, least over its bodies; written when solved
  bool isolated = false;  // nothing but contacts among its bodies acted on it; likewise
};

enum class GroupKind : std::uint8_t {
  packed,  // whole islands, solved side by side in cache
  wide,    // one large island, shared by all workers
  free,    // bodies without contact or joint, and kinematic ones
};

struct IslandGroup {
  GroupKind kind = GroupKind::packed;
  std::uint32_t first = 0, count = 0;  // islands; for `free` rows of Islands::free_bodies
};

// A manifold that takes part in the solve.
struct ContactRef {
  std::uint32_t manifold = 0;  // into ContactTable::manifolds
  std::uint32_t pair = 0;      // into ContactTable::pairs
};

struct Islands {
  std::vector<BodyIndex> bodies;
  std::vector<ContactRef> contacts;
  std::vector<std::uint32_t> joints;
  std::vector<Island> islands;
  std::vector<BodyIndex> free_bodies;  // ascending
  std::vector<IslandGroup> groups;     // in the order in which they should be started
};

// Sleeping islands keep their members, so that they wake as a unit.
struct Sleepers {
  std::vector<std::vector<BodyIndex>> islands;  // empty where free
  std::vector<std::uint32_t> free_rows;
};

}  // namespace skerry::core
