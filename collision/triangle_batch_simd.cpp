// The triangle kernels at the widths of this machine's instruction sets.

#include "collision/triangle_batch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/triangle_batch_simd.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::collision {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128

static unsigned place_here(const SurfaceFrame& surface, const core::V3f& middle, int count,
                           TriangleBatch& batch) {
  return place_triangles_reference(surface, middle, count, batch);
}
static unsigned search_here(const TriangleSearch& search, int count, const TriangleBatch& batch,
                            TriangleAxes& axes) {
  return search_triangles_reference(search, count, batch, axes);
}
static unsigned touch_here(const core::V3f& center, float reach, int count,
                           const TriangleBatch& batch, TriangleTouches& touches) {
  return touch_triangles_reference(center, reach, count, batch, touches);
}
static void touch_capsule_here(const CapsuleAxis& capsule, float margin, const ClipQuery& query,
                               unsigned lanes, const TriangleBatch& batch, TriangleClips& clips) {
  touch_triangles_reference(capsule, margin, query, lanes, batch, clips);
}
static CapLanes cap_here(const CappedShape& shape, float margin, unsigned lanes,
                         const TriangleBatch& batch, TriangleAxes& axes) {
  return cap_triangles_reference(shape, margin, lanes, batch, axes);
}
static void clip_here(const ClipFace& face, const ClipQuery& query, unsigned lanes,
                      const TriangleBatch& batch, const TriangleAxes& axes, TriangleClips& clips) {
  clip_triangles_reference(face, query, lanes, batch, axes, clips);
}

#else

#include "collision/simd_lanes-inl.h"

#define SKERRY_LANES HWY_ATTR
#include "collision/lane_vectors-inl.h"

#include "collision/axis_lanes-inl.h"
#include "collision/triangle_lanes-inl.h"

#include "collision/triangle_clip-inl.h"

#include "collision/triangle_capsule-inl.h"

#include "collision/triangle_cap-inl.h"
#undef SKERRY_LANES

static unsigned place_here(const SurfaceFrame& surface, const core::V3f& middle, int count,
                           TriangleBatch& batch) {
  return place_triangle_lanes<Lane>(surface, middle, count, batch);
}
static unsigned search_here(const TriangleSearch& search, int count, const TriangleBatch& batch,
                            TriangleAxes& axes) {
  return search_triangle_lanes<Lane>(search, count, batch, axes);
}
static unsigned touch_here(const core::V3f& center, float reach, int count,
                           const TriangleBatch& batch, TriangleTouches& touches) {
  return touch_triangle_lanes<Lane>(center, reach, count, batch, touches);
}
static void touch_capsule_here(const CapsuleAxis& capsule, float margin, const ClipQuery& query,
                               unsigned lanes, const TriangleBatch& batch, TriangleClips& clips) {
  touch_triangle_lanes<Lane>(capsule, margin, query, lanes, batch, clips);
}
static CapLanes cap_here(const CappedShape& shape, float margin, unsigned lanes,
                         const TriangleBatch& batch, TriangleAxes& axes) {
  return cap_triangle_lanes<Lane>(shape, margin, lanes, batch, axes);
}
static void clip_here(const ClipFace& face, const ClipQuery& query, unsigned lanes,
                      const TriangleBatch& batch, const TriangleAxes& axes, TriangleClips& clips) {
  clip_triangle_lanes<Lane>(face, query, lanes, batch, axes, clips);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::collision {

HWY_EXPORT(place_here);
HWY_EXPORT(search_here);
HWY_EXPORT(touch_here);
HWY_EXPORT(touch_capsule_here);
HWY_EXPORT(cap_here);
HWY_EXPORT(clip_here);

unsigned place_triangles(const SurfaceFrame& surface, const core::V3f& middle, int count,
                         TriangleBatch& batch) {
  return HWY_DYNAMIC_DISPATCH(place_here)(surface, middle, count, batch);
}
unsigned search_triangles(const TriangleSearch& search, int count, const TriangleBatch& batch,
                          TriangleAxes& axes) {
  return HWY_DYNAMIC_DISPATCH(search_here)(search, count, batch, axes);
}
unsigned touch_triangles(const core::V3f& center, float reach, int count,
                         const TriangleBatch& batch, TriangleTouches& touches) {
  return HWY_DYNAMIC_DISPATCH(touch_here)(center, reach, count, batch, touches);
}
void touch_triangles(const CapsuleAxis& capsule, float margin, const ClipQuery& query,
                     unsigned lanes, const TriangleBatch& batch, TriangleClips& clips) {
  HWY_DYNAMIC_DISPATCH(touch_capsule_here)(capsule, margin, query, lanes, batch, clips);
}
CapLanes cap_triangles(const CappedShape& shape, float margin, unsigned lanes,
                       const TriangleBatch& batch, TriangleAxes& axes) {
  return HWY_DYNAMIC_DISPATCH(cap_here)(shape, margin, lanes, batch, axes);
}
void clip_triangles(const ClipFace& face, const ClipQuery& query, unsigned lanes,
                    const TriangleBatch& batch, const TriangleAxes& axes, TriangleClips& clips) {
  HWY_DYNAMIC_DISPATCH(clip_here)(face, query, lanes, batch, axes, clips);
}

}  // namespace skerry::collision
#endif  // HWY_ONCE
