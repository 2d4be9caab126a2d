#include "collision/mesh_tree.h"

#include <span>

#include "collision/box_lanes.h"
#include "collision/sort_rows.h"

namespace skerry::core {
namespace {
template <class Test>
void append_sorted(const MeshTree& tree, const Test& test, std::vector<std::uint32_t>& triangles) {
  const std::size_t first = triangles.size();
  collision::walk(tree.nodes, test, [&](std::uint32_t triangle) { triangles.push_back(triangle); });
  collision::sort_rows(std::span(triangles).subspan(first));
}
}  // namespace

void MeshTree::query(const float min[3], const float max[3],
                     std::vector<std::uint32_t>& triangles) const {
  const collision::Aabb box{{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
  append_sorted(
      *this, [&](const collision::BoxNode& node) { return collision::overlap_lanes(node, box); },
      triangles);
}

void MeshTree::query_ray(const float origin[3], const float direction[3], float max_fraction,
                         std::vector<std::uint32_t>& triangles) const {
  const collision::Ray ray = collision::make_ray(origin, direction, max_fraction);
  append_sorted(
      *this, [&](const collision::BoxNode& node) { return collision::ray_lanes(node, ray); },
      triangles);
}

}  // namespace skerry::core
