// QueryScene: how it follows the world.
#include "collision/query_scene.h"

#include <algorithm>

#include "collision/bounds.h"

namespace skerry::collision {

using core::Collider;
using core::kNone;
using core::ShapeType;

void QueryScene::copy(const QueryState& state) {
  if (state.bodies.size() > bodies_.size()) bodies_.resize(state.bodies.size());
  if (state.colliders.size() > rows_.size()) {
    rows_.resize(state.colliders.size());
    geometry_.resize(state.colliders.size());
  }
  // All that goes before what comes: rows may have changed hands.
  if (state.any_shapes_at > stamp_)
    for (BodyIndex body = 0; body < state.bodies.size(); ++body)
      if (state.shapes_at[body] > stamp_) drop_shapes(body);
  for (BodyIndex body = 0; body < state.bodies.size(); ++body) {
    if (state.moved_at[body] <= stamp_) continue;
    bodies_[body] = state.bodies[body];
    if (state.shapes_at[body] > stamp_) take_shapes(state, body);
    moved_.push_back(body);
  }
  stamp_ = state.stamp;
  step_ = state.step;
}

void QueryScene::drop_shapes(BodyIndex body) {
  for (ColliderIndex c = bodies_[body].first_collider; c != kNone;) {
    Row& row = rows_[c];
    if (row.in_tree) (row.fixed ? fixed_ : moving_).remove(c);
    if (row.collider.type == ShapeType::plane) std::erase(planes_, c);
    c = row.collider.next_in_body;
    row = {};
  }
  bodies_[body].first_collider = kNone;
}

void QueryScene::take_shapes(const QueryState& state, BodyIndex body) {
  for (ColliderIndex c = bodies_[body].first_collider; c != kNone;
       c = rows_[c].collider.next_in_body) {
    rows_[c].collider = state.colliders[c];
    rows_[c].fixed = bodies_[body].fixed;
    geometry_[c] = state.geometry[c];
    if (rows_[c].collider.type == ShapeType::plane)
      planes_.insert(std::lower_bound(planes_.begin(), planes_.end(), c), c);
  }
}

void QueryScene::settle() {
  for (const BodyIndex body : moved_)
    for (ColliderIndex c = bodies_[body].first_collider; c != kNone;
         c = rows_[c].collider.next_in_body)
      place(c, bodies_[body].pose);
  moved_.clear();
  moving_.refit();
  fixed_.refit();
}

void QueryScene::place(ColliderIndex collider, const core::BodyPose& pose) {
  Row& row = rows_[collider];
  const Collider& shape = row.collider;
  const M3d body_axes = matrix_of(pose.orientation);
  row.origin = wide(pose.center) + body_axes * wide(shape.local_position);
  row.axes =
      shape.has_local_rotation ? product(body_axes, matrix_of(shape.local_rotation)) : body_axes;
  if (shape.type == ShapeType::plane) return;
  row.box = tight_bounds(shape, pose);
  BoxTree& tree = row.fixed ? fixed_ : moving_;
  if (row.in_tree)
    tree.update(collider, row.box);
  else
    tree.insert(collider, row.box);
  row.in_tree = true;
}

const QueryBody* QueryScene::find(BodyId body) const {
  if (body.index >= bodies_.size()) return nullptr;
  const QueryBody& row = bodies_[body.index];
  return row.alive && row.generation == body.generation ? &row : nullptr;
}

bool QueryScene::passes(const Collider& collider, const QueryFilter& filter) const {
  if (collider.sensor && !filter.sensors) return false;
  if (!core::filters_meet(filter.filter, collider.filter)) return false;
  for (const BodyId& body : filter.ignore)
    if (body.index == collider.body && body == id_of(collider)) return false;
  return true;
}

bool QueryScene::accepts(const Collider& collider, const QueryFilter& filter) const {
  return !filter.accept || filter.accept(id_of(collider), collider.shape_in_body);
}

bool QueryScene::before(ColliderIndex a, ColliderIndex b) const {
  const Collider &x = rows_[a].collider, &y = rows_[b].collider;
  return x.body < y.body || (x.body == y.body && x.shape_in_body < y.shape_in_body);
}

}  // namespace skerry::collision
