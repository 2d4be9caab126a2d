// The public face of queries: checks what it was given, then hands over to the picture.
#include <skerry/queries.h>

#include <skerry/error.h>

#include "collision/geometry_build.h"
#include "collision/query_scene.h"
#include "pipeline/edge_checks.h"

namespace skerry {

using collision::ConvexCore;
using collision::QueryConvex;
using collision::QueryScene;
using collision::wide;

namespace {

// The measures of a shape that may be asked with, as Collider::size has them.
struct ConvexBuilder {
  QueryConvex& out;

  void basic(core::ShapeType type, double x, double y, double z) const {
    out.collider.type = type;
    out.collider.size = core::to_float(Vec3(x, y, z));
  }
  void operator()(const Sphere& s) const { basic(core::ShapeType::sphere, s.radius, 0, 0); }
  void operator()(const Capsule& s) const {
    basic(core::ShapeType::capsule, s.radius, s.half_height, 0);
  }
  void operator()(const Box& s) const {
    basic(core::ShapeType::box, s.half_extents.x(), s.half_extents.y(), s.half_extents.z());
  }
  void operator()(const Cylinder& s) const {
    basic(core::ShapeType::cylinder, s.radius, s.half_height, 0);
  }
  void operator()(const Cone& s) const { basic(core::ShapeType::cone, s.radius, s.half_height, 0); }
  void operator()(const Ellipsoid& s) const {
    basic(core::ShapeType::ellipsoid, s.semi_axes.x(), s.semi_axes.y(), s.semi_axes.z());
  }
  void operator()(const ConvexHull& s) const {
    std::shared_ptr<const core::HullGeometry> hull;
    try {
      hull = collision::build_hull(s.points, s.scale);
    } catch (const std::invalid_argument& error) {
      throw InputError("shape.points", std::string("shape.points: ") + error.what());
    }
    out.collider.type = core::ShapeType::hull;
    out.collider.hull = hull.get();
    out.geometry = std::move(hull);
  }
  void operator()(const Plane&) const {}
  void operator()(const TriangleMesh&) const {}
  void operator()(const HeightField&) const {}
};

// A shape at a pose, in coordinates whose origin is the pose's position.
ConvexCore placed(const QueryConvex& convex, const Pose& pose) {
  const collision::M3d axes = collision::matrix_of(pose.orientation.normalized());
  return collision::convex_core(
      convex.collider, axes * wide(convex.local.position),
      collision::product(axes, collision::matrix_of(convex.local.orientation)));
}

const QueryScene& require(const std::shared_ptr<const QueryScene>& scene) {
  if (!scene) throw UsageError("this QueryView is empty: it came from no world");
  return *scene;
}

core::BodyIndex require(const QueryScene& scene, BodyId body) {
  if (!scene.find(body))
    throw UsageError("body " + std::to_string(body.index) + " (generation " +
                     std::to_string(body.generation) + ") is not in this picture of the world");
  return body.index;
}

// A point as a shape without size.
const ConvexCore kPoint{};

}  // namespace

QueryShape::QueryShape(const Shape& shape) {
  pipeline::check_query_shape(shape);
  auto convex = std::make_shared<QueryConvex>();
  std::visit(ConvexBuilder{*convex}, shape.geometry);
  convex->local = shape.options.local_pose;
  convex->local.orientation.normalize();
  convex_ = std::move(convex);
}

QueryView::QueryView(std::shared_ptr<const QueryScene> scene) : scene_(std::move(scene)) {}

std::uint64_t QueryView::step() const { return require(scene_).step(); }
bool QueryView::contains(BodyId body) const { return require(scene_).find(body) != nullptr; }
std::optional<Pose> QueryView::pose(BodyId body) const {
  const collision::QueryBody* row = require(scene_).find(body);
  if (!row) return std::nullopt;
  return core::body_frame(row->pose, row->local_center);
}

std::optional<CastHit> QueryView::ray_cast(const RayCast& ray, const QueryFilter& filter) const {
  pipeline::check_ray(ray);
  return require(scene_).ray_cast(ray, filter);
}
std::vector<CastHit> QueryView::ray_cast_all(const RayCast& ray, const QueryFilter& filter) const {
  pipeline::check_ray(ray);
  std::vector<CastHit> hits;
  require(scene_).ray_cast_all(ray, filter, hits);
  return hits;
}
bool QueryView::ray_hits(const RayCast& ray, const QueryFilter& filter) const {
  pipeline::check_ray(ray);
  return require(scene_).ray_hits(ray, filter);
}

std::optional<CastHit> QueryView::shape_cast(const ShapeCast& cast,
                                             const QueryFilter& filter) const {
  pipeline::check_cast(cast);
  return require(scene_).shape_cast(placed(*cast.shape.convex_, cast.pose),
                                    wide(cast.pose.position), cast.translation, filter);
}
std::vector<CastHit> QueryView::shape_cast_all(const ShapeCast& cast,
                                               const QueryFilter& filter) const {
  pipeline::check_cast(cast);
  std::vector<CastHit> hits;
  require(scene_).shape_cast_all(placed(*cast.shape.convex_, cast.pose), wide(cast.pose.position),
                                 cast.translation, filter, hits);
  return hits;
}

std::vector<OverlapHit> QueryView::overlap(const QueryShape& shape, const Pose& pose,
                                           const QueryFilter& filter) const {
  pipeline::check_query_pose("pose", pose);
  std::vector<OverlapHit> hits;
  require(scene_).overlap(placed(*shape.convex_, pose), wide(pose.position), filter, hits);
  return hits;
}

std::optional<ClosestHit> QueryView::closest(const Vec3& point, double max_distance,
                                             const QueryFilter& filter) const {
  pipeline::check_query_point("point", point);
  pipeline::check_max_distance(max_distance);
  return require(scene_).closest(kPoint, wide(point), max_distance, filter);
}
std::optional<ClosestHit> QueryView::closest(const QueryShape& shape, const Pose& pose,
                                             double max_distance, const QueryFilter& filter) const {
  pipeline::check_query_pose("pose", pose);
  pipeline::check_max_distance(max_distance);
  return require(scene_).closest(placed(*shape.convex_, pose), wide(pose.position), max_distance,
                                 filter);
}
std::vector<ClosestHit> QueryView::closest_all(const Vec3& point, double max_distance,
                                               const QueryFilter& filter) const {
  pipeline::check_query_point("point", point);
  pipeline::check_max_distance(max_distance);
  std::vector<ClosestHit> hits;
  require(scene_).closest_all(kPoint, wide(point), max_distance, filter, hits);
  return hits;
}
std::vector<ClosestHit> QueryView::closest_all(const QueryShape& shape, const Pose& pose,
                                               double max_distance,
                                               const QueryFilter& filter) const {
  pipeline::check_query_pose("pose", pose);
  pipeline::check_max_distance(max_distance);
  std::vector<ClosestHit> hits;
  require(scene_).closest_all(placed(*shape.convex_, pose), wide(pose.position), max_distance,
                              filter, hits);
  return hits;
}

std::optional<BodyDistance> QueryView::distance(BodyId a, BodyId b, double max_distance) const {
  pipeline::check_max_distance(max_distance);
  const QueryScene& scene = require(scene_);
  return scene.distance(require(scene, a), require(scene, b), max_distance);
}

}  // namespace skerry
