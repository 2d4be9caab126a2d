// Rays against single shapes, in the shape's own frame and in double.
//
//   Solid    a ray that begins in the interior hits at once (`inside`); one that begins on the
//            surface hits if it goes in and misses if it leaves.
//   Threads  pure functions.
#pragma once

#include "collision/query_convex.h"

namespace skerry::collision {

struct LocalRay {
  V3d origin, along;  // point at t: origin + along * t, t from 0 to `most`
  double most = 1;
};

struct LocalHit {
  bool hit = false;
  bool inside = false;  // began in the interior: t is 0, the normal means nothing
  double t = 0;
  V3d normal{0, 0, 0};  // out of the shape, of any length
};

// Any type but meshes and height fields.
LocalHit ray_shape(const core::Collider& collider, const LocalRay& ray);

// Triangles, watertight: a ray that meets an edge or a corner which triangles share hits one of them
// (Woop, Benthin, Wald, "Watertight ray/triangle intersection", JCGT 2013).
class TriangleRay {
 public:
  explicit TriangleRay(const LocalRay& ray);
  // Hits from both sides; the normal is the triangle's own, to its front. Rays in the triangle's
  // plane miss.
  LocalHit hit(const V3d& a, const V3d& b, const V3d& c) const;
  const LocalRay& ray() const { return ray_; }

 private:
  LocalRay ray_;
  int x_, y_, z_;  // axes, z_ the one along which the ray runs fastest
  double shear_x_, shear_y_, shear_z_;
};

}  // namespace skerry::collision
