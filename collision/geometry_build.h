// Turns what users give (points, triangles) into the geometry that colliders share.
#pragma once

#include <memory>
#include <string>

#include <skerry/shapes.h>

#include "core/colliders.h"

namespace skerry::collision {

// Convex hull of the points. Throws std::invalid_argument with a sentence if there are fewer than
// four, one is not finite, or they lie (nearly) in a plane, line or point.
std::shared_ptr<const core::HullGeometry> build_hull(const std::vector<Vec3>& points);

// Mesh with adjacency, convex edge flags and bounding-volume tree; degenerate triangles are left
// out. Throws std::invalid_argument naming the first bad triangle or vertex: empty, index out of
// range, not finite, all degenerate.
std::shared_ptr<const core::MeshGeometry> build_mesh(const MeshData& mesh, const Vec3& scale);

// What keeps a mesh from being the surface of a solid, as a sentence ("edge 3-7 belongs to one
// triangle only"); empty if it is closed, manifold and consistently wound.
std::string solid_defect(const MeshData& mesh);

}  // namespace skerry::collision
