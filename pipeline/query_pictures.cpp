#include "pipeline/query_pictures.h"

#include <skerry/error.h>

#include "pipeline/world_data.h"

namespace skerry::pipeline {

using collision::QueryBody;
using collision::QueryScene;
using core::BodyIndex;
using core::ColliderIndex;
using core::kNone;

std::unique_ptr<QueryScene> QueryPictures::Pool::take() {
  const std::lock_guard lock(mutex);
  if (scenes.empty()) return std::make_unique<QueryScene>();
  std::unique_ptr<QueryScene> scene = std::move(scenes.back());
  scenes.pop_back();
  return scene;
}

void QueryPictures::Pool::give(std::unique_ptr<QueryScene> scene) {
  const std::lock_guard lock(mutex);
  scenes.push_back(std::move(scene));
}

void QueryPictures::note(BodyIndex body, Edit edit) {
  if (!wanted_.load(std::memory_order_relaxed)) return;
  edits_.push_back({body, edit});
  edited_any_.store(true, std::memory_order_release);
}

void QueryPictures::take_over(const WorldData& world, BodyIndex body, Edit edit) {
  const core::Bodies& bodies = world.bodies;
  if (body >= state_.bodies.size()) {
    state_.bodies.resize(bodies.rows());
    state_.moved_at.resize(bodies.rows(), 0);
    state_.shapes_at.resize(bodies.rows(), 0);
  }
  QueryBody& row = state_.bodies[body];
  const std::uint32_t flags = bodies.flags[body];
  state_.moved_at[body] = state_.stamp;
  row.alive = flags & core::kAlive;
  row.pose = bodies.pose[body];
  const bool collides = row.alive && !(flags & core::kQuarantined);
  const ColliderIndex first = collides ? bodies.first_collider[body] : kNone;
  if (edit == Edit::pose && first == row.first_collider) return;
  state_.shapes_at[body] = state_.any_shapes_at = state_.stamp;
  row.fixed = !(flags & (core::kDynamic | core::kKinematic));
  row.generation = bodies.generation[body];
  row.local_center = bodies.mass[body].local_center;
  row.first_collider = first;
  const core::Colliders& colliders = world.colliders;
  if (state_.colliders.size() < colliders.rows.size()) {
    state_.colliders.resize(colliders.rows.size());
    state_.geometry.resize(colliders.rows.size());
  }
  for (ColliderIndex c = first; c != kNone; c = colliders.rows[c].next_in_body) {
    state_.colliders[c] = colliders.rows[c];
    state_.geometry[c] = colliders.geometry[c];
  }
}

void QueryPictures::take_over_edits(const WorldData& world) {
  if (!edited_any_.load(std::memory_order_acquire)) return;
  ++state_.stamp;
  if (all_) {
    for (BodyIndex body = 0; body < world.bodies.rows(); ++body)
      take_over(world, body, Edit::shapes);
  } else {
    for (const Edited& edited : edits_) take_over(world, edited.body, edited.edit);
  }
  state_.step = world.step_count;
  edits_.clear();
  all_ = false;
  edited_any_.store(false, std::memory_order_relaxed);
  stamp_.store(state_.stamp, std::memory_order_release);
}

void QueryPictures::begin_step(const WorldData& world) {
  std::unique_lock lock(state_mutex_);
  step_waits_ = true;
  executor_free_.wait(lock, [this] { return !batch_runs_; });
  step_waits_ = false;
  if (wanted_) take_over_edits(world);
  in_step_ = true;
}

void QueryPictures::publish(const WorldData& world) {
  if (!wanted_.load(std::memory_order_relaxed)) return;
  const std::lock_guard lock(state_mutex_);
  take_over_edits(world);
  ++state_.stamp;
  for_each_simulated(world, [&](BodyIndex body) { take_over(world, body, Edit::pose); });
  state_.step = world.step_count + 1;
  stamp_.store(state_.stamp, std::memory_order_release);
}

void QueryPictures::end_step(bool completed) {
  const std::lock_guard lock(state_mutex_);
  in_step_ = false;
  if (completed) return;
  all_ = true;  // nobody knows how far it came
  edited_any_.store(true, std::memory_order_release);
}

std::shared_ptr<const QueryScene> QueryPictures::newest(const WorldData& world) {
  const std::lock_guard view_lock(view_mutex_);
  if (current_ && !edited_any_.load(std::memory_order_acquire) &&
      current_->stamp() == stamp_.load(std::memory_order_acquire))
    return current_;
  std::unique_ptr<QueryScene> scene;
  {
    const std::lock_guard lock(state_mutex_);
    if (in_step_ && !wanted_)
      throw UsageError(
          "the first query of a world came during a step, of which nothing is known yet; call "
          "queries() once before");
    wanted_ = true;
    if (!in_step_) take_over_edits(world);
    if (current_ && current_->stamp() == state_.stamp) return current_;
    current_.reset();  // if nobody else has it, it is the one to bring up to date
    scene = pool_->take();
    scene->copy(state_);
  }
  scene->settle();
  current_ =
      std::shared_ptr<const QueryScene>(scene.release(), [pool = pool_](const QueryScene* freed) {
        pool->give(std::unique_ptr<QueryScene>(const_cast<QueryScene*>(freed)));
      });
  return current_;
}

QueryPictures::Turn::Turn(QueryPictures& pictures) : pictures_(pictures) {
  const std::lock_guard lock(pictures.state_mutex_);
  got_it_ = !pictures.in_step_ && !pictures.step_waits_ && !pictures.batch_runs_;
  if (got_it_) pictures.batch_runs_ = true;
}

QueryPictures::Turn::~Turn() {
  if (!got_it_) return;
  {
    const std::lock_guard lock(pictures_.state_mutex_);
    pictures_.batch_runs_ = false;
  }
  pictures_.executor_free_.notify_all();
}

}  // namespace skerry::pipeline
