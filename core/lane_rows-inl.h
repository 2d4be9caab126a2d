// Rows of four floats or two doubles into SIMD lanes and back: loads of 128 bits and transposes, which
// beat hardware gathers. Included once per instruction set, inside its namespace, after Highway, so no
// include guard.

template <class T, int kLanes>
struct LaneRows {
  using D = hwy::HWY_NAMESPACE::CappedTag<T, kLanes>;
  using V = hwy::HWY_NAMESPACE::Vec<D>;
  static constexpr int kRow = 16 / sizeof(T);  // of T in 128 bits
  using D1 = hwy::HWY_NAMESPACE::CappedTag<T, kRow>;
  using D2 = hwy::HWY_NAMESPACE::CappedTag<T, (kLanes < 2 * kRow ? kLanes : 2 * kRow)>;

  // Lanes i * kRow, ... hold what is at p[i * kRow], ...
  static HWY_INLINE V load_blocks(const T* const* p) {
    namespace hn = hwy::HWY_NAMESPACE;
    const D1 d1;
    if constexpr (kLanes == kRow) {
      return hn::LoadU(d1, p[0]);
    } else {
      const D2 d2;
      const auto low = hn::Combine(d2, hn::LoadU(d1, p[kRow]), hn::LoadU(d1, p[0]));
      if constexpr (kLanes == 2 * kRow) {
        return low;
      } else {
        const auto high = hn::Combine(d2, hn::LoadU(d1, p[3 * kRow]), hn::LoadU(d1, p[2 * kRow]));
        return hn::Combine(D(), high, low);
      }
    }
  }
  static HWY_INLINE void store_blocks(const V& a, T* const* p) {
    namespace hn = hwy::HWY_NAMESPACE;
    const D1 d1;
    if constexpr (kLanes == kRow) {
      hn::StoreU(a, d1, p[0]);
    } else {
      const D2 d2;
      const auto store_two = [d1](const auto& v, T* first, T* second) HWY_ATTR {
        hn::StoreU(hn::LowerHalf(d1, v), d1, first);
        hn::StoreU(hn::UpperHalf(d1, v), d1, second);
      };
      if constexpr (kLanes == 2 * kRow) {
        store_two(a, p[0], p[kRow]);
      } else {
        store_two(hn::LowerHalf(d2, a), p[0], p[kRow]);
        store_two(hn::UpperHalf(d2, a), p[2 * kRow], p[3 * kRow]);
      }
    }
  }
  // Transposes each 4x4 (floats) of the 128-bit blocks of four vectors.
  static HWY_INLINE void transpose(V& r0, V& r1, V& r2, V& r3) {
    namespace hn = hwy::HWY_NAMESPACE;
    const D d;
    const hn::RepartitionToWide<D> wide;
    const auto t0 = hn::BitCast(wide, hn::InterleaveLower(d, r0, r1));
    const auto t1 = hn::BitCast(wide, hn::InterleaveLower(d, r2, r3));
    const auto t2 = hn::BitCast(wide, hn::InterleaveUpper(d, r0, r1));
    const auto t3 = hn::BitCast(wide, hn::InterleaveUpper(d, r2, r3));
    r0 = hn::BitCast(d, hn::InterleaveLower(wide, t0, t1));
    r1 = hn::BitCast(d, hn::InterleaveUpper(wide, t0, t1));
    r2 = hn::BitCast(d, hn::InterleaveLower(wide, t2, t3));
    r3 = hn::BitCast(d, hn::InterleaveUpper(wide, t2, t3));
  }

  // Lane i of out[k]: the k-th of the row at p[i].
  static HWY_INLINE void gather(const T* const* p, V* out) {
    namespace hn = hwy::HWY_NAMESPACE;
    if constexpr (kRow == 4) {
      for (int i = 0; i < 4; ++i) out[i] = load_blocks(p + i);
      transpose(out[0], out[1], out[2], out[3]);
    } else {
      const V even = load_blocks(p), odd = load_blocks(p + 1);
      out[0] = hn::InterleaveLower(D(), even, odd);
      out[1] = hn::InterleaveUpper(D(), even, odd);
    }
  }
  static HWY_INLINE void scatter(const V* in, T* const* p) {
    static_assert(kRow == 4);
    V r[4] = {in[0], in[1], in[2], in[3]};
    transpose(r[0], r[1], r[2], r[3]);
    for (int i = 0; i < 4; ++i) store_blocks(r[i], p + i);
  }
};
