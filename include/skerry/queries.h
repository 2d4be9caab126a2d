// Questions about where things are: rays, moving shapes, overlaps, distances.
//
//   Picture   a QueryView is an immutable picture of all shapes after one step (with what was added,
//             removed or teleported since). World::queries() gives the newest; World's own methods
//             ask that one.
//   Order     results do not depend on threads, on the world's mode or on how the tree grew: hits
//             are sorted by fraction (or distance), then body index, then shape.
//   Solids    convex shapes and planes are solid, meshes and height fields are surfaces with two
//             sides. Touching counts.
//   Numbers   double throughout: a query 1000 km from the origin is as exact as one at it, but for
//             the shapes' own sizes, which are float.
//   Errors    InputError names the field and the value; a stale BodyId is a UsageError. Exceptions
//             of QueryFilter::accept reach the caller.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <skerry/ids.h>
#include <skerry/shapes.h>
#include <skerry/types.h>

namespace skerry {

namespace collision {
class QueryScene;
struct QueryConvex;
}  // namespace collision

// Which shapes a query sees.
struct QueryFilter {
  // The query meets a shape as if it were one with this filter (see Filter).
  Filter filter = {.category = 0xffffffffu};
  bool sensors = false;             // sensors too
  bool back_faces = true;           // rays: triangles seen from behind too
  std::vector<BodyId> ignore = {};  // bodies that are not there; stale ids do no harm
  // The last word on a shape that passed the rest: false leaves it out. In batches it is called by
  // several threads at once. Must not change the world.
  std::function<bool(BodyId body, std::uint32_t shape)> accept = {};
};

inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;

// From `origin` (m, world) to origin + translation; at least 1e-9 m long. Coordinates up to 1e15 m.
struct RayCast {
  Vec3 origin = Vec3::Zero();
  Vec3 translation = Vec3::Zero();
};

// A convex shape to ask with, checked and built once. Anything but planes, meshes and height fields;
// of the options only the local pose counts. Cheap to copy; any thread, any world.
class QueryShape {
 public:
  QueryShape(const Shape& shape);  // NOLINT: implicit on purpose
  template <class Geometry>
  requires std::is_constructible_v<ShapeGeometry, Geometry> QueryShape(
      Geometry geometry)  // NOLINT: implicit on purpose
      : QueryShape(Shape(std::move(geometry))) {}

 private:
  friend class QueryView;
  std::shared_ptr<const collision::QueryConvex> convex_;
};

// A shape that moves from `pose` by `translation` (m, at least 1e-9 m) without turning.
struct ShapeCast {
  QueryShape shape;
  Pose pose = {};
  Vec3 translation = Vec3::Zero();
};

// A shape at a pose, for batches of overlap and closest.
struct PlacedShape {
  QueryShape shape;
  Pose pose = {};
};

// Where a ray or a moving shape first touches a shape.
struct CastHit {
  BodyId body;
  std::uint32_t shape = 0;               // position in BodyDesc::shapes
  std::uint32_t triangle = kNoTriangle;  // row of MeshData::triangles; see HeightFieldData
  double fraction = 0;                   // of the translation, 0 to 1
  Vec3 position = Vec3::Zero();          // m, world, on the shape that was hit
  Vec3 normal = Vec3::Zero();            // unit, out of the shape that was hit
  // Began inside a solid, or a moving shape began in touch with something: the fraction is 0, the
  // normal points against the translation, and the position is a ray's origin or a point that the
  // two have in common.
  bool initial_overlap = false;
};

struct OverlapHit {
  BodyId body;
  std::uint32_t shape = 0;

  friend bool operator==(const OverlapHit&, const OverlapHit&) = default;
};

// The points of a shape and of what was asked about that are nearest to each other.
struct ClosestHit {
  BodyId body;
  std::uint32_t shape = 0;
  std::uint32_t triangle = kNoTriangle;
  double distance = 0;           // m; 0: they overlap
  Vec3 on_query = Vec3::Zero();  // m, world, on the query's point or shape
  Vec3 on_body = Vec3::Zero();   // m, world
  Vec3 normal = Vec3::Zero();    // unit, from the body to the query; zero if they overlap
};

struct BodyDistance {
  double distance = 0;  // m; 0: they overlap
  std::uint32_t shape_a = 0, shape_b = 0;
  Vec3 on_a = Vec3::Zero(), on_b = Vec3::Zero();  // m, world, nearest points
  Vec3 normal = Vec3::Zero();                     // unit, from a to b; zero if they overlap
};

// Immutable, cheap to copy, outlives its world; any number of threads at once.
class QueryView {
 public:
  QueryView() = default;

  bool empty() const { return scene_ == nullptr; }
  std::uint64_t step() const;  // steps made when the picture was taken
  bool contains(BodyId body) const;
  std::optional<Pose> pose(BodyId body) const;  // of the body frame

  // -- Rays. Of each shape the first touch counts. A ray that begins on a surface and leaves misses.
  std::optional<CastHit> ray_cast(const RayCast& ray, const QueryFilter& filter = {}) const;
  std::vector<CastHit> ray_cast_all(const RayCast& ray, const QueryFilter& filter = {}) const;
  bool ray_hits(const RayCast& ray, const QueryFilter& filter = {}) const;  // anything at all

  // -- Moving shapes.
  std::optional<CastHit> shape_cast(const ShapeCast& cast, const QueryFilter& filter = {}) const;
  std::vector<CastHit> shape_cast_all(const ShapeCast& cast, const QueryFilter& filter = {}) const;

  // -- Overlaps and distances. By body index, then shape.
  std::vector<OverlapHit> overlap(const QueryShape& shape, const Pose& pose,
                                  const QueryFilter& filter = {}) const;
  // The nearest within max_distance (m, 0 to 1e15), or all, one per shape.
  std::optional<ClosestHit> closest(const Vec3& point, double max_distance,
                                    const QueryFilter& filter = {}) const;
  std::optional<ClosestHit> closest(const QueryShape& shape, const Pose& pose, double max_distance,
                                    const QueryFilter& filter = {}) const;
  std::vector<ClosestHit> closest_all(const Vec3& point, double max_distance,
                                      const QueryFilter& filter = {}) const;
  std::vector<ClosestHit> closest_all(const QueryShape& shape, const Pose& pose,
                                      double max_distance, const QueryFilter& filter = {}) const;
  // Between two bodies, sensors left out; nothing if they are farther apart than max_distance or one
  // has no shapes.
  std::optional<BodyDistance> distance(BodyId a, BodyId b, double max_distance = 1e15) const;

 private:
  friend class World;
  explicit QueryView(std::shared_ptr<const collision::QueryScene> scene);
  std::shared_ptr<const collision::QueryScene> scene_;
};

}  // namespace skerry
