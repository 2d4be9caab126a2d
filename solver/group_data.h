// The bodies and contacts of one island group: what GroupSolver and its parts (IslandLoads, Impacts)
// work on together. Filled by GroupSolver.
#pragma once

#include <cstdint>
#include <vector>

#include "core/step_context.h"
#include "solver/contact_blocks.h"
#include "solver/held_directions.h"
#include "solver/solver_body.h"

namespace skerry::solver {

// Slower meetings count as resting: what they displace at substep resolution is far below a
// millimetre.
inline constexpr float kImpactSpeed = 0.05f;  // m/s

// What contacts gave to a body over the step, in double.
struct alignas(64) Ledger {
  double impulse[3] = {}, angular_impulse[3] = {};  // N s, N m s
  float bounce_time = 0;                            // s, if it bounced; all else zero to begin with
  bool pushed = false, impact = false, bounced = false, several = false;
  HeldDirections held;
};

// What becomes of a body without contacts.
struct Outlook {
  Vec3 linear;            // m/s after external forces
  Vec3 angular_momentum;  // likewise
  float smooth_change;    // m/s: a velocity change up to this is a force's work, not an impact
  bool from_rows;         // damping: contacts alone do not account for the motion
};

struct GroupContact {
  double offset[3];  // m, centre of b from centre of a at the time of the manifold's geometry
  std::uint32_t manifold;
  ContactKind kind;
  std::uint8_t effort;  // its island's: 2^effort passes instead of one
  // Manifolds that are likely to need the same of solve_normals lie side by side in blocks. No lane
  // knows its neighbours: a matter of speed alone.
  bool loose;
};

// Rows: 0 is a dummy (solver/solver_body.h), [1, 1 + body_count) are the dynamic bodies island by island,
// then kinematic ones up to row_count. Contacts lie island by island, too. Arrays may be longer than they
// are said to be.
struct GroupData {
  const core::StepContext* step = nullptr;
  core::IslandGroup islands;  // of the step
  bool joined = false;        // its islands have joints

  std::uint32_t first_body = 0, body_count = 0;  // in Islands::bodies
  std::uint32_t row_count = 0, padded_rows = 0;  // padded: to whole blocks of lanes
  bool has_locks = false, has_reloaded = false;
  bool unequal_masses = false;        // some body is kHeavyOnLight times as heavy as another
  std::vector<core::BodyIndex> body;  // [row_count]
  std::vector<VelocityRow> velocity;  // [padded_rows], as are delta and mass
  std::vector<DeltaRow> delta;
  std::vector<MassRow> mass;
  std::vector<Ledger> ledger;  // [row_count], as is outlook
  std::vector<Outlook> outlook;

  std::uint32_t contact_count = 0;
  std::vector<GroupContact> contacts;       // [contact_count]
  std::vector<std::uint32_t> row_a, row_b;  // [contact_count]

  const core::Island& island(std::uint32_t i) const {
    return step->islands->islands[islands.first + i];
  }
  core::Manifold& manifold(std::uint32_t contact) const {
    return step->contacts->manifolds[contacts[contact].manifold];
  }
};

}  // namespace skerry::solver
