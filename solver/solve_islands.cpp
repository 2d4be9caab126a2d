#include "solver/solve_islands.h"

#include "solver/fast_watch.h"
#include "solver/free_flight.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {

namespace {

// Of all its islands or of none: see IslandBuilder::make_groups.
bool has_joints(const core::Islands& islands, const core::IslandGroup& group) {
  return islands.islands[group.first].joint_count > 0;
}

template <class Solver>
void run(Solver& solver, const core::IslandGroup& group, Task& task) {
  if (group.kind == core::GroupKind::wide) {
    task.run_phases(solver);
  } else {
    solver.run_serially();
  }
}

}  // namespace

void SolverScratchDeleter::operator()(SolverScratch* scratch) const { delete scratch; }

SolverScratchPtr make_solver_scratch(std::uint32_t workers) {
  return SolverScratchPtr(new SolverScratch(workers));
}

void solve_islands(const StepContext& step, IndexRange groups, Task& task) {
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
    const std::uint32_t worker = task.worker();
    switch (has_joints(*step.islands, group) ? SolverKind::soft_step_tgs
                                             : step.settings->solver.kind) {
      case SolverKind::soft_step_tgs:
        step.solver->groups[worker].begin(step, group, *step.solver->kernels, task);
        run(step.solver->groups[worker], group, task);
        break;
      case SolverKind::pgs:
        step.solver->pgs[worker].begin(step, group);
        run(step.solver->pgs[worker], group, task);
        break;
      case SolverKind::penalty:
        step.solver->penalty[worker].begin(step, group);
        run(step.solver->penalty[worker], group, task);
        break;
    }
  }
}

}  // namespace skerry::solver
