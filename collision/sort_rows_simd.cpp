// Sorting by counting, at the widths of this machine's instruction sets.
#include <algorithm>

#include "collision/sort_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/sort_rows_simd.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace skerry::collision {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128

static void sort_here(std::span<std::uint32_t> rows) { std::sort(rows.begin(), rows.end()); }

#else

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<std::int32_t, 16>;

// Counting costs the square of the length.
constexpr std::size_t kMost = 192;

static void sort_here(std::span<std::uint32_t> rows) {
  const std::size_t count = rows.size();
  if (count > kMost) return std::sort(rows.begin(), rows.end());
  const Tag tag;
  const std::size_t lanes = hn::Lanes(tag);
  alignas(64) std::int32_t keys[kMost], ranks[kMost];
  std::copy(rows.begin(), rows.end(), keys);
  std::fill(keys + count, keys + (count + lanes - 1) / lanes * lanes, 0);
  for (std::size_t i = 0; i < count; i += lanes) {
    const auto key = hn::Load(tag, keys + i);
    auto rank = hn::Zero(tag);
    for (std::size_t j = 0; j < count; ++j)
      rank = hn::Sub(rank, hn::VecFromMask(tag, hn::Gt(key, hn::Set(tag, keys[j]))));
    hn::Store(rank, tag, ranks + i);
  }
  for (std::size_t i = 0; i < count; ++i)
    rows[static_cast<std::size_t>(ranks[i])] = static_cast<std::uint32_t>(keys[i]);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace skerry::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace skerry::collision {

HWY_EXPORT(sort_here);

void sort_rows(std::span<std::uint32_t> rows) { HWY_DYNAMIC_DISPATCH(sort_here)(rows); }

}  // namespace skerry::collision
#endif  // HWY_ONCE
