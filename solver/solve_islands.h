// Solves island groups: soft-step TGS contacts and joints over all substeps, or the contacts of islands
// without joints by another SolverKind; free flight in double.
#pragma once

#include <memory>

#include "core/step_context.h"

namespace skerry::solver {

using core::IndexRange;
using core::StepContext;
using core::Task;

class SolverScratch;
struct SolverScratchDeleter {
  void operator()(SolverScratch* scratch) const;
};
using SolverScratchPtr = std::unique_ptr<SolverScratch, SolverScratchDeleter>;
SolverScratchPtr make_solver_scratch(std::uint32_t workers);

// Stage "solve_islands", per island group. Reads poses, masses, forces and contacts of its islands;
// writes motions, poses (both in double) and impulses of its own bodies, contacts and joints.
//
//   Maths    Soft contacts, substeps, relax pass: Catto, "Solver2D" (2024) and "Soft Constraints"
//            (GDC 2011). Contact-space rows: docs/solver.md.
//   Order    colours of an island's own constraint graph; neither worker count, group nor SIMD
//            width changes a bit.
//   Errors   none: a body whose state would become non-finite keeps its pose of the step before,
//            stops, and is flagged kQuarantined.
void solve_islands(const StepContext& step, IndexRange groups, Task& task);

}  // namespace skerry::solver
