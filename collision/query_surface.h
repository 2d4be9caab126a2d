// Queries against triangle meshes and height fields, in the shape's own frame. Both sides count,
// unless said otherwise. Triangles are named as users know them: rows of MeshData::triangles, numbers
// of HeightFieldData. Of equal hits the lowest triangle is taken.
#pragma once

#include "collision/bounds.h"
#include "collision/query_convex.h"
#include "collision/query_ray.h"

namespace skerry::collision {

struct SurfaceHit {
  LocalHit at;  // the normal is out of the side that was hit
  std::uint32_t triangle = core::kNone;
};
SurfaceHit ray_surface(const core::Collider& surface, const LocalRay& ray, bool back_faces);

struct SurfaceTouch {
  Touching at;
  std::uint32_t triangle = core::kNone;
};
// First touch of a core that moves by `translation` times at most `most`.
SurfaceTouch cast_at_surface(const ConvexCore& core, const V3d& translation, double most,
                             const core::Collider& surface);

bool overlaps_surface(const ConvexCore& core, const core::Collider& surface);

struct SurfaceDistance {
  bool found = false;
  CoreDistance at;  // a: on the core without its ball; b: on the surface
  std::uint32_t triangle = core::kNone;
};
// The nearest triangle whose distance from the core, its ball included, is at most `most`.
SurfaceDistance nearest_on_surface(const ConvexCore& core, const core::Collider& surface,
                                   double most);

// Lowest height of the surface's vertices along a unit direction, and where.
struct LowestVertex {
  double height = 0;
  V3d point{0, 0, 0};
  std::uint32_t triangle = core::kNone;
};
LowestVertex lowest_vertex(const core::Collider& surface, const V3d& along);

// Number of triangles, holes included, and whether one is there; triangle i as a core. For queries of
// one surface against another.
std::uint32_t triangle_count(const core::Collider& surface);
bool has_triangle(const core::Collider& surface, std::uint32_t row);
ConvexCore triangle_core(const core::Collider& surface, std::uint32_t row);
std::uint32_t triangle_name(const core::Collider& surface, std::uint32_t row);

// Box around a core with its ball: its middle and half extents along the axes of the core's frame.
struct CoreBox {
  V3d middle, half;
  Aabb outward() const;  // rounded outward to float
};
CoreBox box_of(const ConvexCore& core);

}  // namespace skerry::collision
