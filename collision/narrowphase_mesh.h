// Shapes against triangle meshes. Meshes are surfaces with a front: shapes whose centre is behind a
// triangle do not touch it.
#pragma once

#include <vector>

#include "collision/narrowphase_pairs.h"

namespace skerry::collision {

// A contact with one triangle, before the triangles' contacts are brought together.
struct MeshPoint {
  V3f normal;  // of its contact, from the first shape to the second
  ContactPoint point;
};

// Positions in rows.
class Places {
 public:
  void clear() {
    x_.clear();
    y_.clear();
    z_.clear();
  }
  void add(const V3f& position) {
    x_.push_back(position.x);
    y_.push_back(position.y);
    z_.push_back(position.z);
  }
  // True if one of them is nearer to a position than the root of `squared`, m^2.
  bool hold_one_near(const V3f& position, float squared) const;

 private:
  std::vector<float> x_, y_, z_;
};

// Buffers that keep their capacity from pair to pair.
struct MeshScratch {
  std::vector<std::uint32_t> triangles;
  std::vector<MeshPoint> points;
  std::vector<ContactPoint> cluster;
  Places places;  // of the cluster
  TriangleBatch batch;
  BoxLanes box;  // the rows of `search`, if its shape is a box
  TriangleSearch search;
  TriangleAxes axes;
  TriangleTouches touches;
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

// Brings points together in patches: the deepest point's normal, with all points of about that
// normal, then the next deepest that is left.
void gather_patches(MeshScratch& scratch, PatchSet& patches);

}  // namespace skerry::collision
