// Bounding-volume tree of a triangle mesh: which triangles may touch a box, or a ray.
//
//   Layout   a query tests every candidate triangle's own box, eight at a time. Root first.
//   Threads  queries are const and keep no state: any number at once.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/box_node.h"
#include "core/colliders.h"

namespace skerry::core {

struct MeshTree {
  std::vector<collision::BoxNode> nodes;  // items are triangles, boxes in m in the shape frame

  // Appends the triangles whose bounds meet the box (touching counts), ascending. `triangles` keeps
  // its capacity from call to call.
  void query(const float min[3], const float max[3], std::vector<std::uint32_t>& triangles) const;

  // Appends the triangles whose bounds meet the segment from `origin` along `direction` times
  // [0, max_fraction], ascending. Never misses one; rounding may add a near miss.
  void query_ray(const float origin[3], const float direction[3], float max_fraction,
                 std::vector<std::uint32_t>& triangles) const;
};

}  // namespace skerry::core
