// Convex hull of points as triangles, with exact predicates.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <skerry/types.h>

namespace skerry::collision {

// Triangles (counter-clockwise seen from outside, indices into `points`) of the convex hull.
//
// Points are rounded to a grid of 2^24 cells along the longest extent (that of float), and all
// decisions are made there in integers: no tolerance, and the result is always a closed convex
// polyhedron. Coplanar points give several triangles in one plane; build_hull merges them.
//
//   Source  Barber, Dobkin, Huhdanpaa, "The Quickhull algorithm for convex hulls" (1996).
//   Errors  std::invalid_argument: fewer than four points, one not finite, or all (nearly) in a
//           plane, line or point: thinner than 2e-5 of the longest extent.
std::vector<std::array<std::uint32_t, 3>> quickhull(std::span<const Vec3> points);

}  // namespace skerry::collision
