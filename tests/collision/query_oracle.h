// Convex shapes by their definitions, apart from the engine's code: what a query's answer is checked
// against. An answer is proved, not recomputed: points that belong to both shapes bound a distance
// from above, a plane between them bounds it from below.
#pragma once

#include <skerry/world.h>

namespace skerry::test {

// A placed convex shape (or one triangle: see triangle_solid).
struct Solid {
  ShapeGeometry geometry = Sphere{};
  Pose pose = {};

  bool contains(const Vec3& point, double tolerance) const;
  Vec3 support(const Vec3& along) const;
};

// First t in [0, 1] on which origin + t * translation is inside, by sampling and bisection; negative
// if no sample is inside (a chord shorter than the samples are apart may be missed).
double first_inside(const Solid& solid, const Vec3& origin, const Vec3& translation);

// Of two solids, a moved by `shift`: how far planes across the unit vector n (from a to b) part them.
double plane_gap(const Solid& a, const Vec3& shift, const Solid& b, const Vec3& n);

// Moeller and Trumbore's test; the fraction, or a negative number.
double ray_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& origin,
                    const Vec3& translation);

// Nearest point of a triangle.
Vec3 nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point);

}  // namespace skerry::test
