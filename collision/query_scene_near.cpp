// QueryScene: overlaps and distances.
#include <algorithm>
#include <cmath>

#include "collision/query_scene_find.h"
#include "collision/query_surface.h"

namespace skerry::collision {

using core::dot;
using core::kNone;
using core::ShapeType;
using core::transposed_times;

namespace {

Aabb moved_box(const ConvexCore& core, const V3d& origin) {
  CoreBox box = box_of(core);
  box.middle = box.middle + origin;
  return box.outward();
}

// Distance of two boxes, rounded down.
double box_distance(const Aabb& a, const Aabb& b) {
  double squared = 0;
  for (int i = 0; i < 3; ++i) {
    const double out =
        std::max({double(a.min[i]) - double(b.max[i]), double(b.min[i]) - double(a.max[i]), 0.0});
    squared += out * out;
  }
  return std::sqrt(squared) * (1 - 1e-12);
}

}  // namespace

QueryScene::RowDistance QueryScene::row_distance(const Row& row, const ConvexCore& core,
                                                 const V3d& origin, double most) const {
  RowDistance out;
  const auto fill = [&](const CoreDistance& found, double other_radius) {
    const double distance = found.distance - (core.radius + other_radius);
    out.distance = std::max(distance, 0.0);
    const V3d n = found.normal;
    out.on_row = common_point(found, core.radius, other_radius);
    out.on_core = distance > 0 ? found.a + n * core.radius : out.on_row;
    out.normal = distance > 0 ? n * -1.0 : V3d{0, 0, 0};
  };
  if (row.collider.type < ShapeType::plane) {
    const ConvexCore other = convex_core(row.collider, row.origin - origin, row.axes);
    fill(core_distance(core, {0, 0, 0}, other, other.center - core.center), other.radius);
    if (out.distance > most) out.distance = -1;
    return out;
  }
  const ConvexCore local = in_frame(core, origin, row.origin, row.axes);
  if (row.collider.type == ShapeType::plane) {
    const V3d up = wide(row.collider.size);
    const V3d lowest = local.support(up * -1.0) - up * local.radius;
    const double height = dot(up, lowest) - row.collider.plane_offset;
    if (height > most) return out;
    out.distance = std::max(height, 0.0);
    out.on_core = lowest;
    out.on_row = height > 0 ? lowest - up * height : lowest;
    out.normal = height > 0 ? up : V3d{0, 0, 0};
  } else {
    const SurfaceDistance found = nearest_on_surface(local, row.collider, most);
    if (!found.found) return out;
    fill(found.at, 0);
    out.triangle = found.triangle;
  }
  const auto outward = [&](const V3d& p) { return row.axes * p + (row.origin - origin); };
  out.on_core = outward(out.on_core);
  out.on_row = outward(out.on_row);
  out.normal = row.axes * out.normal;
  return out;
}

ClosestHit QueryScene::closest_hit(const Row& row, const V3d& origin,
                                   const RowDistance& found) const {
  ClosestHit hit;
  hit.body = id_of(row.collider);
  hit.shape = row.collider.shape_in_body;
  hit.triangle = found.triangle;
  hit.distance = found.distance;
  hit.on_query = vector(origin + found.on_core);
  hit.on_body = vector(origin + found.on_row);
  if (found.distance > 0) hit.normal = vector(found.normal * (1 / length(found.normal)));
  return hit;
}

void QueryScene::overlap(const ConvexCore& core, const V3d& origin, const QueryFilter& filter,
                         std::vector<OverlapHit>& hits) const {
  for_each_near(
      moved_box(core, origin), [] { return 0.0; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        if (!passes(row.collider, filter)) return true;
        const bool touches =
            core::is_surface(row.collider.type)
                ? overlaps_surface(in_frame(core, origin, row.origin, row.axes), row.collider)
                : row_distance(row, core, origin, 0).distance >= 0;
        if (touches && accepts(row.collider, filter))
          hits.push_back({id_of(row.collider), row.collider.shape_in_body});
        return true;
      });
  std::sort(hits.begin(), hits.end(), [](const OverlapHit& a, const OverlapHit& b) {
    return a.body.index != b.body.index ? a.body.index < b.body.index : a.shape < b.shape;
  });
}

std::optional<ClosestHit> QueryScene::closest(const ConvexCore& core, const V3d& origin,
                                              double max_distance,
                                              const QueryFilter& filter) const {
  ColliderIndex best = kNone;
  double most = max_distance;
  RowDistance nearest;
  for_each_near(
      moved_box(core, origin), [&] { return most; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        if (!passes(row.collider, filter)) return true;
        const RowDistance found = row_distance(row, core, origin, most);
        if (found.distance < 0) return true;
        if (found.distance == most && best != kNone && !before(c, best)) return true;
        if (!accepts(row.collider, filter)) return true;
        best = c;
        most = found.distance;
        nearest = found;
        return true;
      });
  if (best == kNone) return std::nullopt;
  return closest_hit(rows_[best], origin, nearest);
}

void QueryScene::closest_all(const ConvexCore& core, const V3d& origin, double max_distance,
                             const QueryFilter& filter, std::vector<ClosestHit>& hits) const {
  for_each_near(
      moved_box(core, origin), [&] { return max_distance; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        if (!passes(row.collider, filter)) return true;
        const RowDistance found = row_distance(row, core, origin, max_distance);
        if (found.distance >= 0 && accepts(row.collider, filter))
          hits.push_back(closest_hit(row, origin, found));
        return true;
      });
  std::sort(hits.begin(), hits.end(), [](const ClosestHit& a, const ClosestHit& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    if (a.body.index != b.body.index) return a.body.index < b.body.index;
    return a.shape < b.shape;
  });
}

QueryScene::RowDistance QueryScene::rows_distance(const Row& a, const Row& b, const V3d& origin,
                                                  double most) const {
  const ShapeType type_a = a.collider.type, type_b = b.collider.type;
  if (type_a < ShapeType::plane)
    return row_distance(b, convex_core(a.collider, a.origin - origin, a.axes), origin, most);
  if (type_b < ShapeType::plane || (type_a == ShapeType::plane && type_b != ShapeType::plane)) {
    RowDistance found = rows_distance(b, a, origin, most);
    std::swap(found.on_core, found.on_row);
    found.normal = found.normal * -1.0;
    return found;
  }
  RowDistance best;
  if (type_a == ShapeType::plane) return best;  // two planes: no pair of nearest points
  if (type_b == ShapeType::plane) {
    const V3d up = transposed_times(a.axes, b.axes * wide(b.collider.size));
    const LowestVertex lowest = lowest_vertex(a.collider, up);
    ConvexCore point;
    point.center = a.axes * lowest.point + (a.origin - origin);
    return row_distance(b, point, origin, most);
  }
  for (std::uint32_t row = 0; row < triangle_count(a.collider); ++row) {
    if (!has_triangle(a.collider, row)) continue;
    ConvexCore core = triangle_core(a.collider, row);
    core.center = a.axes * core.center + (a.origin - origin);
    for (V3d& corner : core.corner) corner = a.axes * corner;
    const RowDistance found = row_distance(b, core, origin, most);
    if (found.distance < 0 || (best.distance >= 0 && found.distance >= best.distance)) continue;
    best = found;
    most = found.distance;
  }
  return best;
}

std::optional<BodyDistance> QueryScene::distance(BodyIndex a, BodyIndex b,
                                                 double max_distance) const {
  const V3d origin = wide(bodies_[a].pose.center);
  std::optional<BodyDistance> best;
  double most = max_distance;
  for (ColliderIndex i = bodies_[a].first_collider; i != kNone; i = rows_[i].collider.next_in_body)
    for (ColliderIndex j = bodies_[b].first_collider; j != kNone;
         j = rows_[j].collider.next_in_body) {
      const Row &row_a = rows_[i], &row_b = rows_[j];
      if (row_a.collider.sensor || row_b.collider.sensor) continue;
      if (row_a.in_tree && row_b.in_tree && box_distance(row_a.box, row_b.box) > most) continue;
      const RowDistance found = rows_distance(row_a, row_b, origin, most);
      if (found.distance < 0 || (best && found.distance >= best->distance)) continue;
      most = found.distance;
      best = BodyDistance{found.distance,
                          row_a.collider.shape_in_body,
                          row_b.collider.shape_in_body,
                          vector(origin + found.on_core),
                          vector(origin + found.on_row),
                          vector(found.normal * -1.0)};
    }
  return best;
}

}  // namespace skerry::collision
