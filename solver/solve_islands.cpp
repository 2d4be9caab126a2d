#include "solver/solve_islands.h"

#include "solver/fast_watch.h"
#include "solver/free_flight.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {

void SolverScratchDeleter::operator()(SolverScratch* scratch) const { delete scratch; }

SolverScratchPtr make_solver_scratch(std::uint32_t workers) {
  return SolverScratchPtr(new SolverScratch(workers));
}

void solve_islands(const StepContext& step, IndexRange groups, Task& task) {
  GroupSolver& solver = step.solver->groups[task.worker()];
  for (std::uint32_t i = groups.begin; i < groups.end; ++i) {
    const core::IslandGroup& group = step.islands->groups[i];
    if (group.kind == core::GroupKind::free) {
      for (std::uint32_t k = 0; k < group.count; ++k) {
        const core::BodyIndex body = step.islands->free_bodies[group.first + k];
        FastWatch watch(step, body);
        fly_free(step, body);
        watch.finish(core::FastFlight::free);
      }
      continue;
    }
    solver.begin(step, group, *step.solver->kernels);
    if (group.kind == core::GroupKind::wide) {
      task.run_phases(solver);
    } else {
      solver.run_serially();
    }
  }
}

}  // namespace skerry::solver
