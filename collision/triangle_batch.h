// Sixteen triangles of a mesh or height field side by side, and the kernels that test one shape
// against all of them.
//
//   Bits     the same for every instruction set.
//   Threads  pure functions of their arguments.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/polytope_lanes.h"
#include "core/vec.h"

namespace skerry::collision {

// A triangle in the frame of its surface. What may be touched: see Triangle.
struct SurfaceTriangle {
  core::V3f corner[3];     // m, counter-clockwise seen from the front
  core::V3f normal;        // unit, to the front
  core::V3f beyond[3]{};   // normals of the neighbours across touchable edges
  unsigned touchable = 0;  // bit per edge
  unsigned border = 0;     // bit per touchable edge without a neighbour
};

struct TriangleBatch {
  static constexpr int kSize = 16;  // lanes; every SIMD width divides it
  enum Row {
    kCorner = 0,      // three corners, m
    kNormal = 9,      // unit, to the front
    kBeyond = 12,     // of the three edges, see Triangle; of borders: anything, until placed
    kTouchable = 21,  // of the edges: 1 or 0
    kBorder = 24,     // likewise
    kRows = 27
  };
  alignas(64) float rows[kRows][kSize];

  void put(int lane, const SurfaceTriangle& triangle);
};

// Takes the first `count` triangles from their surface's frame into the pair's. Bit per triangle
// that has `middle` in front of it or on it.
struct SurfaceFrame {
  core::V3f center;  // m, its origin
  core::M3f axes;
};
unsigned place_triangles(const SurfaceFrame& surface, const core::V3f& middle, int count,
                         TriangleBatch& batch);

// -- A polytope a against triangles b: separating axes, as search_axes finds them, but that a's
// faces count only where contacts may lean so far (see leans_too_far).
struct TriangleSearch {
  PolytopeLanes a;
  core::V3f center;    // m, of a's frame in the pair's
  core::M3f axes;      // of a's frame
  core::M3f rotation;  // of the pair's frame in a's
  core::V3f offset;    // m, origin of the pair's frame in a's
  float margin = 0;    // m: beyond this separation shapes are apart
  float tie = 0;       // axes that differ by less than this part of the size are as good
  struct Edge {        // in the pair's frame, see PolytopeLanes::EdgeRow
    core::V3f tail, along, left, right;
    float left_offset, right_offset;
  };
  std::vector<Edge> edges;              // of a
  std::vector<core::V3f> face_normals;  // of a, in the pair's frame
};
struct alignas(64) TriangleAxes {
  float face_a[TriangleBatch::kSize], face_a_index[TriangleBatch::kSize];  // m; lowest among equals
  float face_b[TriangleBatch::kSize];                                      // m
  float edges[TriangleBatch::kSize], edges_index[TriangleBatch::kSize];    // 3 * a's + triangle's
  // Which of them the contact takes: faces before edges and a's before the triangle's, unless the
  // other is better by more than a tie. No edges where one of a's faces is better that may not be a
  // normal: they are not what is nearest, and the neighbours answer for what is.
  float of_b[TriangleBatch::kSize];    // of the faces: 1 if the triangle's, else 0
  float facing[TriangleBatch::kSize];  // a's face that takes part: its own, or the one opposite
  unsigned by_edges;                   // bit per triangle
};
// Bit per triangle that is not farther than the margin along any axis. Others' axes say nothing.
unsigned search_triangles(const TriangleSearch& search, int count, const TriangleBatch& batch,
                          TriangleAxes& axes);

// -- A sphere against triangles: the nearest point, unless a neighbour answers for it.
struct TriangleTouches {
  alignas(64) float out[3][TriangleBatch::kSize];    // unit, from the triangle to the sphere
  alignas(64) float distance[TriangleBatch::kSize];  // m, of the centre
};
// Bit per triangle within `reach` of the centre.
unsigned touch_triangles(const core::V3f& center, float reach, int count,
                         const TriangleBatch& batch, TriangleTouches& touches);

// -- Where a face of a polytope and triangles lie over each other, seen along their contacts'
// normals.
struct ClipFace {
  static constexpr std::uint32_t kMaxCorners = 24;
  core::V3f normal;  // unit, outward
  core::V3f u, v;    // unit; u x v = normal
  float offset = 0;  // m, along the normal
  std::uint32_t count = 0;
  core::V3f corners[kMaxCorners];                  // m, counter-clockwise seen from outside
  float x[kMaxCorners], y[kMaxCorners];            // m, along u and v
  float side_x[kMaxCorners], side_y[kMaxCorners];  // unit, outward: edge i leaves corner i
  float side_offset[kMaxCorners];                  // m, a little outside the edge
  std::uint16_t ids[kMaxCorners];                  // the same for the same place of the shape
};
struct ClipQuery {            // see Query
  core::V3f linear, angular;  // m/s, rad/s
  float dt = 0, slop = 0;     // s, m
};
struct TriangleClips {
  // Candidates of a triangle: where each of its edges enters the face, where it leaves, and the
  // face's corners over the triangle.
  static constexpr int kEnter = 0, kLeave = 3, kCorners = 6;
  static constexpr int kMost = kCorners + int{ClipFace::kMaxCorners};
  // Of a capsule: the ends of the stretch of its axis over the triangle's face; the nearest point.
  static constexpr int kLow = 0, kHigh = 1, kNearest = 2;
  alignas(64) float normal[3][TriangleBatch::kSize];  // unit, from the polytope to the triangle
  struct alignas(64) Candidate {
    float position[3][TriangleBatch::kSize];  // m, halfway between the two surfaces
    float separation[TriangleBatch::kSize];   // m, along the contact's normal
    // Of edges: the face's edge that they cross there, or -1 where they begin.
    float side[TriangleBatch::kSize];
  } candidates[kMost];
  // Bit per triangle for which a candidate is a point that can touch within the step.
  unsigned valid[kMost];
};
// Of the triangles in `lanes`, whose contacts take this face. Fills 6 candidates and one per corner.
void clip_triangles(const ClipFace& face, const ClipQuery& query, unsigned lanes,
                    const TriangleBatch& batch, const TriangleAxes& axes, TriangleClips& clips);

// -- Triangles that touch the flat end of a cylinder or cone as they would touch a polytope's face.
struct CappedShape {
  core::V3f center;           // m
  core::M3f axes;             // y: the shape's axis
  float radius, half_height;  // m
  bool pointed;               // no flat end at +y
};
struct CapLanes {
  unsigned near = 0;  // bit per triangle that no flat end parts from the shape
  unsigned flat = 0;  // of those: see TriangleAxes::of_b, and `facing`: 0 at -y, 1 at +y
};
// Of the triangles in `lanes`.
CapLanes cap_triangles(const CappedShape& shape, float margin, unsigned lanes,
                       const TriangleBatch& batch, TriangleAxes& axes);

// -- A capsule against triangles: where its axis is over a face, or the point nearest to an edge, unless
// a neighbour answers for it.
struct CapsuleAxis {
  core::V3f tail, along;  // m, head - tail
  float radius = 0;       // m
};
// Of the triangles in `lanes`; none of the three candidates is filled where they are farther than the
// margin.
void touch_triangles(const CapsuleAxis& capsule, float margin, const ClipQuery& query,
                     unsigned lanes, const TriangleBatch& batch, TriangleClips& clips);

// The same source with float for lanes.
unsigned place_triangles_reference(const SurfaceFrame& surface, const core::V3f& middle, int count,
                                   TriangleBatch& batch);
unsigned search_triangles_reference(const TriangleSearch& search, int count,
                                    const TriangleBatch& batch, TriangleAxes& axes);
unsigned touch_triangles_reference(const core::V3f& center, float reach, int count,
                                   const TriangleBatch& batch, TriangleTouches& touches);
void touch_triangles_reference(const CapsuleAxis& capsule, float margin, const ClipQuery& query,
                               unsigned lanes, const TriangleBatch& batch, TriangleClips& clips);
CapLanes cap_triangles_reference(const CappedShape& shape, float margin, unsigned lanes,
                                 const TriangleBatch& batch, TriangleAxes& axes);
void clip_triangles_reference(const ClipFace& face, const ClipQuery& query, unsigned lanes,
                              const TriangleBatch& batch, const TriangleAxes& axes,
                              TriangleClips& clips);

}  // namespace skerry::collision
