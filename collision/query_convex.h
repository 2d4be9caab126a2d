// Convex shapes in double, for queries: support points, distance, first touch while moving.
//
//   Frame    world axes; the caller chooses an origin near the query, so that nothing is lost far
//            from the world's.
//   Threads  pure functions.
#pragma once

#include <memory>

#include "core/colliders.h"
#include "core/vec.h"

namespace skerry::collision {

using V3d = core::V3<double>;
using M3d = core::M3<double>;

inline V3d wide(const core::V3f& v) { return {double(v.x), double(v.y), double(v.z)}; }
inline V3d wide(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Vec3 vector(const V3d& v) { return {v.x, v.y, v.z}; }
inline double length(const V3d& v) { return std::sqrt(dot(v, v)); }
inline M3d matrix_of(const Quat& q) {
  return to_matrix(core::Q4<double>{q.x(), q.y(), q.z(), q.w()});
}
inline M3d matrix_of(const core::Q4f& q) {
  return to_matrix(core::Q4<double>{double(q.x), double(q.y), double(q.z), double(q.w)});
}
inline M3d product(const M3d& a, const M3d& b) { return {a * b.c0, a * b.c1, a * b.c2}; }

// A placed convex shape: a core and the radius of the ball that is added to it all around.
struct ConvexCore {
  enum class Kind : std::uint8_t { point, segment, box, cylinder, cone, ellipsoid, hull, triangle };

  Kind kind = Kind::point;
  double radius = 0;    // m
  V3d center{0, 0, 0};  // m, origin of the shape frame
  M3d axes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  V3d size{0, 0, 0};  // as Collider::size
  const core::HullGeometry* hull = nullptr;
  V3d corner[3] = {
      {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};  // of a triangle, relative to `center`; axes do not count

  // The core's farthest point along a direction of any length but zero.
  V3d support(const V3d& along) const;
  // How far the shape, its ball included, reaches from `center` along a unit direction.
  double reach(const V3d& unit) const;
};

// A sphere, capsule, box, cylinder, cone, ellipsoid or hull. `collider` may give a place of its own;
// here only `center` and `axes` count.
ConvexCore convex_core(const core::Collider& collider, const V3d& center, const M3d& axes);

// A core given in coordinates less `origin`, seen from the frame at `place` with `axes`.
ConvexCore in_frame(const ConvexCore& core, const V3d& origin, const V3d& place, const M3d& axes);

// What QueryShape holds.
struct QueryConvex {
  core::Collider collider;
  std::shared_ptr<const void> geometry;  // keeps a hull alive
  Pose local;                            // of the shape frame in the frame that is asked with
};

// How two cores lie to each other. The nearest points `a` and `b` are on the cores; if those
// overlap, both are a point that they have in common.
struct CoreDistance {
  double distance = 0;  // m; 0: the cores overlap
  V3d a{0, 0, 0}, b{0, 0, 0};
  V3d normal{0, 0, 0};  // unit, from a to b; zero if the cores overlap
  double gap = 0;       // m, of two planes across `normal` that part the cores: a lower bound
};

// Distance by Gilbert, Johnson and Keerthi, "A fast procedure for computing the distance between
// complex objects" (1988), a moved by `shift`. `guess` (any length, may be zero) points from a to b.
CoreDistance core_distance(const ConvexCore& a, const V3d& shift, const ConvexCore& b,
                           const V3d& guess);

// A point that two shapes have in common, their balls counted; if they are apart, b's nearest.
V3d common_point(const CoreDistance& found, double radius_a, double radius_b);

struct Touching {
  bool hit = false;
  bool at_start = false;  // they touched before a moved
  double fraction = 0;
  V3d point{0, 0, 0};   // on b
  V3d normal{0, 0, 0};  // unit, out of b
};
// First touch of a, moving by `translation` times at most `most`, with b. Conservative advancement
// (Mirtich, "Impulse-based dynamic simulation", 1996, 2.3): each pose allows a further stretch on
// which the planes between the two still part them.
Touching cast_core(const ConvexCore& a, const V3d& translation, double most, const ConvexCore& b);

}  // namespace skerry::collision
