// The candidates of a query: shared by the files that answer queries.
#pragma once

#include "collision/query_scene.h"
#include "collision/query_walk.h"

namespace skerry::collision {

template <class Most, class Visit>
void QueryScene::for_each_met(const MovingBox& mover, const Most& most, const Visit& visit) const {
  for (const ColliderIndex plane : planes_)
    if (!visit(plane)) return;
  const auto lanes = [&](const BoxNode& node, float limit, float(&keys)[BoxNode::kWidth]) {
    return moving_lanes(node, mover, limit, keys);
  };
  const auto limit = [&] { return float_above(most()); };
  if (walk_in_order(moving_.nodes(), lanes, limit, visit))
    walk_in_order(fixed_.nodes(), lanes, limit, visit);
}

template <class Most, class Visit>
void QueryScene::for_each_near(const Aabb& box, const Most& most, const Visit& visit) const {
  for (const ColliderIndex plane : planes_)
    if (!visit(plane)) return;
  const auto lanes = [&](const BoxNode& node, float limit, float(&keys)[BoxNode::kWidth]) {
    return near_lanes(node, box, limit, keys);
  };
  const auto limit = [&] { return float_above(most()); };
  if (walk_in_order(moving_.nodes(), lanes, limit, visit))
    walk_in_order(fixed_.nodes(), lanes, limit, visit);
}

}  // namespace skerry::collision
