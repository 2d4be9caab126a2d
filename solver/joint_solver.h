// Joints of one island group, solved as soft constraints within the substep loop of solve_islands.
//
//   Maths    Rows J v + bias = 0; those of a joint are solved as one block (3 for a ball, 5 for a
//            hinge) with the effective mass of the present poses; motor and limits one by one
//            before it. Soft constraints and the relax pass: Catto, "Soft Constraints" (GDC 2011)
//            and "Solver2D" (2024).
//   Numbers  Anchors are relative to the centres of mass and the error at the start of the step is
//            taken in double, so accuracy does not depend on the distance from the origin. A
//            direction in which locks leave no motion is left out of the block.
//   Order    As given to prepare(); warm_start, solve and relax go over it from front to back.
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

// Buffer of constraints, reused from group to group. In each substep: integrate velocities,
// warm_start, solve with bias, integrate poses, solve without bias. Velocity rows of dynamic bodies
// are written, never row 0 nor one without inverse mass.
class JointBatch {
 public:
  JointBatch();
  ~JointBatch();
  JointBatch(JointBatch&&) noexcept;
  JointBatch& operator=(JointBatch&&) noexcept;
  // Sets up the given joints (rows of core::Joints) in this order. `row_of` maps a BodyIndex to its
  // row in `bodies` (0 for fixed bodies; kinematic bodies have rows with inv_mass 0).
  void prepare(const core::StepContext& step, std::span<const std::uint32_t> joints,
               const SolverBodies& bodies, const std::uint32_t* row_of, float substep_dt);
  // Applies the impulses of the last substep at the present poses.
  void warm_start(const SolverBodies& bodies);
  // With bias: pulls errors in and works limits, at the poses that warm_start saw. Without: relax
  // pass, at the present poses.
  void solve(const SolverBodies& bodies, bool use_bias);
  void store(const core::StepContext& step);  // impulses back to core::Joints
  bool empty() const;

 private:
  std::vector<JointConstraint> constraints_;
  float inv_dt_ = 0;  // 1/s, of a substep
  float dt_ = 0;
  struct Softness {
    float bias_rate = 0;  // 1/s
    float mass_scale = 1;
    float impulse_scale = 0;
  } soft_;
};

// Angle of a hinge at the bodies' present poses, rad in (-pi, pi].
double hinge_angle(const core::Joint& joint, const core::Bodies& bodies);

}  // namespace skerry::solver
