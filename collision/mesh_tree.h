// Bounding-volume tree of a triangle mesh: which triangles may touch a box, or a ray.
//
//   Layout   eight children per node, their boxes in lanes; a child is a node or one triangle, so
//            a query tests every triangle's own box. Nodes in Morton order, root first.
//   Threads  queries are const and keep no state: any number at once.
#pragma once

#include <cstdint>
#include <vector>

#include "core/colliders.h"

namespace skerry::core {

struct MeshTree {
  static constexpr std::uint32_t kWidth = 8;
  static constexpr std::uint32_t kTriangle = 0x80000000u;  // bit of a child that is a triangle

  struct alignas(32) Node {
    float min[3][kWidth];  // m, shape frame; lanes without a child: an inverted box
    float max[3][kWidth];
    std::uint32_t child[kWidth];  // node, or kTriangle | triangle
  };
  std::vector<Node> nodes;

  // Appends the triangles whose bounds meet the box (touching counts), ascending. `triangles` keeps
  // its capacity from call to call.
  void query(const float min[3], const float max[3], std::vector<std::uint32_t>& triangles) const;

  // Appends the triangles whose bounds meet the segment from `origin` along `direction` times
  // [0, max_fraction], ascending. Never misses one; may give one whose box is missed by rounding.
  void query_ray(const float origin[3], const float direction[3], float max_fraction,
                 std::vector<std::uint32_t>& triangles) const;
};

}  // namespace skerry::core
