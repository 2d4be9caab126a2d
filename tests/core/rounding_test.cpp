#include "core/rounding.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/vec.h"

namespace skerry::core {
namespace {

// Two neighbours at a time, the shape that compilers turn into vector operations.
[[gnu::noinline]] void round_pairs(const double* from, double* to, std::size_t pairs) {
  for (std::size_t i = 0; i < pairs; ++i) {
    const float a = rounded_to_float(from[2 * i]), b = rounded_to_float(from[2 * i + 1]);
    to[2 * i] = double(a);
    to[2 * i + 1] = double(b);
  }
}
[[gnu::noinline]] void round_vectors(const Vec3* from, Vec3* to, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] = to_double(to_float(from[i]));
}

double through_memory(double value) {
  const volatile float stored = static_cast<float>(value);
  return double(stored);
}

TEST(Rounding, to_float_and_back_is_never_dropped) {
  constexpr std::size_t kCount = 30;
  std::vector<double> given(kCount), pairs(kCount);
  std::vector<Vec3> vectors(kCount / 3), rounded(kCount / 3);
  for (std::size_t i = 0; i < kCount; ++i) {
    given[i] = static_cast<double>(i + 1) / 3e7;
    vectors[i / 3][static_cast<int>(i % 3)] = given[i];
  }
  round_pairs(given.data(), pairs.data(), kCount / 2);
  round_vectors(vectors.data(), rounded.data(), vectors.size());
  for (std::size_t i = 0; i < kCount; ++i) {
    const double expected = through_memory(given[i]);
    ASSERT_NE(expected, given[i]);
    EXPECT_EQ(pairs[i], expected) << i;
    EXPECT_EQ(rounded[i / 3][static_cast<int>(i % 3)], expected) << i;
  }
}

}  // namespace
}  // namespace skerry::core
