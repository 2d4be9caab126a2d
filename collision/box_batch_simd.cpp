// The box kernel at the widths of this machine's instruction sets.
#include <cstring>

#include "collision/box_batch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/box_batch_simd.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::collision {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128

static void collide_boxes_here(BoxBatch& batch, int count) {
  collide_boxes_reference(batch, count);
}

#else

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, BoxBatch::kSize>;

struct LaneMask {
  hn::Mask<Tag> m;
  friend HWY_INLINE LaneMask operator&(LaneMask a, LaneMask b) { return {hn::And(a.m, b.m)}; }
  friend HWY_INLINE LaneMask operator|(LaneMask a, LaneMask b) { return {hn::Or(a.m, b.m)}; }
  friend HWY_INLINE LaneMask operator!(LaneMask a) { return {hn::Not(a.m)}; }
};

struct Lane {
  using Mask = LaneMask;
  static constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
  hn::Vec<Tag> v;

  Lane() = default;
  HWY_INLINE explicit Lane(float value) : v(hn::Set(Tag(), value)) {}
  HWY_INLINE explicit Lane(hn::Vec<Tag> value) : v(value) {}
  static HWY_INLINE Lane load(const float* from) { return Lane(hn::Load(Tag(), from)); }
  HWY_INLINE void store(float* to) const { hn::Store(v, Tag(), to); }

  friend HWY_INLINE Lane operator+(Lane a, Lane b) { return Lane(hn::Add(a.v, b.v)); }
  friend HWY_INLINE Lane operator-(Lane a, Lane b) { return Lane(hn::Sub(a.v, b.v)); }
  friend HWY_INLINE Lane operator*(Lane a, Lane b) { return Lane(hn::Mul(a.v, b.v)); }
  friend HWY_INLINE Lane operator/(Lane a, Lane b) { return Lane(hn::Div(a.v, b.v)); }
  friend HWY_INLINE Lane operator-(Lane a) { return Lane(hn::Neg(a.v)); }
  friend HWY_INLINE LaneMask operator<(Lane a, Lane b) { return {hn::Lt(a.v, b.v)}; }
  friend HWY_INLINE LaneMask operator>(Lane a, Lane b) { return {hn::Gt(a.v, b.v)}; }
  friend HWY_INLINE LaneMask operator==(Lane a, Lane b) { return {hn::Eq(a.v, b.v)}; }
};
HWY_INLINE Lane min(Lane a, Lane b) { return Lane(hn::Min(a.v, b.v)); }
HWY_INLINE Lane max(Lane a, Lane b) { return Lane(hn::Max(a.v, b.v)); }
HWY_INLINE Lane abs(Lane a) { return Lane(hn::Abs(a.v)); }
HWY_INLINE Lane square_root(Lane a) { return Lane(hn::Sqrt(a.v)); }
HWY_INLINE Lane select(LaneMask mask, Lane yes, Lane no) {
  return Lane(hn::IfThenElse(mask.m, yes.v, no.v));
}
HWY_INLINE bool all(LaneMask mask) { return hn::AllTrue(Tag(), mask.m); }

#define SKERRY_LANES HWY_ATTR
#include "collision/box_lanes-inl.h"
#undef SKERRY_LANES

static void collide_boxes_here(BoxBatch& batch, int count) {
  collide_box_batch<Lane>(batch, count);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::collision {

HWY_EXPORT(collide_boxes_here);

void collide_boxes(BoxBatch& batch, int count) {
  HWY_DYNAMIC_DISPATCH(collide_boxes_here)(batch, count);
}

bool collide_boxes_on(const char* target, BoxBatch& batch, int count) {
  const auto is = [target](std::int64_t bit) {
    return std::strcmp(hwy::TargetName(bit), target) == 0 && (hwy::SupportedTargets() & bit) != 0;
  };
#if HWY_TARGETS & HWY_SSSE3
  if (is(HWY_SSSE3)) return N_SSSE3::collide_boxes_here(batch, count), true;
#endif
#if HWY_TARGETS & HWY_SSE4
  if (is(HWY_SSE4)) return N_SSE4::collide_boxes_here(batch, count), true;
#endif
#if HWY_TARGETS & HWY_AVX2
  if (is(HWY_AVX2)) return N_AVX2::collide_boxes_here(batch, count), true;
#endif
#if HWY_TARGETS & HWY_AVX3
  if (is(HWY_AVX3)) return N_AVX3::collide_boxes_here(batch, count), true;
#endif
  return false;
}

}  // namespace skerry::collision
#endif  // HWY_ONCE
