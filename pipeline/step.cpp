// One step, top to bottom. A stage starts once every earlier stage it conflicts with (by what they
// read and write) has finished; order, barriers, per-item chains, timers and trace names follow
// from this table.
#include "collision/broadphase.h"
#include "collision/continuous.h"
#include "collision/narrowphase.h"
#include "pipeline/commands.h"
#include "pipeline/publish.h"
#include "pipeline/stages.h"
#include "pipeline/world_data.h"
#include "solver/finalise.h"
#include "solver/islands.h"
#include "solver/solve_islands.h"

namespace skerry::pipeline {
namespace {

using jobs::IndexRange;
using jobs::Task;

std::uint64_t bits(std::initializer_list<Data> data) {
  std::uint64_t sum = 0;
  for (const Data d : data) sum |= static_cast<std::uint64_t>(d);
  return sum;
}

// Kernels of the lower rooms see the step context; the pipeline's own see the whole world.
template <void (*kernel)(const core::StepContext&, IndexRange, Task&)>
void room(void* world, IndexRange items, Task& task) {
  kernel(static_cast<WorldData*>(world)->context, items, task);
}
template <void (*kernel)(WorldData&, IndexRange, Task&)>
void own(void* world, IndexRange items, Task& task) {
  kernel(*static_cast<WorldData*>(world), items, task);
}

std::uint32_t item_count(Per per, const WorldData& world) {
  switch (per) {
    case Per::body:
      return static_cast<std::uint32_t>(world.bodies.awake.size());
    case Per::moved_collider:
      return world.broadphase->moved_count();
    case Per::pair:
      return static_cast<std::uint32_t>(world.contacts.active.size());
    case Per::island_group:
      return static_cast<std::uint32_t>(world.islands.groups.size());
    case Per::fast_pair:
      return static_cast<std::uint32_t>(world.fast.pairs.size());
    case Per::step:
      break;
  }
  return 1;
}
template <Per per>
std::uint32_t count(void* world) {
  return item_count(per, *static_cast<const WorldData*>(world));
}

struct Split {
  jobs::ItemCount count;
  std::uint32_t chunk;  // items per task
};
// Chunks are fixed numbers, so that work splits alike in every mode and for every worker count.
// They are some 20-100 us of work each: enough to hide the cost of handing a chunk over (about a
// microsecond), small enough to balance two workers.
Split split(Per per) {
  switch (per) {
    case Per::body:
      return {count<Per::body>, 512};
    case Per::moved_collider:
      return {count<Per::moved_collider>, 128};
    case Per::pair:
      return {count<Per::pair>, 512};
    case Per::island_group:
      return {count<Per::island_group>, 1};
    case Per::fast_pair:
      return {count<Per::fast_pair>, 32};
    case Per::step:
      break;
  }
  return {nullptr, 1};
}

}  // namespace

jobs::TaskGraph describe_step() {
  using enum Data;
  jobs::TaskGraph graph;
  graph.partition(
      static_cast<jobs::Domain>(Per::island_group),
      bits({poses, velocities, flags, forces, contacts, joints, islands, transforms, sweeps}));
  const auto stage = [&graph](const char* name, Per per, jobs::Kernel kernel,
                              std::initializer_list<Data> reads,
                              std::initializer_list<Data> writes) {
    const auto [count, chunk] = split(per);
    graph.stage(
        {name, static_cast<jobs::Domain>(per), kernel, count, chunk, bits(reads), bits(writes)});
  };

  // clang-format off
  //    name                once per             kernel                              reads                                          writes
  stage("apply_commands",   Per::step,           own<apply_commands>,                {inbox},                                       {poses, velocities, flags, forces, masses, shapes, bounds, tree, pairs, contacts, joints, awake_set, transforms});
  stage("update_bounds",    Per::body,           room<collision::update_bounds>,     {poses, velocities, flags, shapes, awake_set}, {bounds});
  stage("refit_broadphase", Per::step,           room<collision::refit_broadphase>,  {bounds, shapes},                              {tree});
  stage("query_pairs",      Per::moved_collider, room<collision::query_pairs>,       {bounds, tree, flags, shapes, joints},         {candidates});
  stage("merge_pairs",      Per::step,           room<collision::merge_pairs>,       {bounds, candidates, flags, awake_set, shapes}, {pairs, contacts});
  stage("narrowphase",      Per::pair,           room<collision::collide_pairs>,     {pairs, poses, velocities, flags, shapes},     {contacts});
  stage("build_islands",    Per::step,           room<solver::build_islands>,        {contacts, pairs, joints},                     {islands, awake_set, flags});
  stage("solve_islands",    Per::island_group,   room<solver::solve_islands>,        {islands, masses, shapes, pairs, forces},      {poses, velocities, flags, contacts, joints, sweeps});
  stage("finalise_bodies",  Per::island_group,   room<solver::finalise_bodies>,      {poses, velocities},                           {flags, forces, islands});
  stage("write_transforms", Per::island_group,   own<write_transforms>,              {poses, masses, flags, islands},               {transforms});
  stage("find_fast",        Per::step,           room<collision::find_fast>,         {poses, velocities, flags, pairs, shapes, bounds, tree, awake_set, joints}, {sweeps});
  stage("sweep_fast",       Per::fast_pair,      room<collision::sweep_fast>,        {poses, velocities, flags, shapes},            {sweeps});
  stage("stop_fast",        Per::step,           own<stop_fast>,                     {sweeps, shapes, masses, awake_set, islands},  {poses, velocities, flags, transforms});
  stage("sleep",            Per::step,           room<solver::update_sleep>,         {islands},                                     {awake_set, velocities, flags});
  stage("publish",          Per::step,           own<publish>,                       {transforms, contacts, pairs, poses, masses, shapes, islands, sweeps}, {events, snapshot, pairs, joints, awake_set, velocities, flags});
  // clang-format on
  return graph;
}

}  // namespace skerry::pipeline
