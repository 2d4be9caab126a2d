// Turns what users give (points, triangles) into the geometry that colliders share.
#pragma once

#include <memory>
#include <string>

#include <skerry/shapes.h>

#include "core/colliders.h"

namespace skerry::collision {

// Convex hull of the points times the scale. Throws std::invalid_argument with a sentence if there are
// fewer than four, one is not finite, or they lie (nearly) in a plane, line or point.
std::shared_ptr<const core::HullGeometry> build_hull(std::vector<Vec3> points,
                                                     const Vec3& scale = {1, 1, 1});

// Mesh with adjacency, convex edge flags and bounding-volume tree; degenerate triangles are left
// out. Throws std::invalid_argument naming the first bad triangle or vertex: empty, index out of
// range, not finite, all degenerate.
std::shared_ptr<const core::MeshGeometry> build_mesh(const MeshData& mesh, const Vec3& scale);

// Height field with convex edge flags and bounding-volume tree. Throws std::invalid_argument if the
// sizes do not fit, there are more than 2^30 cells, all cells are holes, or a height of a cell that
// is no hole is not finite.
std::shared_ptr<const core::HeightFieldGeometry> build_height_field(const HeightFieldData& field,
                                                                    const Vec3& scale);

// Whether the surface bends outward across a triangle's edge from tail to head: the neighbour's far
// corner lies below the triangle's plane (`area_vector`: its normal, of any length). Edges that bend
// by less than about one degree count as flat: contacts on them get the face's normal.
bool is_convex_edge(const Vec3& area_vector, const Vec3& tail, const Vec3& head, const Vec3& far);

// What keeps a mesh from being the surface of a solid, as a sentence ("edge 3-7 belongs to one
// triangle only"); empty if it is closed, manifold and consistently wound.
std::string solid_defect(const MeshData& mesh);

}  // namespace skerry::collision
