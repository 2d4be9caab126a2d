// Penalty forces, as in the discrete element method: a row to be measured against soft-step TGS.
//
//   Maths    Along the normal a linear spring and dashpot that never pull; across it a spring that
//            remembers how far the contact has been sheared, with a dashpot, and slips at the round
//            friction cone (Cundall and Strack 1979, "A discrete numerical model for granular
//            assemblies"; Luding 2008 for the slipping spring, twist and rolling). The history of
//            shear lives in the manifold's impulses from step to step.
//   Numbers  All springs of a contact swing at PenaltySettings::hertz with the effective mass that they
//            meet, so a body sinks into the ground by g / (2 pi hertz)^2. Damping from the restitution
//            e of a linear spring-dashpot, ln e = -pi z / sqrt(1 - z^2); z = 0.7 for what does not
//            bounce, and since contacts do not pull, that still rebounds with about a fifth of its
//            speed (Schwager and Poeschel 2007).
//   Limits   Explicit: stable while 2 pi hertz dt / substeps is below 2 / n or so, where n counts the
//            contacts of a body; overlap grows with the load, a light body under a heavy one gives
//            way in proportion to their masses, and what is faster than its own size times hertz goes
//            through. Contacts are found once per step: tumbling bodies want steps of 1/240 s or less.
//   Joints   Islands with joints are solved by soft-step TGS.
#pragma once

#include <vector>

#include "solver/point_group.h"

namespace skerry::solver {

class PenaltySolver final : public PointProgram {
 public:
  void begin(const core::StepContext& step, const core::IslandGroup& group);

 private:
  struct Spring {
    double stiffness = 0, damping = 0;    // N/m, N s/m, along the normal, of each point
    double shear = 0, shear_damping = 0;  // across it, at the centre
    double turn = 0, turn_damping = 0;    // N m/rad, N m s/rad, about it
    double bend = 0, bend_damping = 0;    // about the tangents: rolling
    double slide[2] = {};                 // m, along the tangents
    double twist = 0;                     // rad
    double roll[2] = {};                  // rad
  };
  void run_contact(Op op, PointContact& contact) override;
  void run_body(Op op, std::uint32_t row) override;
  void prepare(PointContact& c, Spring& spring) const;
  void press(PointContact& c, Spring& spring);
  void resist(PointContact& c, Spring& spring, double force, double moment, const Vec3& v,
              const Vec3& spin);
  double opened(const PointContact& c, const Vec3& point) const;
  void arms(const PointContact& c, const Vec3& point, Vec3& arm_a, Vec3& arm_b) const;
  void store(PointContact& c);

  double h_ = 0;                 // s, of a substep
  std::vector<Spring> springs_;  // [contacts]
};

// Damping ratio at which a linear spring-dashpot rebounds with restitution e in [0, 1].
double damping_ratio(double e);

}  // namespace skerry::solver
