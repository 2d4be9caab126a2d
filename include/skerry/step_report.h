// What World::step() says about the step it made.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace skerry {

struct StageTime {
  const char* name = "";
  double wall_ms = 0;  // first task entered to last task left
  double cpu_ms = 0;   // sum over tasks
  std::uint32_t tasks = 0;
  // Where the executor can, an item follows its own item of the stage before, with no barrier.
  bool per_item = false;
};

// How well contacts keep their law after the solve: unilateral contact and Coulomb friction. Residuals
// are parts of the mean normal impulse of a manifold that pushes (1: as large as what an average
// contact carries); `mean` over manifolds that push, `max` the worst of them. Impulses and velocities
// are those of the step's last solver pass; bounces obey the law of impact instead and are left out of
// `normal` and `friction`.
struct ContactLaw {
  std::uint64_t manifolds = 0;         // that push
  double impulse_mean = 0;             // N s, normal, of a manifold in the last pass: the unit
  double pull_max = 0;                 // beyond lambda_n >= 0
  double cone_mean = 0, cone_max = 0;  // beyond |lambda_t| <= mu lambda_n
  // Of lambda_n v_n = 0 and v_n >= 0: sum over the points of |min(lambda_n, m v_n)|, with the
  // point's effective mass m, and v_n short of what would close a gap.
  double normal_mean = 0, normal_max = 0;
  // Of sticking, or slipping against lambda_t: how far lambda_t lies from lambda_t - m v_t, put back
  // into the cone.
  double friction_mean = 0, friction_max = 0;
};

// What contacts did in the last step. All zero without WorldSettings::measure_steps.
struct ContactMeasures {
  // J: kinetic and potential energy that contacts took from the bodies (in an impact of two bodies
  // T_before - T_after); work of kinematic bodies counts against it. Of bodies with joints or
  // damping: the work of their contact impulses at their mean velocities over the step.
  double energy_lost = 0;
  // N s, world: what fixed and kinematic bodies gave to dynamic ones. At rest: weight times dt.
  std::array<double, 3> impulse_from_ground = {};
  double normal_impulse = 0;  // N s: sum over all contacts, along their normals
  ContactLaw law;
};

// Sums over the world, on request (World::measure, StepReport::measures).
struct Measures {
  double kinetic_energy = 0;                    // J
  double potential_energy = 0;                  // J, of uniform gravity, zero at the origin
  std::array<double, 3> momentum = {};          // kg m/s
  std::array<double, 3> angular_momentum = {};  // kg m^2/s about the origin
  std::uint64_t contact_points = 0;             // with a separation of at most zero
  double penetration_mean = 0;  // m, over those points, at the start of the last step
  double penetration_max = 0;   // m
  ContactMeasures contacts;     // of the last step
};

struct StepReport {
  static constexpr std::size_t kMaxStages = 24;

  std::uint64_t step = 0;  // 1 for the first
  double dt = 0;           // s
  double time = 0;         // s, after the step

  std::int64_t begin_ns = 0;  // monotonic clock, when it began; what was posted before is in it

  double step_ms = 0;     // wall clock
  double blocked_ms = 0;  // the caller waited with nothing to run
  double helped_ms = 0;   // the caller ran stages
  // Sum over workers of the time within the step in which they ran nothing: waits at barriers, for
  // work and for wake-ups. What the caller does between begin_step and end_step counts as idle.
  double idle_ms = 0;
  std::array<StageTime, kMaxStages> stage_storage = {};
  std::uint32_t stage_count = 0;
  std::span<const StageTime> stages() const { return {stage_storage.data(), stage_count}; }

  std::uint32_t bodies = 0;
  std::uint32_t awake_bodies = 0;
  std::uint32_t shapes = 0;
  std::uint32_t joints = 0;
  std::uint32_t pairs = 0;           // from the broadphase
  std::uint32_t contacts = 0;        // manifolds with at least one point
  std::uint32_t islands = 0;         // awake, of two bodies or one with a contact or joint
  std::uint32_t largest_island = 0;  // bodies
  std::uint32_t fallback_pairs = 0;  // narrowphase pairs that went through FCL

  Measures measures;  // after the step; all zero without WorldSettings::measure_steps

  // Trouble that did not stop the step, with the setting to change or the body that was set aside.
  std::vector<std::string> warnings;
};

}  // namespace skerry
