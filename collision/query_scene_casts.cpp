// QueryScene: rays and moving shapes.
#include <algorithm>

#include "collision/query_scene_find.h"
#include "collision/query_surface.h"

namespace skerry::collision {

using core::Collider;
using core::dot;
using core::kNone;
using core::ShapeType;
using core::transposed_times;

namespace {

Touching cast_at_plane(const ConvexCore& core, const V3d& along, double most, const V3d& normal,
                       double offset) {
  const V3d lowest = core.support(normal * -1.0) - normal * core.radius;
  const double height = dot(normal, lowest) - offset, rise = dot(normal, along);
  if (height <= 0) return {true, true, 0, lowest - normal * height, along * (-1 / length(along))};
  if (rise >= 0 || -height / rise > most) return {};
  const double t = -height / rise;
  return {true, false, t, lowest + along * t, normal};
}

Vec3 unit(const V3d& v) { return vector(v * (1 / length(v))); }

}  // namespace

LocalHit QueryScene::ray_row(const Row& row, const RayCast& ray, double most, bool back_faces,
                             std::uint32_t& triangle) const {
  const LocalRay local{transposed_times(row.axes, wide(ray.origin) - row.origin),
                       transposed_times(row.axes, wide(ray.translation)), most};
  if (!core::is_surface(row.collider.type)) return ray_shape(row.collider, local);
  const SurfaceHit hit = ray_surface(row.collider, local, back_faces);
  triangle = hit.triangle;
  return hit.at;
}

Touching QueryScene::cast_row(const Row& row, const ConvexCore& core, const V3d& origin,
                              const V3d& translation, double most, std::uint32_t& triangle) const {
  if (row.collider.type < ShapeType::plane)
    return cast_core(core, translation, most,
                     convex_core(row.collider, row.origin - origin, row.axes));
  // Planes and surfaces in their own frame.
  const ConvexCore local = in_frame(core, origin, row.origin, row.axes);
  const V3d along = transposed_times(row.axes, translation);
  Touching touching;
  if (row.collider.type == ShapeType::plane) {
    touching =
        cast_at_plane(local, along, most, wide(row.collider.size), row.collider.plane_offset);
  } else {
    const SurfaceTouch touch = cast_at_surface(local, along, most, row.collider);
    touching = touch.at;
    triangle = touch.triangle;
  }
  touching.point = row.axes * touching.point + (row.origin - origin);
  touching.normal = row.axes * touching.normal;
  return touching;
}

namespace {

// The best of the hits seen so far: the least fraction, then the lowest body and shape.
struct Best {
  ColliderIndex collider = kNone;
  double fraction = 1;
};

CastHit ray_hit(const RayCast& ray, const LocalHit& hit, const M3d& axes, std::uint32_t triangle) {
  CastHit out;
  out.triangle = triangle;
  out.fraction = hit.t;
  out.position = ray.origin + hit.t * ray.translation;
  out.normal = hit.inside ? Vec3(-ray.translation.normalized()) : unit(axes * hit.normal);
  out.initial_overlap = hit.inside;
  return out;
}

CastHit cast_hit(const Touching& touching, const V3d& origin, std::uint32_t triangle) {
  CastHit out;
  out.triangle = triangle;
  out.fraction = touching.fraction;
  out.position = vector(origin + touching.point);
  out.normal = unit(touching.normal);
  out.initial_overlap = touching.at_start;
  return out;
}

void sort_hits(std::vector<CastHit>& hits) {
  std::sort(hits.begin(), hits.end(), [](const CastHit& a, const CastHit& b) {
    if (a.fraction != b.fraction) return a.fraction < b.fraction;
    if (a.body.index != b.body.index) return a.body.index < b.body.index;
    return a.shape < b.shape;
  });
}

V3d zero() { return {0, 0, 0}; }

}  // namespace

std::optional<CastHit> QueryScene::ray_cast(const RayCast& ray, const QueryFilter& filter) const {
  const MovingBox mover(wide(ray.origin), wide(ray.translation), zero());
  Best best;
  CastHit result;
  for_each_met(
      mover, [&] { return best.fraction; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        if (!passes(row.collider, filter)) return true;
        std::uint32_t triangle = kNone;
        const LocalHit hit = ray_row(row, ray, best.fraction, filter.back_faces, triangle);
        if (!hit.hit) return true;
        if (hit.t == best.fraction && best.collider != kNone && !before(c, best.collider))
          return true;
        if (!accepts(row.collider, filter)) return true;
        best = {c, hit.t};
        result = ray_hit(ray, hit, row.axes, triangle);
        return true;
      });
  if (best.collider == kNone) return std::nullopt;
  result.body = id_of(rows_[best.collider].collider);
  result.shape = rows_[best.collider].collider.shape_in_body;
  return result;
}

void QueryScene::ray_cast_all(const RayCast& ray, const QueryFilter& filter,
                              std::vector<CastHit>& hits) const {
  const MovingBox mover(wide(ray.origin), wide(ray.translation), zero());
  for_each_met(
      mover, [] { return 1.0; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        if (!passes(row.collider, filter)) return true;
        std::uint32_t triangle = kNone;
        const LocalHit hit = ray_row(row, ray, 1, filter.back_faces, triangle);
        if (!hit.hit || !accepts(row.collider, filter)) return true;
        CastHit& out = hits.emplace_back(ray_hit(ray, hit, row.axes, triangle));
        out.body = id_of(row.collider);
        out.shape = row.collider.shape_in_body;
        return true;
      });
  sort_hits(hits);
}

bool QueryScene::ray_hits(const RayCast& ray, const QueryFilter& filter) const {
  const MovingBox mover(wide(ray.origin), wide(ray.translation), zero());
  bool found = false;
  for_each_met(
      mover, [] { return 1.0; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        std::uint32_t triangle = kNone;
        found = passes(row.collider, filter) &&
                ray_row(row, ray, 1, filter.back_faces, triangle).hit &&
                accepts(row.collider, filter);
        return !found;
      });
  return found;
}

std::optional<CastHit> QueryScene::shape_cast(const ConvexCore& core, const V3d& origin,
                                              const Vec3& translation,
                                              const QueryFilter& filter) const {
  const CoreBox box = box_of(core);
  const MovingBox mover(origin + box.middle, wide(translation), box.half);
  Best best;
  CastHit result;
  for_each_met(
      mover, [&] { return best.fraction; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        if (!passes(row.collider, filter)) return true;
        std::uint32_t triangle = kNone;
        const Touching touching =
            cast_row(row, core, origin, wide(translation), best.fraction, triangle);
        if (!touching.hit) return true;
        if (touching.fraction == best.fraction && best.collider != kNone &&
            !before(c, best.collider))
          return true;
        if (!accepts(row.collider, filter)) return true;
        best = {c, touching.fraction};
        result = cast_hit(touching, origin, triangle);
        return true;
      });
  if (best.collider == kNone) return std::nullopt;
  result.body = id_of(rows_[best.collider].collider);
  result.shape = rows_[best.collider].collider.shape_in_body;
  return result;
}

void QueryScene::shape_cast_all(const ConvexCore& core, const V3d& origin, const Vec3& translation,
                                const QueryFilter& filter, std::vector<CastHit>& hits) const {
  const CoreBox box = box_of(core);
  const MovingBox mover(origin + box.middle, wide(translation), box.half);
  for_each_met(
      mover, [] { return 1.0; },
      [&](ColliderIndex c) {
        const Row& row = rows_[c];
        if (!passes(row.collider, filter)) return true;
        std::uint32_t triangle = kNone;
        const Touching touching = cast_row(row, core, origin, wide(translation), 1, triangle);
        if (!touching.hit || !accepts(row.collider, filter)) return true;
        CastHit& out = hits.emplace_back(cast_hit(touching, origin, triangle));
        out.body = id_of(row.collider);
        out.shape = row.collider.shape_in_body;
        return true;
      });
  sort_hits(hits);
}

}  // namespace skerry::collision
