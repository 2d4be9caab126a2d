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

MovingBox ray_mover(const RayCast& ray) {
  return MovingBox(wide(ray.origin), wide(ray.translation), {0, 0, 0});
}

MovingBox shape_mover(const ConvexCore& core, const V3d& origin, const Vec3& translation) {
  const CoreBox box = box_of(core);
  return MovingBox(origin + box.middle, wide(translation), box.half);
}

}  // namespace

// `hit(row, most)`: where the mover meets the row, at a fraction of at most `most`. Of equal
// fractions the lowest body and shape counts.
template <class Hit>
std::optional<CastHit> QueryScene::first_hit(const MovingBox& mover, const QueryFilter& filter,
                                             const Hit& hit) const {
  std::optional<CastHit> best;
  ColliderIndex best_row = kNone;
  const auto most = [&best] { return best ? best->fraction : 1.0; };
  for_each_met(mover, most, [&](ColliderIndex c) {
    const Collider& collider = rows_[c].collider;
    if (!passes(collider, filter)) return true;
    const std::optional<CastHit> found = hit(rows_[c], most());
    if (!found) return true;
    if (best && found->fraction == best->fraction && !before(c, best_row)) return true;
    if (!accepts(collider, filter)) return true;
    best = found;
    best_row = c;
    return true;
  });
  if (best) name_hit(rows_[best_row].collider, *best);
  return best;
}

template <class Hit>
void QueryScene::all_hits(const MovingBox& mover, const QueryFilter& filter, const Hit& hit,
                          std::vector<CastHit>& hits) const {
  for_each_met(
      mover, [] { return 1.0; },
      [&](ColliderIndex c) {
        const Collider& collider = rows_[c].collider;
        if (!passes(collider, filter)) return true;
        const std::optional<CastHit> found = hit(rows_[c], 1.0);
        if (found && accepts(collider, filter)) name_hit(collider, hits.emplace_back(*found));
        return true;
      });
  sort_hits(hits);
}

void QueryScene::name_hit(const Collider& collider, CastHit& hit) const {
  hit.body = id_of(collider);
  hit.shape = collider.shape_in_body;
}

// What first_hit and all_hits ask, for a ray and for a moving shape.
auto QueryScene::ray_meets(const RayCast& ray, bool back_faces) const {
  return [this, &ray, back_faces](const Row& row, double most) -> std::optional<CastHit> {
    std::uint32_t triangle = kNone;
    const LocalHit hit = ray_row(row, ray, most, back_faces, triangle);
    if (!hit.hit) return std::nullopt;
    return ray_hit(ray, hit, row.axes, triangle);
  };
}
auto QueryScene::shape_meets(const ConvexCore& core, const V3d& origin,
                             const Vec3& translation) const {
  return [this, &core, &origin, along = wide(translation)](const Row& row,
                                                           double most) -> std::optional<CastHit> {
    std::uint32_t triangle = kNone;
    const Touching touching = cast_row(row, core, origin, along, most, triangle);
    if (!touching.hit) return std::nullopt;
    return cast_hit(touching, origin, triangle);
  };
}

std::optional<CastHit> QueryScene::ray_cast(const RayCast& ray, const QueryFilter& filter) const {
  return first_hit(ray_mover(ray), filter, ray_meets(ray, filter.back_faces));
}

void QueryScene::ray_cast_all(const RayCast& ray, const QueryFilter& filter,
                              std::vector<CastHit>& hits) const {
  all_hits(ray_mover(ray), filter, ray_meets(ray, filter.back_faces), hits);
}

bool QueryScene::ray_hits(const RayCast& ray, const QueryFilter& filter) const {
  bool found = false;
  for_each_met(
      ray_mover(ray), [] { return 1.0; },
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
  return first_hit(shape_mover(core, origin, translation), filter,
                   shape_meets(core, origin, translation));
}

void QueryScene::shape_cast_all(const ConvexCore& core, const V3d& origin, const Vec3& translation,
                                const QueryFilter& filter, std::vector<CastHit>& hits) const {
  all_hits(shape_mover(core, origin, translation), filter, shape_meets(core, origin, translation),
           hits);
}

}  // namespace skerry::collision
