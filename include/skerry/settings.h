// How a world behaves and what threads it uses.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>

#include <skerry/jobs/executor.h>
#include <skerry/step_report.h>
#include <skerry/types.h>

namespace skerry {

using jobs::Affinity;
using jobs::TaskPool;
using jobs::WaitPolicy;

// Who drives the step and who runs its stages.
enum class ThreadingMode : std::uint8_t {
  serial,                 // the caller does everything; the reference
  dedicated_thread,       // a simulation thread at a fixed rate; the game sees snapshots
  dedicated_thread_jobs,  // the same, its stages run by the job system
  fork_join,              // the caller and workers, a barrier after each stage
  job_system,             // a task graph; the caller may do other work meanwhile
};

// When the game asks a dedicated thread for a frame: whose turn is it to wait? (As the buffer and
// blocking modes of Unreal's Chaos.)
enum class BlockPolicy : std::uint8_t {
  all,             // wait until every step that is due has been made
  all_but_newest,  // wait for all but the newest step: at most one step behind
  never,           // take what there is; steps that cannot be made in time are dropped
};

// Integrators of free flight (bodies with no contact and no joint in a step).
enum class Integrator : std::uint8_t {
  explicit_euler,
  semi_implicit_euler,
  velocity_verlet,
  rk4,
  exact,  // exact parabola; torque-free rotation from the conserved angular momentum
};

enum class BroadphaseKind : std::uint8_t { tree, sweep_and_prune, fcl };

// What solves the contacts of a world. The first is the engine's; the others are there to be measured
// against it. Islands with joints take the first in any case.
enum class SolverKind : std::uint8_t {
  soft_step_tgs,  // substeps with soft contacts and a relax pass: docs/solver.md
  pgs,            // sequential impulses (Catto, GDC 2006): PgsSettings
  penalty,        // spring-dashpot forces with memory (Cundall and Strack 1979): PenaltySettings
};

// How pgs takes back overlap.
enum class PositionCorrection : std::uint8_t {
  baumgarte,      // by a part of the velocity, which stays
  split_impulse,  // by velocities of their own, forgotten after the step
};

// Stable at any step, converged at none: stacks sink and sway unless `iterations` is about the square
// of their height, heavy on light unless it is about the mass ratio. Takes no substeps.
struct PgsSettings {
  int iterations = 10;  // 1 to 10000
  PositionCorrection correction = PositionCorrection::split_impulse;
  double correction_rate = 0.2;  // part of the overlap to take back per step; above 1 overshoots
  double slop = 0.001;           // m of overlap that stays
};

// Explicit: stable while 2 pi hertz dt / substeps is below 2 / n or so, with n contacts per body.
// What rests sinks in by load / mass / (2 pi hertz)^2; faster than size times hertz goes through.
struct PenaltySettings {
  int substeps = 32;  // 1 to 10000
  double hertz = 60;  // of a body on the ground
};

struct SolverSettings {
  SolverKind kind = SolverKind::soft_step_tgs;
  PgsSettings pgs = {};
  PenaltySettings penalty = {};
  int substeps = 4;
  double contact_hertz = 200;  // stiffness of soft contacts, capped at 0.175 of the substep rate:
                               // 42 Hz at 1/60 s in 4 substeps
  double contact_damping_ratio = 14;
  double max_push_velocity = 3;  // m/s: fastest recovery from penetration
  // m/s: slower impacts do not bounce. Of bodies in flight with a restitution e above 0.5: 2 (1 - e) times it.
  double restitution_threshold = 0.2;
  double joint_hertz = 60;
  double joint_damping_ratio = 2;
};

// What gathers speed, be it slowly, does not sleep, nor does what drifts in empty space.
struct SleepSettings {
  bool enabled = true;
  double linear_threshold = 0.05;   // m/s
  double angular_threshold = 0.05;  // rad/s; or turning moves no point faster than linear_threshold
  double time = 0.5;                // s below both before an island sleeps
};

struct WorldSettings {
  Vec3 gravity = {0, -9.81, 0};  // m/s^2
  ThreadingMode mode = ThreadingMode::serial;
  int workers = 0;           // threads that run the step; see jobs::ExecutorSettings
  TaskPool* pool = nullptr;  // for job_system: run on the host's pool instead of our own threads
  double rate_hz = 60;       // of the dedicated thread: 1 to 1e6
  BlockPolicy block_policy = BlockPolicy::all_but_newest;
  WaitPolicy wait = {};
  Affinity affinity = Affinity::none;
  SolverSettings solver = {};
  SleepSettings sleep = {};
  Integrator integrator = Integrator::exact;
  BroadphaseKind broadphase = BroadphaseKind::tree;
  bool continuous = true;       // sweep fast bodies, so that they cannot pass through others
  bool persist_events = false;  // also report ContactEventKind::persist for every touching pair
  // m/s, at least 0: also report ContactEventKind::hit for pairs that pressed in the step after an
  // approach faster than this. Infinite: none.
  double hit_speed = std::numeric_limits<double>::infinity();
  // Fill StepReport::measures after every step, and its part about contacts. Costs some
  // 0.2 us per body with one contact of four points; the states keep their bits.
  bool measure_steps = false;
  bool record_tasks = false;  // keep every task of the last step for World::last_tasks()
  // Called after every step on the thread that made it, the dedicated thread too, with that step's
  // report and (with record_tasks) its tasks. It may not call the world. What it throws reaches
  // whoever asked for the step, as from any callback.
  std::function<void(const StepReport&, std::span<const jobs::TaskRecord>)> after_step = {};
};

const char* to_string(ThreadingMode mode);
const char* to_string(BlockPolicy policy);
const char* to_string(Integrator integrator);
const char* to_string(BroadphaseKind kind);
const char* to_string(SolverKind kind);
const char* to_string(PositionCorrection correction);

}  // namespace skerry
