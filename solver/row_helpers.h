// Small things that several files need where rows of bodies and contacts are filled and read.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/rounding.h"
#include "core/vec.h"

namespace skerry::solver {

// Contacts and bodies ahead of the present one whose rows are asked for.
inline constexpr std::uint32_t kPrefetch = 8;

// All lines of a row that will be read soon.
template <class T>
void prefetch(const T& row) {
  const auto* bytes = reinterpret_cast<const char*>(&row);
  for (std::size_t i = 0; i < sizeof(T); i += 64) __builtin_prefetch(bytes + i);
}

// Inlined: what is returned through memory is read back in other pieces, and waited for.
[[gnu::always_inline]] inline core::Sym3f rounded(const Mat3& m) {
  return {core::rounded_to_float(m(0, 0)), core::rounded_to_float(m(0, 1)),
          core::rounded_to_float(m(0, 2)), core::rounded_to_float(m(1, 1)),
          core::rounded_to_float(m(1, 2)), core::rounded_to_float(m(2, 2))};
}

// Clears the components along locked axes; `first_lock` is kLockX or kLockRx.
inline Vec3 unlocked(Vec3 v, std::uint32_t flags, std::uint32_t first_lock) {
  for (int k = 0; k < 3; ++k) {
    if (flags & (first_lock << k)) v[k] = 0;
  }
  return v;
}

}  // namespace skerry::solver
