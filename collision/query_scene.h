// What queries look into: a picture of all shapes, apart from the world's own arrays.
//
//   QueryState   what the simulating thread hands over: rows of bodies and colliders, each stamped
//                with when it last changed. Plain data.
//   QueryScene   the picture. It follows a QueryState in two moves: copy() takes over the rows that
//                changed, settle() brings boxes and trees up to date. Then it is const, and any
//                number of threads may ask it.
//   Trees        tight boxes, one tree of what may move and one of what is fixed; planes beside them.
//                The broadphase's own trees will not do: their fat boxes hold for the motion that
//                was foreseen, not for where bodies came to be, and not every kind has a tree.
#pragma once

#include <memory>
#include <vector>

#include <skerry/queries.h>

#include "collision/box_tree.h"
#include "collision/query_convex.h"
#include "collision/query_ray.h"
#include "core/bodies.h"
#include "core/colliders.h"

namespace skerry::collision {

using core::BodyIndex;

struct QueryBody {
  bool alive = false;
  bool fixed = false;
  std::uint32_t generation = 0;
  core::BodyPose pose;
  Vec3 local_center = Vec3::Zero();            // m, see core::BodyMass
  ColliderIndex first_collider = core::kNone;  // none while the body is quarantined
};

struct QueryState {
  std::uint64_t stamp = 0;                            // grows with every change
  std::uint64_t any_shapes_at = 0;                    // the largest of shapes_at
  std::uint64_t step = 0;                             // steps made
  std::vector<QueryBody> bodies;                      // [BodyIndex]
  std::vector<std::uint64_t> moved_at, shapes_at;     // [BodyIndex] stamp of the last change
  std::vector<core::Collider> colliders;              // [ColliderIndex]
  std::vector<std::shared_ptr<const void>> geometry;  // [ColliderIndex] keeps it alive
};

struct MovingBox;

class QueryScene {
 public:
  // Not const: one thread, and nobody may be asking.
  void copy(const QueryState& state);
  void settle();

  std::uint64_t stamp() const { return stamp_; }
  std::uint64_t step() const { return step_; }
  const QueryBody* find(BodyId body) const;  // null if it is not there

  std::optional<CastHit> ray_cast(const RayCast& ray, const QueryFilter& filter) const;
  void ray_cast_all(const RayCast& ray, const QueryFilter& filter,
                    std::vector<CastHit>& hits) const;
  bool ray_hits(const RayCast& ray, const QueryFilter& filter) const;

  // `core` in world coordinates less `origin`.
  std::optional<CastHit> shape_cast(const ConvexCore& core, const V3d& origin,
                                    const Vec3& translation, const QueryFilter& filter) const;
  void shape_cast_all(const ConvexCore& core, const V3d& origin, const Vec3& translation,
                      const QueryFilter& filter, std::vector<CastHit>& hits) const;
  void overlap(const ConvexCore& core, const V3d& origin, const QueryFilter& filter,
               std::vector<OverlapHit>& hits) const;
  std::optional<ClosestHit> closest(const ConvexCore& core, const V3d& origin, double max_distance,
                                    const QueryFilter& filter) const;
  void closest_all(const ConvexCore& core, const V3d& origin, double max_distance,
                   const QueryFilter& filter, std::vector<ClosestHit>& hits) const;
  // Bodies that are there.
  std::optional<BodyDistance> distance(BodyIndex a, BodyIndex b, double max_distance) const;

 private:
  // A collider with its place in the world.
  struct Row {
    core::Collider collider;
    V3d origin{0, 0, 0};  // m, of the shape frame
    M3d axes{};
    Aabb box{};
    bool in_tree = false;
    bool fixed = false;
  };

  void drop_shapes(BodyIndex body);
  void take_shapes(const QueryState& state, BodyIndex body);
  void place(ColliderIndex collider, const core::BodyPose& pose);

  bool passes(const core::Collider& collider, const QueryFilter& filter) const;
  bool accepts(const core::Collider& collider, const QueryFilter& filter) const;
  BodyId id_of(const core::Collider& collider) const {
    return {collider.body, bodies_[collider.body].generation};
  }
  bool before(ColliderIndex a, ColliderIndex b) const;

  // Calls visit(row) for shapes that a mover may meet, or that may be near a box, as walk_in_order
  // does; planes first.
  template <class Most, class Visit>
  void for_each_met(const MovingBox& mover, const Most& most, const Visit& visit) const;
  template <class Most, class Visit>
  void for_each_near(const Aabb& box, const Most& most, const Visit& visit) const;

  template <class Hit>
  std::optional<CastHit> first_hit(const MovingBox& mover, const QueryFilter& filter,
                                   const Hit& hit) const;
  template <class Hit>
  void all_hits(const MovingBox& mover, const QueryFilter& filter, const Hit& hit,
                std::vector<CastHit>& hits) const;
  void name_hit(const core::Collider& collider, CastHit& hit) const;
  auto ray_meets(const RayCast& ray, bool back_faces) const;
  auto shape_meets(const ConvexCore& core, const V3d& origin, const Vec3& translation) const;

  LocalHit ray_row(const Row& row, const RayCast& ray, double most, bool back_faces,
                   std::uint32_t& triangle) const;
  Touching cast_row(const Row& row, const ConvexCore& core, const V3d& origin,
                    const V3d& translation, double most, std::uint32_t& triangle) const;
  // Distance from a core, its ball counted; negative if it is more than `most`.
  struct RowDistance {
    double distance = -1;
    V3d on_core{0, 0, 0}, on_row{0, 0, 0};  // m, less `origin`
    V3d normal{0, 0, 0};                    // from the row to the core; zero if they overlap
    std::uint32_t triangle = core::kNone;
  };
  RowDistance row_distance(const Row& row, const ConvexCore& core, const V3d& origin,
                           double most) const;
  RowDistance rows_distance(const Row& a, const Row& b, const V3d& origin, double most) const;
  ClosestHit closest_hit(const Row& row, const V3d& origin, const RowDistance& found) const;

  std::uint64_t stamp_ = 0, step_ = 0;
  std::vector<QueryBody> bodies_;                      // [BodyIndex]
  std::vector<Row> rows_;                              // [ColliderIndex]
  std::vector<std::shared_ptr<const void>> geometry_;  // [ColliderIndex]
  std::vector<ColliderIndex> planes_;                  // ascending
  std::vector<BodyIndex> moved_;                       // between copy() and settle()
  BoxTree moving_, fixed_;
};

}  // namespace skerry::collision
