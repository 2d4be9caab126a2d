// The triangle kernels with float for lanes: the reference, and what runs without SIMD.
#include "collision/triangle_batch.h"

#include "collision/float_lanes.h"

namespace skerry::collision {
namespace float_lanes {

#define SKERRY_LANES
#include "collision/lane_vectors-inl.h"

#include "collision/axis_lanes-inl.h"
#include "collision/triangle_lanes-inl.h"

#include "collision/triangle_clip-inl.h"

#include "collision/triangle_capsule-inl.h"

#include "collision/triangle_cap-inl.h"
#undef SKERRY_LANES

}  // namespace float_lanes

void TriangleBatch::put(int lane, const SurfaceTriangle& triangle) {
  const auto put3 = [&](int row, const core::V3f& v) {
    rows[row][lane] = v.x;
    rows[row + 1][lane] = v.y;
    rows[row + 2][lane] = v.z;
  };
  put3(kNormal, triangle.normal);
  for (int i = 0; i < 3; ++i) {
    put3(kCorner + 3 * i, triangle.corner[i]);
    put3(kBeyond + 3 * i, triangle.beyond[i]);
    rows[kTouchable + i][lane] = static_cast<float>(triangle.touchable >> i & 1);
    rows[kBorder + i][lane] = static_cast<float>(triangle.border >> i & 1);
  }
}

unsigned place_triangles_reference(const SurfaceFrame& surface, const core::V3f& middle, int count,
                                   TriangleBatch& batch) {
  return float_lanes::place_triangle_lanes<float_lanes::Lane>(surface, middle, count, batch);
}
unsigned search_triangles_reference(const TriangleSearch& search, int count,
                                    const TriangleBatch& batch, TriangleAxes& axes) {
  return float_lanes::search_triangle_lanes<float_lanes::Lane>(search, count, batch, axes);
}
unsigned touch_triangles_reference(const core::V3f& center, float reach, int count,
                                   const TriangleBatch& batch, TriangleTouches& touches) {
  return float_lanes::touch_triangle_lanes<float_lanes::Lane>(center, reach, count, batch, touches);
}
void touch_triangles_reference(const CapsuleAxis& capsule, float margin, const ClipQuery& query,
                               unsigned lanes, const TriangleBatch& batch, TriangleClips& clips) {
  float_lanes::touch_triangle_lanes<float_lanes::Lane>(capsule, margin, query, lanes, batch, clips);
}
CapLanes cap_triangles_reference(const CappedShape& shape, float margin, unsigned lanes,
                                 const TriangleBatch& batch, TriangleAxes& axes) {
  return float_lanes::cap_triangle_lanes<float_lanes::Lane>(shape, margin, lanes, batch, axes);
}
void clip_triangles_reference(const ClipFace& face, const ClipQuery& query, unsigned lanes,
                              const TriangleBatch& batch, const TriangleAxes& axes,
                              TriangleClips& clips) {
  float_lanes::clip_triangle_lanes<float_lanes::Lane>(face, query, lanes, batch, axes, clips);
}

}  // namespace skerry::collision
