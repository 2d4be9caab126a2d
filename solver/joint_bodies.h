// Jointed bodies in double, beside the float rows that contacts work on. Joints act on these; what
// contacts change in a float row meanwhile is taken over when the body is next touched.
//
//   Maths    Rotation is driven by the angular momentum: it is held while the body turns by the
//            velocity at the middle of the substep, so spin is conserved to rounding and no
//            gyroscopic term is needed.
//   Order 2  Substeps kick (forces, joints) and then drift (poses). A body of a `smooth` island is
//            kicked for half a substep first and half a substep last: Stoermer-Verlet, second order,
//            exact for a parabola. Others take whole kicks, as contacts need them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/step_context.h"
#include "solver/forces.h"
#include "solver/joint_coordinates.h"
#include "solver/solver_body.h"

namespace skerry::solver {

struct JointBody {
  V3d linear, angular;  // m/s, rad/s, world
  V3d inv_mass;         // 1/kg per axis
  Sym3d inv_inertia;    // response to impulses, world, at the present pose; locked axes cleared
  JointPose pose;
};

struct JointVelocity {
  V3d linear, angular;
};

class JointBodies {
 public:
  // All rows of a group; none is owned. `velocity` and `delta` are its float rows.
  void begin(std::uint32_t rows, std::uint32_t dynamic_end);
  void bind(VelocityRow* velocity, DeltaRow* delta) {
    velocity_ = velocity;
    delta_ = delta;
  }
  // Rows [first, first + count) are those of a jointed island; `touched`: contacts work on them too.
  void own(std::uint32_t first, std::uint32_t count, bool smooth, bool touched);
  bool owns(std::uint32_t row) const { return moves_[row].owned; }
  bool smooth(std::uint32_t row) const { return moves_[row].smooth; }
  bool any_smooth() const { return any_smooth_; }

  // Joints pull at the body's arms so that they resist turning (N m/rad, world). Where that is faster
  // than substeps can follow, the body answers impulses with more inertia than it has; its spin is
  // then not conserved. Before gather.
  void add_stiffness(std::uint32_t row, const Sym3d& stiffness);
  void gather(const core::StepContext& step, std::uint32_t row, core::BodyIndex body,
              const ExternalForce& force);
  void gather_kinematic(std::uint32_t row, const JointPose& pose, const V3d& linear,
                        const V3d& angular);

  // `kick`: fraction of a substep for smooth bodies, which alone are kicked if `only_smooth`.
  void kick(std::uint32_t begin, std::uint32_t end, double h, double fraction, bool only_smooth);
  void drift(std::uint32_t begin, std::uint32_t end, double h);
  // Float rows follow.
  void publish_velocities(std::uint32_t begin, std::uint32_t end);

  // The state at the end of the step.
  void result(const core::Bodies& bodies, std::uint32_t row, core::BodyIndex body,
              core::BodyPose& pose, core::BodyMotion& motion);

  bool solved(std::uint32_t row) const { return row - 1 < dynamic_end_ - 1; }
  // A body up to date with its float row. Row 0 does not move.
  const JointBody& load(std::uint32_t row) {
    if (touched_[row]) absorb(row);
    return bodies_[row];
  }
  const JointVelocity& before_kick(std::uint32_t row) const { return before_[row]; }
  const JointBody& at(std::uint32_t row) const { return bodies_[row]; }
  // Where the body would be after another drift.
  JointPose pose_after(std::uint32_t row, double h);
  void store(std::uint32_t row, const V3d& linear, const V3d& angular) {
    if (!solved(row)) return;
    bodies_[row].linear = linear;
    bodies_[row].angular = angular;
    if (touched_[row]) publish(row);
  }

 private:
  // What moves a body and how it turns.
  struct Move {
    Sym3d inertia_b, inv_inertia_b;
    Sym3d stiffness;
    Sym3d response_b;  // inverse inertia, with what stiffness adds
    V3d acceleration, torque;
    double linear_damping, angular_damping;
    JointPose start;
    bool owned = false, smooth = false;
    bool spins;      // turning changes its angular velocity
    bool isotropic;  // and not even its inverse inertia
    bool stiff;
    std::uint32_t locks;
    const core::BodyMass* mass;
  };
  void absorb(std::uint32_t row);
  void publish(std::uint32_t row);
  void stiffen(std::uint32_t row, double h);
  static void turn(JointBody& body, const Move& move, double h);

  std::vector<JointBody> bodies_;
  std::vector<JointVelocity> before_;  // the latest kick
  std::vector<Move> moves_;
  std::vector<std::uint8_t> touched_;   // float rows change between joints
  std::vector<VelocityRow> published_;  // as written to velocity_ last
  VelocityRow* velocity_ = nullptr;
  DeltaRow* delta_ = nullptr;
  std::uint32_t dynamic_end_ = 1;
  bool any_smooth_ = false;
};

}  // namespace skerry::solver
