// Bodies as the contact and joint solvers see them: float rows relative to the start of the step,
// gathered per island group, so that a group stays in cache for all its substeps.
#pragma once

#include <cstdint>

#include "core/bodies.h"
#include "core/vec.h"

namespace skerry::solver {

inline constexpr float kBearing = 1e9f;
struct alignas(32) VelocityRow {
  core::V3f linear;  // m/s
  // After the substeps: contacts that push it; kBearing once one of them bears a load.
  float pushes;
  core::V3f angular;  // rad/s, world
  float struck;       // after the substeps: above 0 if an impact among several bodies reaches it
};
// Motion since the start of the step.
struct alignas(32) DeltaRow {
  core::V3f translation;  // m, of the centre of mass
  // J/kg: of ContactPass::flown, what external forces gave over what fixed bodies moved it by.
  float fallen;
  core::Q4f rotation;  // q_now = rotation * q_start
};
struct alignas(32) MassRow {
  float inv_mass;            // 1/kg; 0 for fixed and kinematic
  core::Sym3f inv_inertia;   // world, at the start of the step; locked axes cleared
  std::uint32_t lock_flags;  // core::kLockMask bits: translation locks mask inv_mass per axis
};
struct alignas(32) BaseRow {
  core::V3f acceleration;  // m/s^2, external (gravity, forces), frozen over the step
  float patch_lever;       // m: of friction about the normal where it touches at one point; 0: none
  core::Q4f orientation;   // at the start of the step
};

// Views of the rows of one group, [count]. Row 0 is a dummy: fixed bodies and padding lanes map to
// it; it is read as "does not move" and whatever is written to it is discarded.
struct SolverBodies {
  VelocityRow* velocity;
  DeltaRow* delta;
  MassRow* mass;
  BaseRow* base;
  const core::BodyIndex* body;  // [count] row in core::Bodies; [0] is kNone
  std::uint32_t count;
};

}  // namespace skerry::solver
