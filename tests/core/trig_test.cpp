// Our sine, cosine, arc tangent and arc cosine against libm in long double.
#include "core/trig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace skerry::core {
namespace {

template <class Real>
long double wide(Real x) {
  return static_cast<long double>(x);
}

// Distance from the truth in units in the last place of the truth, rounded to double.
double ulps(double ours, long double truth) {
  const double rounded = std::fabs(static_cast<double>(truth));
  const double unit = std::nextafter(rounded, 1e300) - rounded;
  return static_cast<double>(std::fabs(wide(ours) - truth) / wide(unit));
}

struct Worst {
  double sin = 0, cos = 0, atan2 = 0, acos = 0;
};

Worst worst_over(double bound, int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> angle(-bound, bound), unit(-1, 1);
  Worst worst;
  for (int i = 0; i < count; ++i) {
    const double x = angle(random), u = unit(random), v = unit(random);
    const trig::SinCos<double> sc = trig::sin_cos(x);
    worst.sin = std::max(worst.sin, ulps(sc.sin, sinl(wide(x))));
    worst.cos = std::max(worst.cos, ulps(sc.cos, cosl(wide(x))));
    worst.atan2 = std::max(worst.atan2, ulps(trig::atan2(u, v), atan2l(wide(u), wide(v))));
    worst.acos = std::max(worst.acos, ulps(trig::acos(u), acosl(wide(u))));
  }
  return worst;
}

TEST(Trig, doubles_are_within_a_few_ulp) {
  for (const double bound : {1e-3, 0.8, 4.0, 100.0, 5e5}) {
    const Worst worst = worst_over(bound, 200000, 1);
    std::printf("  |x| < %g: sin %.2f, cos %.2f, atan2 %.2f, acos %.2f ulp\n", bound, worst.sin,
                worst.cos, worst.atan2, worst.acos);
    EXPECT_LT(worst.sin, 0.85) << bound;
    EXPECT_LT(worst.cos, 0.85) << bound;
    EXPECT_LT(worst.atan2, 1.8) << bound;
    EXPECT_LT(worst.acos, 2.4) << bound;
  }
}

TEST(Trig, sine_near_its_zeros_keeps_relative_accuracy) {
  for (int n = 1; n < 100000; n += 7) {
    const double x = n * 3.14159265358979323846;
    EXPECT_LT(ulps(trig::sin(x), sinl(wide(x))), 2) << n;
  }
}

TEST(Trig, small_arguments_of_arc_functions_keep_relative_accuracy) {
  for (double x = 1e-300; x < 1; x *= 3) {
    EXPECT_LT(ulps(trig::atan2(x, 1.0), atan2l(wide(x), 1.0L)), 2) << x;
    EXPECT_LT(ulps(trig::atan2(x, 3.0), atan2l(wide(x), 3.0L)), 2) << x;
    const double near_one = 1 - x;
    EXPECT_LT(ulps(trig::acos(near_one), acosl(wide(near_one))), 3) << x;
  }
}

TEST(Trig, floats_are_correctly_rounded_but_for_ties) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<float> angle(-50, 50), unit(-1, 1);
  for (int i = 0; i < 300000; ++i) {
    const float x = angle(random), u = unit(random), v = unit(random);
    EXPECT_FLOAT_EQ(trig::sin(x), static_cast<float>(sinl(wide(x))));
    EXPECT_FLOAT_EQ(trig::cos(x), static_cast<float>(cosl(wide(x))));
    EXPECT_FLOAT_EQ(trig::atan2(u, v), static_cast<float>(atan2l(wide(u), wide(v))));
    EXPECT_FLOAT_EQ(trig::acos(u), static_cast<float>(acosl(wide(u))));
  }
}

TEST(Trig, arc_tangent_knows_its_quadrants_and_edges) {
  constexpr double pi = 3.14159265358979323846;
  constexpr double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(trig::atan2(0.0, 1.0), 0);
  EXPECT_EQ(trig::atan2(0.0, -1.0), pi);
  EXPECT_EQ(trig::atan2(-0.0, -1.0), -pi);
  EXPECT_EQ(trig::atan2(1.0, 0.0), pi / 2);
  EXPECT_EQ(trig::atan2(-1.0, 0.0), -pi / 2);
  EXPECT_EQ(trig::atan2(0.0, 0.0), 0);
  EXPECT_EQ(trig::atan2(inf, 1.0), pi / 2);
  EXPECT_EQ(trig::atan2(1.0, inf), 0);
  EXPECT_EQ(trig::atan2(1.0, -inf), pi);
  EXPECT_DOUBLE_EQ(trig::atan2(inf, -inf), 3 * pi / 4);
  EXPECT_TRUE(std::isnan(trig::atan2(std::nan(""), 1.0)));
  EXPECT_TRUE(std::isnan(trig::atan2(1.0, std::nan(""))));
}

TEST(Trig, logarithm_is_exact_to_a_few_units) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 200000; ++i) {
    const double part = static_cast<double>(random() >> 11) * 0x1p-53;
    for (const double x :
         {1 + part, 1 - part / 2, std::ldexp(1 + part, static_cast<int>(random() % 600) - 300)}) {
      const auto exact = static_cast<double>(logl(static_cast<long double>(x)));
      ASSERT_NEAR(trig::log(x), exact, 1e-15 * std::fabs(exact)) << x;
    }
  }
  EXPECT_EQ(trig::log(1), 0);
}

TEST(Trig, other_edges) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isnan(trig::sin(inf)));
  EXPECT_TRUE(std::isnan(trig::cos(std::nan(""))));
  EXPECT_EQ(trig::sin(0.0), 0);
  EXPECT_EQ(trig::cos(0.0), 1);
  EXPECT_EQ(trig::acos(1 + 1e-15), 0);
  EXPECT_EQ(trig::acos(-1 - 1e-15), 3.14159265358979323846);
  EXPECT_TRUE(std::isnan(trig::acos(std::nan(""))));
  for (const double x : {1e7, 1e12, 1e300}) {  // accuracy is lost there, sanity is not
    const trig::SinCos<double> sc = trig::sin_cos(x);
    EXPECT_NEAR(sc.sin * sc.sin + sc.cos * sc.cos, 1, 1e-15);
  }
  EXPECT_NEAR(trig::sin(1e7), static_cast<double>(sinl(1e7L)), 1e7 * 4e-17);
}

// One number over many results: changes if any compiler or level of optimisation changes a bit.
TEST(Trig, bits_are_the_same_everywhere) {
  std::mt19937_64 random(3);
  std::uint64_t sum = 0;
  const auto mix = [&sum](double x) {
    std::uint64_t bits;
    static_assert(sizeof bits == sizeof x);
    __builtin_memcpy(&bits, &x, sizeof bits);
    sum = (sum ^ bits) * 0x9e3779b97f4a7c15u;
    sum ^= sum >> 29;
  };
  for (int i = 0; i < 200000; ++i) {
    const double a = static_cast<double>(random() >> 11) * 0x1p-53, b = a * 40 - 20;
    const double c = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
    mix(trig::sin(b));
    mix(trig::cos(b));
    mix(trig::atan2(c, b));
    mix(trig::acos(c));
  }
  EXPECT_EQ(sum, 8290231907130969980u);
}

}  // namespace
}  // namespace skerry::core
