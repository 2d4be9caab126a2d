// Lanes without SIMD: W floats and loops. The reference of every SIMD width.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace skerry::solver {

template <int W>
struct ReferenceLanes {
  static constexpr int kWidth = W;
  struct M {
    bool v[W];
  };
  struct F {
    float v[W];
#define SKERRY_LANE_OPERATOR(op)                           \
  friend F operator op(const F& a, const F& b) {           \
    F r;                                                   \
    for (int i = 0; i < W; ++i) r.v[i] = a.v[i] op b.v[i]; \
    return r;                                              \
  }
    SKERRY_LANE_OPERATOR(+)
    SKERRY_LANE_OPERATOR(-)
    SKERRY_LANE_OPERATOR(*)
    SKERRY_LANE_OPERATOR(/)
#undef SKERRY_LANE_OPERATOR
  };

  static F set(float x) {
    F r;
    for (int i = 0; i < W; ++i) r.v[i] = x;
    return r;
  }
  static F load(const float* p) {
    F r;
    std::memcpy(r.v, p, sizeof r.v);
    return r;
  }
  static void store(const F& a, float* p) { std::memcpy(p, a.v, sizeof a.v); }

  // As the x86 instructions: the second operand if equal or unordered.
  static F min(const F& a, const F& b) {
    F r;
    for (int i = 0; i < W; ++i) r.v[i] = a.v[i] < b.v[i] ? a.v[i] : b.v[i];
    return r;
  }
  static F max(const F& a, const F& b) {
    F r;
    for (int i = 0; i < W; ++i) r.v[i] = a.v[i] > b.v[i] ? a.v[i] : b.v[i];
    return r;
  }
  static F sqrt(const F& a) {
    F r;
    for (int i = 0; i < W; ++i) r.v[i] = std::sqrt(a.v[i]);
    return r;
  }
  static M less(const F& a, const F& b) {
    M r;
    for (int i = 0; i < W; ++i) r.v[i] = a.v[i] < b.v[i];
    return r;
  }
  static M equal(const F& a, const F& b) {
    M r;
    for (int i = 0; i < W; ++i) r.v[i] = a.v[i] == b.v[i];
    return r;
  }
  static F select(const M& m, const F& yes, const F& no) {
    F r;
    for (int i = 0; i < W; ++i) r.v[i] = m.v[i] ? yes.v[i] : no.v[i];
    return r;
  }
  static M either(const M& a, const M& b) {
    M r;
    for (int i = 0; i < W; ++i) r.v[i] = a.v[i] || b.v[i];
    return r;
  }
  static M both(const M& a, const M& b) {
    M r;
    for (int i = 0; i < W; ++i) r.v[i] = a.v[i] && b.v[i];
    return r;
  }
  static bool any(const M& m) {
    for (int i = 0; i < W; ++i) {
      if (m.v[i]) return true;
    }
    return false;
  }

  // The values of unsigned integers, below 2^31, that lie in the lanes as bits.
  static F integers(const F& bits) {
    F r;
    for (int i = 0; i < W; ++i) {
      std::uint32_t value;
      std::memcpy(&value, &bits.v[i], sizeof value);
      r.v[i] = static_cast<float>(value);
    }
    return r;
  }

  // Four consecutive floats at each of W addresses, one lane per address.
  static void gather(const float* const* p, F* out) {
    for (int i = 0; i < W; ++i) {
      float row[4];
      std::memcpy(row, p[i], sizeof row);
      for (int k = 0; k < 4; ++k) out[k].v[i] = row[k];
    }
  }
  static void gather(const float* base, std::uint32_t stride, const std::uint32_t* index, F* out) {
    const float* p[W];
    for (int i = 0; i < W; ++i) p[i] = base + std::size_t{index[i]} * stride;
    gather(p, out);
  }
  static void scatter(const F* in, float* const* p) {
    for (int i = 0; i < W; ++i) {
      float row[4];
      for (int k = 0; k < 4; ++k) row[k] = in[k].v[i];
      std::memcpy(p[i], row, sizeof row);
    }
  }
};

}  // namespace skerry::solver
