// Sequential impulses, the classic projected Gauss-Seidel of game physics: a row to be measured
// against soft-step TGS.
//
//   Maths    One step of dt, no substeps: warm start, `iterations` passes over friction and then the
//            normals of each manifold, each impulse accumulated and clamped (Catto, "Fast and Simple
//            Physics using Sequential Impulses", GDC 2006; "Iterative Dynamics with Temporal
//            Coherence", 2005). Contacts are those of the other solver: a round friction cone at the
//            centre of the manifold, twist and rolling resistance. Restitution by Newton's law in a
//            last pass.
//   Overlap  Either added to the velocities (Baumgarte 1972), which gives what is pushed out speed,
//            or solved for in velocities of its own that move bodies once and are forgotten (split
//            impulses, as in Catto 2006).
//   Limits   Stable at any dt and iteration count, but not converged: heavy on light and tall stacks
//            sink and sway. correction_rate above 1 overshoots.
//   Joints   Islands with joints are solved by soft-step TGS.
#pragma once

#include <vector>

#include "solver/point_group.h"

namespace skerry::solver {

class PgsSolver final : public PointProgram {
 public:
  void begin(const core::StepContext& step, const core::IslandGroup& group);

 private:
  struct Row {
    double mass[4], bias[4];  // kg, m/s: wanted speed of the points along the normal
    double push_speed[4], push_mass_impulse[4];  // split: m/s wanted, N s so far
    double slide[3], twist, roll[3];             // responses
  };
  void run_contact(Op op, PointContact& contact) override;
  void run_body(Op op, std::uint32_t row) override;
  void prepare(PointContact& c, Row& row) const;
  void warm_start(PointContact& c);
  void solve_friction(PointContact& c, const Row& row);
  void solve_normals(PointContact& c, Row& row);
  void solve_overlap(PointContact& c, Row& row);
  void restitute(PointContact& c, const Row& row);
  void store(PointContact& c);

  double dt_ = 0;
  PgsSettings settings_;
  std::vector<Row> rows_;  // [contacts]
};

}  // namespace skerry::solver
