#include "collision/query_surface.h"

#include <algorithm>
#include <cmath>

#include "collision/height_field.h"
#include "collision/mesh_tree.h"
#include "collision/query_walk.h"

namespace skerry::collision {
namespace {

using core::Collider;
using core::dot;
using core::ShapeType;
using core::V3f;

bool is_field(const Collider& surface) { return surface.type == ShapeType::height_field; }
const std::vector<BoxNode>& nodes_of(const Collider& surface) {
  return is_field(surface) ? surface.field->blocks->nodes : surface.mesh->tree->nodes;
}

// Calls visit(row) for the triangles of one item of the tree.
template <class Visit>
void for_triangles_of(const Collider& surface, std::uint32_t item, const Visit& visit) {
  if (!is_field(surface)) return visit(item);
  for_cells_of_block(*surface.field, item, [&](std::uint32_t cell) {
    visit(2 * cell);
    visit(2 * cell + 1);
  });
}

V3d corner(const Collider& surface, std::uint32_t row, unsigned i) {
  if (is_field(surface)) return wide(field_corner(*surface.field, row, i));
  return wide(surface.mesh->vertices[surface.mesh->triangles[row][i]]);
}

float above(double value) {
  constexpr double kMost = 3e38;
  return float_above(std::min(value, kMost));
}

// Calls visit(row) for the triangles that a mover may meet at a fraction of at most `most`, which
// visit may lower; nearest boxes first.
template <class Visit>
void walk_met(const Collider& surface, const MovingBox& mover, const double& most,
              const Visit& visit) {
  walk_in_order(
      nodes_of(surface),
      [&](const BoxNode& node, float limit, float(&keys)[BoxNode::kWidth]) {
        return moving_lanes(node, mover, limit, keys);
      },
      [&] { return above(most); },
      [&](std::uint32_t item) {
        for_triangles_of(surface, item, visit);
        return true;
      });
}

}  // namespace

std::uint32_t triangle_count(const Collider& surface) {
  return static_cast<std::uint32_t>(is_field(surface) ? 2 * surface.field->cells.size()
                                                      : surface.mesh->triangles.size());
}
bool has_triangle(const Collider& surface, std::uint32_t row) {
  return !is_field(surface) || surface.field->cells[row / 2] != core::HeightFieldGeometry::kHole;
}
ConvexCore triangle_core(const Collider& surface, std::uint32_t row) {
  ConvexCore core;
  core.kind = ConvexCore::Kind::triangle;
  core.center = corner(surface, row, 0);
  core.corner[0] = {0, 0, 0};
  core.corner[1] = corner(surface, row, 1) - core.center;
  core.corner[2] = corner(surface, row, 2) - core.center;
  return core;
}
std::uint32_t triangle_name(const Collider& surface, std::uint32_t row) {
  return is_field(surface) || surface.mesh->source.empty() ? row : surface.mesh->source[row];
}

CoreBox box_of(const ConvexCore& core) {
  double low[3], high[3];
  const V3d axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int i = 0; i < 3; ++i) {
    high[i] = core.reach(axes[i]);
    low[i] = core.reach(axes[i] * -1.0);
  }
  const V3d half{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
  const V3d shift{(high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2};
  return {core.center + shift, half};
}

Aabb CoreBox::outward() const {
  return {{float_below(middle.x - half.x), float_below(middle.y - half.y),
           float_below(middle.z - half.z)},
          {float_above(middle.x + half.x), float_above(middle.y + half.y),
           float_above(middle.z + half.z)}};
}

SurfaceHit ray_surface(const Collider& surface, const LocalRay& ray, bool back_faces) {
  const MovingBox mover(ray.origin, ray.along, {0, 0, 0});
  const TriangleRay test(ray);
  SurfaceHit best;
  double most = ray.most;
  std::uint32_t best_row = core::kNone;
  const auto consider = [&](std::uint32_t row) {
    LocalHit hit =
        test.hit(corner(surface, row, 0), corner(surface, row, 1), corner(surface, row, 2));
    if (!hit.hit || hit.t > most || (hit.t == most && best.at.hit && row > best_row)) return;
    if (dot(hit.normal, ray.along) > 0) {
      if (!back_faces) return;
      hit.normal = hit.normal * -1.0;
    }
    best.at = hit;
    best_row = row;
    most = hit.t;
  };
  walk_met(surface, mover, most, consider);
  if (best.at.hit) best.triangle = triangle_name(surface, best_row);
  return best;
}

SurfaceTouch cast_at_surface(const ConvexCore& core, const V3d& translation, double most,
                             const Collider& surface) {
  const CoreBox box = box_of(core);
  const MovingBox mover(box.middle, translation, box.half);
  SurfaceTouch best;
  std::uint32_t best_row = core::kNone;
  const auto consider = [&](std::uint32_t row) {
    const Touching touching = cast_core(core, translation, most, triangle_core(surface, row));
    if (!touching.hit) return;
    if (best.at.hit && touching.fraction == best.at.fraction && row > best_row) return;
    best.at = touching;
    best_row = row;
    most = touching.fraction;
  };
  walk_met(surface, mover, most, consider);
  if (best.at.hit) best.triangle = triangle_name(surface, best_row);
  return best;
}

bool overlaps_surface(const ConvexCore& core, const Collider& surface) {
  const Aabb box = box_of(core).outward();
  bool touches = false;
  walk_in_order(
      nodes_of(surface),
      [&](const BoxNode& node, float, float(&keys)[BoxNode::kWidth]) {
        std::fill(keys, keys + BoxNode::kWidth, 0.0f);
        return overlap_lanes(node, box);
      },
      [] { return 0.0f; },
      [&](std::uint32_t item) {
        for_triangles_of(surface, item, [&](std::uint32_t row) {
          if (touches) return;
          const ConvexCore triangle = triangle_core(surface, row);
          touches =
              core_distance(core, {0, 0, 0}, triangle, triangle.center - core.center).distance <=
              core.radius;
        });
        return !touches;
      });
  return touches;
}

SurfaceDistance nearest_on_surface(const ConvexCore& core, const Collider& surface, double most) {
  const Aabb box = box_of(core).outward();
  SurfaceDistance best;
  std::uint32_t best_row = core::kNone;
  const auto consider = [&](std::uint32_t row) {
    const ConvexCore triangle = triangle_core(surface, row);
    const CoreDistance now =
        core_distance(core, {0, 0, 0}, triangle, triangle.center - core.center);
    const double distance = std::max(now.distance - core.radius, 0.0);
    if (distance > most || (distance == most && best.found && row > best_row)) return;
    best.found = true;
    best.at = now;
    best_row = row;
    most = distance;
  };
  walk_in_order(
      nodes_of(surface),
      [&](const BoxNode& node, float limit, float(&keys)[BoxNode::kWidth]) {
        return near_lanes(node, box, limit, keys);
      },
      [&] { return above(most); },
      [&](std::uint32_t item) {
        for_triangles_of(surface, item, consider);
        return true;
      });
  if (best.found) best.triangle = triangle_name(surface, best_row);
  return best;
}

LowestVertex lowest_vertex(const Collider& surface, const V3d& along) {
  LowestVertex lowest{HUGE_VAL, {0, 0, 0}, core::kNone};
  std::uint32_t best = core::kNone;
  for (std::uint32_t row = 0; row < triangle_count(surface); ++row) {
    if (!has_triangle(surface, row)) continue;
    for (unsigned i = 0; i < 3; ++i) {
      const V3d p = corner(surface, row, i);
      const double height = dot(along, p);
      if (height >= lowest.height) continue;
      lowest.height = height;
      lowest.point = p;
      best = row;
    }
  }
  if (best != core::kNone) lowest.triangle = triangle_name(surface, best);
  return lowest;
}

}  // namespace skerry::collision
