#include "collision/box_rows.h"

#include <cstddef>

#include "collision/narrowphase_pairs.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/box_rows_simd.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::collision {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128

static bool place_boxes_here(const BoxRows&, float, BoxBatch&) { return false; }
static std::uint32_t store_boxes_here(const BoxBatch&, std::uint32_t,
                                      float* const (&)[BoxBatch::kSize]) {
  return 0;
}

#else

namespace hn = hwy::HWY_NAMESPACE;
#include "core/lane_rows-inl.h"

using Double = hn::CappedTag<double, 8>;
constexpr int kDoubles = static_cast<int>(hn::MaxLanes(Double()));
using Half = hn::Rebind<float, Double>;  // as many floats
using H = hn::Vec<Half>;
using DoubleRows = LaneRows<double, kDoubles>;

struct H3 {
  H x, y, z;
};
static HWY_INLINE H3 operator-(const H3& a, const H3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
static HWY_INLINE H3 cross(const H3& a, const H3& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}
static HWY_INLINE H length(const H3& a) {
  return hn::Sqrt(hn::Add(hn::Add(hn::Mul(a.x, a.x), hn::Mul(a.y, a.y)), hn::Mul(a.z, a.z)));
}
// The 1-norm.
static HWY_INLINE H rate(const H3& w) {
  return hn::Add(hn::Add(hn::Abs(w.x), hn::Abs(w.y)), hn::Abs(w.z));
}
static HWY_INLINE H rounded(hn::Vec<Double> a) { return hn::DemoteTo(Half(), a); }
static HWY_INLINE H3 rounded(const hn::Vec<Double>* a) {
  return {rounded(a[0]), rounded(a[1]), rounded(a[2])};
}
static HWY_INLINE H3 rounded_difference(const hn::Vec<Double>* a, const hn::Vec<Double>* b) {
  return {rounded(hn::Sub(a[0], b[0])), rounded(hn::Sub(a[1], b[1])), rounded(hn::Sub(a[2], b[2]))};
}

// The first `kCount` doubles of each row.
template <int kCount>
static HWY_INLINE void gather(const double* const* rows, hn::Vec<Double>* out) {
  const double* at[kDoubles];
  for (int k = 0; k < kCount; k += 2) {
    const int first = k + 1 < kCount ? k : k - 1;  // what lies behind the row is not read
    for (int i = 0; i < kDoubles; ++i) at[i] = rows[i] + first;
    DoubleRows::gather(at, out + first);
  }
}

static HWY_INLINE void put(BoxBatch& batch, int row, int lane, H value) {
  hn::Store(value, Half(), batch.in[row] + lane);
}
static HWY_INLINE void put(BoxBatch& batch, int row, int lane, const H3& value) {
  put(batch, row, lane, value.x);
  put(batch, row + 1, lane, value.y);
  put(batch, row + 2, lane, value.z);
}
static HWY_INLINE void put_rotation(BoxBatch& batch, int row, int lane, const hn::Vec<Double>* q) {
  put(batch, row, lane, rounded(q));
  put(batch, row + 3, lane, rounded(q[3]));
}

static HWY_INLINE void place_some(const BoxRows& rows, int lane, float dt, BoxBatch& batch) {
  hn::Vec<Double> pose_a[7], pose_b[7], motion_a[6], motion_b[6];
  gather<7>(rows.pose_a + lane, pose_a);
  gather<7>(rows.pose_b + lane, pose_b);
  gather<6>(rows.motion_a + lane, motion_a);
  gather<6>(rows.motion_b + lane, motion_b);
  const H3 between = rounded_difference(pose_b, pose_a);
  const H3 velocity = rounded_difference(motion_b, motion_a);
  const H3 turning_a = rounded(motion_a + 3), turning_b = rounded(motion_b + 3);
  const Half h;
  const H spins = hn::Add(hn::Mul(rate(turning_a), hn::Load(h, rows.turn_radius_a + lane)),
                          hn::Mul(rate(turning_b), hn::Load(h, rows.turn_radius_b + lane)));
  const H closing = hn::Add(length(velocity), spins);
  const H slop = hn::Set(h, kSpeculativeDistance), time = hn::Set(h, dt);
  put(batch, BoxBatch::kDx, lane, between);
  put_rotation(batch, BoxBatch::kQax, lane, pose_a + 3);
  put_rotation(batch, BoxBatch::kQbx, lane, pose_b + 3);
  put(batch, BoxBatch::kVx, lane, velocity - cross(turning_b, between));
  put(batch, BoxBatch::kWx, lane, rounded_difference(motion_b + 3, motion_a + 3));
  put(batch, BoxBatch::kDt, lane, time);
  put(batch, BoxBatch::kSlop, lane, slop);
  put(batch, BoxBatch::kMargin, lane, hn::Add(slop, hn::Mul(time, closing)));
}

using Float = hn::CappedTag<float, 16>;
constexpr int kFloats = static_cast<int>(hn::MaxLanes(Float()));
using F = hn::Vec<Float>;
using FloatRows = LaneRows<float, kFloats>;

static HWY_INLINE void place_sizes(const float* const* rows, int first_row, BoxBatch& batch) {
  for (int lane = 0; lane < BoxBatch::kSize; lane += kFloats) {
    F size[4];
    FloatRows::gather(rows + lane, size);
    for (int k = 0; k < 3; ++k) hn::Store(size[k], Float(), batch.in[first_row + k] + lane);
  }
}

static bool place_boxes_here(const BoxRows& rows, float dt, BoxBatch& batch) {
  for (int lane = 0; lane < BoxBatch::kSize; lane += kDoubles) place_some(rows, lane, dt, batch);
  place_sizes(rows.size_a, BoxBatch::kHax, batch);
  place_sizes(rows.size_b, BoxBatch::kHbx, batch);
  return true;
}

// Rows of core::Manifold.
constexpr int kPointRow = offsetof(core::Manifold, points) / sizeof(float);
constexpr int kFeatureRow = offsetof(core::Manifold, feature) / sizeof(float);
constexpr int kApproach = offsetof(core::Manifold, approach_speed) / sizeof(float);
constexpr int kTotalImpulse = offsetof(core::Manifold, total_impulse) / sizeof(float);

static HWY_INLINE void gather_row(float* const* manifold, int row, F* out) {
  const float* at[kFloats];
  for (int i = 0; i < kFloats; ++i) at[i] = manifold[i] + row;
  FloatRows::gather(at, out);
}
static HWY_INLINE void scatter_row(const F* in, float* const* manifold, int row) {
  float* at[kFloats];
  for (int i = 0; i < kFloats; ++i) at[i] = manifold[i] + row;
  FloatRows::scatter(in, at);
}

static HWY_INLINE std::uint32_t store_some(const BoxBatch& batch, int lane, std::uint32_t lanes,
                                           float* const* manifold) {
  const std::uint32_t here = (kFloats == 16 ? 0xffffu : (1u << kFloats) - 1) << lane;
  if ((lanes & here) == 0) return 0;
  const Float f;
  const hn::RebindToSigned<Float> integer;
  const auto out = [&](int row) HWY_ATTR { return hn::Load(f, batch.out[row] + lane); };
  const auto in = [&](int row) HWY_ATTR { return hn::Load(f, batch.in[row] + lane); };
  const F n[4] = {out(BoxBatch::kNx), out(BoxBatch::kNy), out(BoxBatch::kNz),
                  hn::BitCast(f, hn::Set(integer, 4))};
  alignas(64) float sink[sizeof(core::Manifold) / sizeof(float)] = {};
  float* to[kFloats];
  for (int i = 0; i < kFloats; ++i) to[i] = lanes >> (lane + i) & 1 ? manifold[i] : sink;
  F old[4];
  gather_row(to, 0, old);
  const F cosine =
      hn::Add(hn::Add(hn::Mul(old[0], n[0]), hn::Mul(old[1], n[1])), hn::Mul(old[2], n[2]));
  auto same = hn::Lt(hn::Set(f, kSameNormal), cosine);
  same = hn::And(
      same, hn::RebindMask(f, hn::Eq(hn::BitCast(integer, old[3]), hn::BitCast(integer, n[3]))));
  gather_row(to, kFeatureRow, old);
  for (int k = 0; k < 4; ++k) {
    const F feature = out(BoxBatch::kPoints + k * BoxBatch::kPointRows + BoxBatch::kFeature);
    same = hn::And(same, hn::RebindMask(f, hn::Eq(hn::ConvertTo(integer, feature),
                                                  hn::BitCast(integer, old[k]))));
  }
  alignas(8) std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(f, same, bytes);
  const std::uint32_t done = ((bytes[0] | std::uint32_t{bytes[1]} << 8) << lane) & lanes & here;
  if (done == 0) return 0;

  for (int i = 0; i < kFloats; ++i) {
    if (!(done >> (lane + i) & 1)) to[i] = sink;
  }
  scatter_row(n, to, 0);
  const F wx = in(BoxBatch::kWx), wy = in(BoxBatch::kWy), wz = in(BoxBatch::kWz);
  const F vx = in(BoxBatch::kVx), vy = in(BoxBatch::kVy), vz = in(BoxBatch::kVz);
  const F speed = hn::Add(hn::Add(hn::Mul(n[0], vx), hn::Mul(n[1], vy)), hn::Mul(n[2], vz));
  const F gx = hn::Sub(hn::Mul(n[1], wz), hn::Mul(n[2], wy));
  const F gy = hn::Sub(hn::Mul(n[2], wx), hn::Mul(n[0], wz));
  const F gz = hn::Sub(hn::Mul(n[0], wy), hn::Mul(n[1], wx));
  F approach = hn::Zero(f);
  for (int k = 0; k < 4; ++k) {
    const int row = BoxBatch::kPoints + k * BoxBatch::kPointRows;
    const F point[4] = {out(row + BoxBatch::kPx), out(row + BoxBatch::kPy),
                        out(row + BoxBatch::kPz), out(row + BoxBatch::kSeparation)};
    scatter_row(point, to, kPointRow + 4 * k);
    const F turns =
        hn::Add(hn::Add(hn::Mul(gx, point[0]), hn::Mul(gy, point[1])), hn::Mul(gz, point[2]));
    approach = hn::Max(approach, hn::Neg(hn::Add(speed, turns)));
  }
  alignas(64) float approaches[kFloats];
  hn::Store(approach, f, approaches);
  for (int i = 0; i < kFloats; ++i) {
    to[i][kApproach] = approaches[i];
    to[i][kTotalImpulse] = 0;
  }
  return done;
}

static std::uint32_t store_boxes_here(const BoxBatch& batch, std::uint32_t lanes,
                                      float* const (&manifold)[BoxBatch::kSize]) {
  std::uint32_t done = 0;
  for (int lane = 0; lane < BoxBatch::kSize; lane += kFloats)
    done |= store_some(batch, lane, lanes, manifold + lane);
  return done;
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::collision {

HWY_EXPORT(place_boxes_here);
HWY_EXPORT(store_boxes_here);

bool place_boxes(const BoxRows& rows, float dt, BoxBatch& batch) {
  return HWY_DYNAMIC_DISPATCH(place_boxes_here)(rows, dt, batch);
}
std::uint32_t store_boxes(const BoxBatch& batch, std::uint32_t lanes,
                          float* const (&manifold)[BoxBatch::kSize]) {
  return HWY_DYNAMIC_DISPATCH(store_boxes_here)(batch, lanes, manifold);
}

}  // namespace skerry::collision
#endif  // HWY_ONCE
