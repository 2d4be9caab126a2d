// Everything a world owns. Rooms own nothing between steps; they get views of this.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include <skerry/world.h>

#include "collision/broadphase.h"
#include "collision/narrowphase.h"
#include "core/step_context.h"
#include "pipeline/geometry_cache.h"
#include "pipeline/snapshots.h"
#include "solver/solve_islands.h"

namespace skerry::pipeline {

// What the world is doing; most calls need `idle`.
enum class Activity : std::uint8_t {
  idle,
  stepping,  // between begin_step and end_step, or inside step()
  running,   // the dedicated thread is started
};

struct WorldData {
  explicit WorldData(const WorldSettings& world_settings);

  WorldSettings settings;

  core::Bodies bodies;
  core::Colliders colliders;
  core::ContactTable contacts;
  core::Joints joints;
  core::ForceFields fields;
  core::Islands islands;
  core::Sleepers sleepers;
  core::CallbackErrors callback_errors;
  GeometryCache geometry;

  std::unique_ptr<jobs::Executor> executor;
  std::unique_ptr<collision::Broadphase> broadphase;
  collision::NarrowphaseScratchPtr narrowphase;
  solver::SolverScratchPtr solver;

  core::StepContext context;  // of the step in progress
  jobs::TaskGraph graph;      // describe_step(), built once
  jobs::RunReport run;        // of the last step
  StepReport report;
  double time = 0;  // s simulated
  std::uint64_t step_count = 0;
  std::atomic<Activity> activity = Activity::idle;
  bool in_flight = false;  // the executor has begun a run that was not ended

  std::mutex inbox_mutex;
  std::vector<Command> inbox;  // guarded; posted and not yet applied
  std::vector<Command> applying;

  // Out. Rows of ids and transforms are alive bodies by ascending index.
  std::vector<BodyId> ids;
  std::vector<Pose> transforms;
  std::vector<std::uint32_t> row_of;   // [body rows] into ids and transforms
  std::vector<std::uint32_t> changed;  // rows
  bool rows_stale = true;              // bodies came or went
  std::vector<ContactEvent> events;
  std::vector<ContactEvent> pending_end_events;  // of bodies removed since the last step
  std::vector<JointBroken> broken;  // in the last step
  SnapshotBuffer snapshots;
};

// Throws UsageError unless the world is idle (`call` names the function for the message).
void require_idle(const WorldData& world, const char* call);

// Rows for the game, rebuilt if bodies came or went.
void refresh_rows(WorldData& world);

}  // namespace skerry::pipeline
