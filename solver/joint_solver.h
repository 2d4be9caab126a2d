// Joints of one island group, solved as soft constraints within the substep loop of solve_islands.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/joints_data.h"
#include "core/step_context.h"
#include "solver/solver_body.h"

namespace skerry::solver {

// A joint with everything the substeps need; lives in a worker's scratch for one group.
struct JointConstraint;

// Buffer of constraints, reused from group to group.
class JointBatch {
 public:
  JointBatch();
  ~JointBatch();
  // Sets up the given joints (rows of core::Joints) in this order. `row_of` maps a BodyIndex to its
  // row in `bodies` (0 for fixed bodies; kinematic bodies have rows with inv_mass 0).
  void prepare(const core::StepContext& step, std::span<const std::uint32_t> joints,
               const SolverBodies& bodies, const std::uint32_t* row_of, float substep_dt);
  void warm_start(const SolverBodies& bodies);
  // With bias: pulls errors in and works limits; without: relax pass.
  void solve(const SolverBodies& bodies, bool use_bias);
  void store(const core::StepContext& step);  // impulses back to core::Joints
  bool empty() const;

 private:
  std::vector<JointConstraint> constraints_;
};

// Angle of a hinge at the bodies' present poses, rad in (-pi, pi].
double hinge_angle(const core::Joint& joint, const core::Bodies& bodies);

}  // namespace skerry::solver
