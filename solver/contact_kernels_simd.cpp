// The contact kernels over Highway lanes, compiled once per instruction set and chosen at run time.
#include "solver/contact_blocks.h"

// AVX-512 of Ice Lake adds nothing here; SSSE3-only machines run the reference.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solver/contact_kernels_simd.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::solver {
namespace HWY_NAMESPACE {
const ContactKernels* kernels();
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
const ContactKernels* kernels() { return reference_kernels(1); }
#else
namespace hn = hwy::HWY_NAMESPACE;

#include "core/lane_rows-inl.h"

#define SKERRY_LANE static inline __attribute__((always_inline))

template <int kLanes>
struct HighwayLanes {
  static constexpr int kWidth = kLanes;
  using D = hn::CappedTag<float, kLanes>;
  using F = hn::Vec<D>;
  using M = hn::Mask<D>;

  SKERRY_LANE F set(float x) { return hn::Set(D(), x); }
  SKERRY_LANE F load(const float* p) { return hn::Load(D(), p); }
  SKERRY_LANE void store(const F& a, float* p) { hn::Store(a, D(), p); }
  SKERRY_LANE F min(const F& a, const F& b) { return hn::Min(a, b); }
  SKERRY_LANE F max(const F& a, const F& b) { return hn::Max(a, b); }
  SKERRY_LANE F sqrt(const F& a) { return hn::Sqrt(a); }
  SKERRY_LANE M less(const F& a, const F& b) { return hn::Lt(a, b); }
  SKERRY_LANE M equal(const F& a, const F& b) { return hn::Eq(a, b); }
  SKERRY_LANE F select(const M& m, const F& yes, const F& no) { return hn::IfThenElse(m, yes, no); }
  SKERRY_LANE M either(const M& a, const M& b) { return hn::Or(a, b); }
  SKERRY_LANE M both(const M& a, const M& b) { return hn::And(a, b); }
  SKERRY_LANE bool any(const M& m) { return !hn::AllFalse(D(), m); }

  SKERRY_LANE F integers(const F& bits) {
    return hn::ConvertTo(D(), hn::BitCast(hn::RebindToSigned<D>(), bits));
  }

  using Rows = LaneRows<float, kLanes>;
  SKERRY_LANE void gather(const float* const* p, F* out) { Rows::gather(p, out); }
  SKERRY_LANE void gather(const float* base, std::uint32_t stride, const std::uint32_t* index,
                          F* out) {
    const float* p[kLanes];
    for (int i = 0; i < kLanes; ++i) p[i] = base + std::size_t{index[i]} * stride;
    gather(p, out);
  }
  SKERRY_LANE void scatter(const F* in, float* const* p) { Rows::scatter(in, p); }
};

#include "solver/contact_kernels.inl"
#undef SKERRY_LANE

const ContactKernels* kernels() {
#if HWY_TARGET == HWY_AVX3
  static const ContactKernels table = KernelsOf<HighwayLanes<16>>::make("AVX-512");
#elif HWY_TARGET == HWY_AVX2
  static const ContactKernels table = KernelsOf<HighwayLanes<8>>::make("AVX2");
#else
  static const ContactKernels table = KernelsOf<HighwayLanes<4>>::make("SSE4");
#endif
  return &table;
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::solver
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::solver {
HWY_EXPORT(kernels);

const ContactKernels* best_kernels() {
  static const ContactKernels* const best = HWY_DYNAMIC_DISPATCH(kernels)();
  return best;
}

const ContactKernels* const* simd_kernels() {
  static const ContactKernels* list[8] = {};
  if (list[0] == nullptr) {
    int count = 0;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().Update(hwy::SupportedTargets());
      list[count++] = HWY_DYNAMIC_DISPATCH(kernels)();
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
  return list;
}
}  // namespace skerry::solver
#endif
