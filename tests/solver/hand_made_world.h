// The data of a world without a World: bodies, joints and settings that a test fills by hand, and
// the step context over them.
#pragma once

#include <string>
#include <vector>

#include "core/step_context.h"

namespace skerry::solver {

// What kernels get where no other worker helps.
class LoneTask : public jobs::Task {
 public:
  std::uint32_t worker() const override { return 0; }
  void run_phases(jobs::PhaseProgram& program) override {
    for (std::uint32_t phase = 0; phase < program.phase_count(); ++phase)
      for (std::uint32_t block = 0; block < program.block_count(phase); ++block)
        program.run_block(phase, block, 0);
  }
};

struct HandMadeWorld {
  WorldSettings settings;
  core::Bodies bodies;
  core::ContactTable contacts;
  core::Joints joints;
  core::ForceFields fields;
  core::Islands islands;
  core::Sleepers sleepers;
  core::CallbackErrors errors;
  std::vector<std::string> warnings;
  double dt = 1.0 / 60;
  double time = 0;

  core::StepContext context();

  struct Body {
    double mass = 1;
    Vec3 moments = {1, 1, 1};  // kg m^2, of the body axes
    Vec3 center = Vec3::Zero();
    Quat orientation = Quat::Identity();
    Vec3 linear = Vec3::Zero();
    Vec3 angular = Vec3::Zero();
    std::uint32_t flags = core::kDynamic | core::kAwake | core::kAllowSleep;
    double linear_damping = 0, angular_damping = 0, gravity_scale = 1;
  };
  core::BodyIndex add(const Body& body);
  // As above, with any inertia tensor.
  core::BodyIndex add(const Body& body, const Mat3& inertia);
  core::BodyIndex add_fixed(const Vec3& center = Vec3::Zero());
  core::BodyIndex add_kinematic(const Vec3& center, const Vec3& linear, const Vec3& angular);

  // Flies one body over steps of dt.
  void fly(core::BodyIndex body, int steps = 1);
  double kinetic_energy(core::BodyIndex body) const;  // J, translation and rotation
};

// The moments of a solid box with these full sizes, kg m^2.
Vec3 box_moments(double mass, const Vec3& size);

}  // namespace skerry::solver
