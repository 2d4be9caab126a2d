// Everything a world owns. Rooms own nothing between steps; they get views of this.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include <skerry/world.h>

#include "collision/broadphase.h"
#include "collision/continuous.h"
#include "collision/narrowphase.h"
#include "core/step_context.h"
#include "jobs/blocks.h"
#include "pipeline/geometry_cache.h"
#include "pipeline/query_pictures.h"
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
  core::FastBodies fast;
  core::ContactEffects effects;
  core::CallbackErrors callback_errors;
  GeometryCache geometry;

  std::unique_ptr<jobs::Executor> executor;
  std::unique_ptr<collision::Broadphase> broadphase;
  collision::NarrowphaseScratchPtr narrowphase;
  collision::ContinuousScratchPtr continuous;
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
  jobs::RowFilter news_filter;
  std::vector<std::uint32_t> news;  // into ContactTable::active: pairs with something to tell
  std::vector<ContactEvent> events;
  std::vector<ContactEvent> pending_end_events;  // of bodies removed since the last step
  std::vector<JointBroken> broken;               // in the last step
  SnapshotBuffer snapshots;
  QueryPictures queries;
};

// Throws UsageError unless the world is idle (`call` names the function for the message).
void require_idle(const WorldData& world, const char* call);

// Calls visit(body) for the bodies that the step in progress simulates: those of all island groups, or
// of some.
template <class Visit>
void for_each_simulated(const WorldData& world, jobs::IndexRange groups, const Visit& visit) {
  const core::Islands& islands = world.islands;
  for (std::uint32_t g = groups.begin; g < groups.end; ++g) {
    const core::IslandGroup& group = islands.groups[g];
    for (std::uint32_t i = group.first; i < group.first + group.count; ++i) {
      if (group.kind == core::GroupKind::free) {
        visit(islands.free_bodies[i]);
        continue;
      }
      const core::Island& island = islands.islands[i];
      for (std::uint32_t b = 0; b < island.body_count; ++b)
        visit(islands.bodies[island.first_body + b]);
    }
  }
}
template <class Visit>
void for_each_simulated(const WorldData& world, const Visit& visit) {
  for_each_simulated(world, {0, static_cast<std::uint32_t>(world.islands.groups.size())}, visit);
}

// Rows for the game, rebuilt if bodies came or went.
void refresh_rows(WorldData& world);

}  // namespace skerry::pipeline
