// Shapes against triangle meshes. Meshes are surfaces with a front: shapes whose centre is behind a
// triangle do not touch it.
#pragma once

#include <vector>

#include "collision/mesh_points.h"
#include "collision/narrowphase_pairs.h"

namespace skerry::collision {

// Buffers that keep their capacity from pair to pair.
struct MeshScratch {
  std::vector<std::uint32_t> triangles;
  MeshPoints points;
  TriangleBatch batch;
  BoxLanes box;  // the rows of `search`, if its shape is a box
  TriangleSearch search;
  TriangleAxes axes;
  TriangleTouches touches;
  TriangleClips clips;
};

// A convex shape (first) against a mesh: a contact per triangle, in up to kMeshManifolds patches of
// about one normal each. Contacts with edges between triangles are kept only where the edge is
// convex, and only within the wedge of its two normals, so that nothing trips over the seams of a
// flat or hollow surface. Returns the number of triangles whose contact could not be computed.
std::uint32_t convex_mesh(const PlacedShape& a, const PlacedShape& b, Query& query,
                          MeshScratch& scratch, PatchSet& patches);

// A mesh (second) against a plane (first): its vertices.
void plane_mesh(const PlacedShape& plane, const PlacedShape& mesh, Query& query,
                MeshScratch& scratch, PatchSet& patches);

// Brings points together in patches: the deepest contact with all of about its normal, then the next
// deepest that is left. Points nearer to each other than `near`, m, are one.
void gather_patches(MeshPoints& points, float near, PatchSet& patches);

}  // namespace skerry::collision
