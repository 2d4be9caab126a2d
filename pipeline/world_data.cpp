#include "pipeline/world_data.h"

#include "pipeline/stages.h"
#include "pipeline/threading_mode.h"

namespace skerry::pipeline {

WorldData::WorldData(const WorldSettings& world_settings)
    : settings(world_settings),
      executor(make_step_executor(settings)),
      broadphase(collision::make_broadphase(settings.broadphase)),
      narrowphase(collision::make_narrowphase_scratch(executor->worker_count())),
      continuous(collision::make_continuous_scratch(executor->worker_count())),
      solver(solver::make_solver_scratch(executor->worker_count())),
      graph(describe_step()) {
  run.record_tasks = settings.record_tasks;
  context.worker_count = executor->worker_count();
  context.settings = &settings;
  context.bodies = &bodies;
  context.colliders = &colliders;
  context.contacts = &contacts;
  context.joints = &joints;
  context.fields = &fields;
  context.islands = &islands;
  context.sleepers = &sleepers;
  context.fast = &fast;
  if (settings.measure_steps) context.effects = &effects;
  context.callback_errors = &callback_errors;
  context.broadphase = broadphase.get();
  context.narrowphase = narrowphase.get();
  context.continuous = continuous.get();
  context.solver = solver.get();
  context.warnings = &report.warnings;
}

void require_idle(const WorldData& world, const char* call) {
  switch (world.activity.load(std::memory_order_relaxed)) {
    case Activity::idle:
      return;
    case Activity::stepping:
      throw UsageError(std::string(call) + " was called during a step; post() a command instead");
    case Activity::running:
      throw UsageError(
          std::string(call) +
          " was called while the simulation thread runs; post() a command, or stop() it");
  }
}

void refresh_rows(WorldData& world) {
  if (!world.rows_stale) return;
  const core::Bodies& bodies = world.bodies;
  world.ids.clear();
  world.transforms.clear();
  world.row_of.assign(bodies.rows(), core::kNone);
  for (core::BodyIndex body = 0; body < bodies.rows(); ++body) {
    if (!bodies.is(body, core::kAlive)) continue;
    world.row_of[body] = static_cast<std::uint32_t>(world.ids.size());
    world.ids.push_back(bodies.id(body));
    world.transforms.push_back(core::body_frame(bodies, body));
  }
  world.changed.clear();
  world.rows_stale = false;
}

}  // namespace skerry::pipeline
