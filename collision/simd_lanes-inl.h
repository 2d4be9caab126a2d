// A lane type over Highway's widest vectors of float, at most 16 of them. Included once per
// instruction set, inside its namespace, so no include guard. Has what float_lanes::Lane has.

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, 16>;

struct LaneMask {
  hn::Mask<Tag> m;
};
// No operator here is a friend: gcc forgets the instruction set of friends, and where it does not inline
// them (-O0) they pass vectors otherwise than their callers.
HWY_INLINE LaneMask operator&(LaneMask a, LaneMask b) { return {hn::And(a.m, b.m)}; }
HWY_INLINE LaneMask operator|(LaneMask a, LaneMask b) { return {hn::Or(a.m, b.m)}; }
HWY_INLINE LaneMask operator!(LaneMask a) { return {hn::Not(a.m)}; }

struct Lane {
  using Mask = LaneMask;
  static constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
  hn::Vec<Tag> v;

  Lane() = default;
  HWY_INLINE explicit Lane(float value) : v(hn::Set(Tag(), value)) {}
  HWY_INLINE explicit Lane(hn::Vec<Tag> value) : v(value) {}
  static HWY_INLINE Lane load(const float* from) { return Lane(hn::Load(Tag(), from)); }
  HWY_INLINE void store(float* to) const { hn::Store(v, Tag(), to); }
  static HWY_INLINE Lane counting(float first) { return Lane(hn::Iota(Tag(), first)); }
};
HWY_INLINE Lane operator+(Lane a, Lane b) { return Lane(hn::Add(a.v, b.v)); }
HWY_INLINE Lane operator-(Lane a, Lane b) { return Lane(hn::Sub(a.v, b.v)); }
HWY_INLINE Lane operator*(Lane a, Lane b) { return Lane(hn::Mul(a.v, b.v)); }
HWY_INLINE Lane operator/(Lane a, Lane b) { return Lane(hn::Div(a.v, b.v)); }
HWY_INLINE Lane operator-(Lane a) { return Lane(hn::Neg(a.v)); }
HWY_INLINE LaneMask operator<(Lane a, Lane b) { return {hn::Lt(a.v, b.v)}; }
HWY_INLINE LaneMask operator>(Lane a, Lane b) { return {hn::Gt(a.v, b.v)}; }
HWY_INLINE LaneMask operator==(Lane a, Lane b) { return {hn::Eq(a.v, b.v)}; }
HWY_INLINE Lane min(Lane a, Lane b) { return Lane(hn::Min(a.v, b.v)); }
HWY_INLINE Lane max(Lane a, Lane b) { return Lane(hn::Max(a.v, b.v)); }
HWY_INLINE Lane abs(Lane a) { return Lane(hn::Abs(a.v)); }
HWY_INLINE Lane square_root(Lane a) { return Lane(hn::Sqrt(a.v)); }
HWY_INLINE Lane select(LaneMask mask, Lane yes, Lane no) {
  return Lane(hn::IfThenElse(mask.m, yes.v, no.v));
}
HWY_INLINE bool all(LaneMask mask) { return hn::AllTrue(Tag(), mask.m); }
HWY_INLINE float lowest(Lane a) { return hn::GetLane(hn::MinOfLanes(Tag(), a.v)); }
HWY_INLINE float highest(Lane a) { return hn::GetLane(hn::MaxOfLanes(Tag(), a.v)); }
HWY_INLINE unsigned bits(LaneMask mask) {
  alignas(8) std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(Tag(), mask.m, bytes);
  return bytes[0] | static_cast<unsigned>(bytes[1]) << 8;
}
// Stores the chosen lanes one after the other and zeros behind them, kLanes floats in all, anywhere.
HWY_INLINE void pack(LaneMask mask, Lane a, float* to) {
  hn::StoreU(hn::Compress(hn::IfThenElseZero(mask.m, a.v), mask.m), Tag(), to);
}
