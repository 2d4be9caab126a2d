// What the solver keeps from step to step: buffers that only grow, per world and per worker.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/step_context.h"
#include "solver/contact_blocks.h"
#include "solver/disjoint_sets.h"
#include "solver/group_solver.h"
#include "solver/moment_shift.h"
#include "solver/penalty_solver.h"
#include "solver/pgs_solver.h"
#include "solver/solve_islands.h"

namespace skerry::solver {

// A moving kinematic body as it was at the start of the solve: its own flight, in another group,
// may already have moved it.
struct KinematicStart {
  core::BodyIndex body;
  Vec3 center;
  Quat orientation;
  Vec3 linear, angular;
};

// Where the solver finds a body: a position in Islands::bodies, or kKinematicSlot | a position in
// `kinematics`, or kNone (fixed, resting kinematic, free).
inline constexpr std::uint32_t kKinematicSlot = 0x80000000u;

// A contact that is solved, and a solved body in it.
struct FoundContact {
  core::ContactRef ref;
  core::BodyIndex body;
};

// Buffers of build_islands; `slot` and `kinematics` are read by all groups in the same step.
struct IslandScratch {
  std::vector<std::uint32_t> slot;       // [body rows]
  std::vector<core::BodyIndex> slotted;  // whose slots are set
  std::vector<KinematicStart> kinematics;

  DisjointSets sets;                             // of bodies with a contact or joint
  std::vector<std::uint32_t> island;             // [body rows] of those bodies
  std::vector<std::vector<FoundContact>> found;  // [block of pairs] in pair order
  std::vector<std::uint32_t> part_counts;        // [(part of the blocks, island)] contacts
  std::vector<std::uint32_t> next_body;          // [islands] into Islands::bodies
  std::vector<std::uint32_t> joints;
  std::vector<core::BodyIndex> joint_body;
  std::vector<std::uint32_t> rows;  // all pairs, when a wake made `active` stale
  struct Cost {
    core::IslandGroup group;
    std::uint64_t cost;
  };
  std::vector<Cost> groups;
};

class SolverScratch {
 public:
  explicit SolverScratch(std::uint32_t workers) : groups(workers), pgs(workers), penalty(workers) {}

  IslandScratch islands;
  std::vector<GroupSolver> groups;     // [worker]
  std::vector<PgsSolver> pgs;          // [worker]
  std::vector<PenaltySolver> penalty;  // [worker]
  const ContactKernels* kernels = best_kernels();
  MomentShift moment;                        // of stop_at_impacts
  std::vector<MomentChange> moment_changes;  // likewise
  bool never_wide = false;                   // for tests: large islands take the packed path
  bool always_wide = false;
};

}  // namespace skerry::solver
