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
  core::V3f center;     // m, of a's frame in the pair's
  core::M3f axes;       // of a's frame
  core::M3f rotation;   // of the pair's frame in a's
  core::V3f offset;     // m, origin of the pair's frame in a's
  float margin = 0;     // m: beyond this separation shapes are apart
  float tolerance = 0;  // m: edges matter only where they reach the best face less this
  struct Edge {         // in the pair's frame, see PolytopeLanes::EdgeRow
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

// The same source with float for lanes.
unsigned place_triangles_reference(const SurfaceFrame& surface, const core::V3f& middle, int count,
                                   TriangleBatch& batch);
unsigned search_triangles_reference(const TriangleSearch& search, int count,
                                    const TriangleBatch& batch, TriangleAxes& axes);
unsigned touch_triangles_reference(const core::V3f& center, float reach, int count,
                                   const TriangleBatch& batch, TriangleTouches& touches);

// All three of one instruction set, by its Highway name; null members if this machine or build does
// not have it.
struct TriangleKernels {
  decltype(&place_triangles) place = nullptr;
  decltype(&search_triangles) search = nullptr;
  decltype(&touch_triangles) touch = nullptr;
};
TriangleKernels triangle_kernels_of(const char* target);

}  // namespace skerry::collision
