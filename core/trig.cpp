#include "core/trig.h"
#include "core/rounding.h"

#include <cmath>

namespace skerry::core::trig {
namespace {

constexpr double kPi = 0x1.921fb54442d18p+1, kPiLow = 0x1.1a62633145c07p-53;

// pi/2 in parts of 33, 33 and 53 bits: a multiple below 2^20 of the first two is exact.
constexpr double kHalfPi1 = 0x1.921fb544p+0;
constexpr double kHalfPi2 = 0x1.0b4611a6p-34;
constexpr double kHalfPi3 = 0x1.3198a2e037073p-69;
constexpr double kTwoOverPi = 0x1.45f306dc9c883p-1;
constexpr double kReducible = 0x1p19;  // rad

// x = quarter pi/2 + high + low with |high| <= pi/4 (and a little), low its rounding error.
struct Reduced {
  double high, low;
  int quarter;  // modulo 4
};

Reduced reduce(double x) {
  if (std::fabs(x) <= 0.785) return {x, 0, 0};
  if (!(std::fabs(x) < kReducible)) x = std::fmod(x, 2 * kPi);  // exact, but not of 2 pi exactly
  constexpr double kRound = 0x1.8p52;  // adding it leaves the nearest integer
  const double n = (x * kTwoOverPi + kRound) - kRound;
  const double a = x - n * kHalfPi1;
  const double b = n * kHalfPi2;
  const double c = a - b;
  const double tail = ((a - c) - b) - n * kHalfPi3;
  const double high = c + tail;
  return {high, (c - high) + tail, static_cast<int>(static_cast<long long>(n) & 3)};
}

double sin_reduced(double x, double low) {
  const double z = x * x;
  double p = 1 / 355687428096000.0;
  p = p * z - 1 / 1307674368000.0;
  p = p * z + 1 / 6227020800.0;
  p = p * z - 1 / 39916800.0;
  p = p * z + 1 / 362880.0;
  p = p * z - 1 / 5040.0;
  p = p * z + 1 / 120.0;
  p = p * z - 1 / 6.0;
  return x + (x * z * p + low * (1 - 0.5 * z));
}

double cos_reduced(double x, double low) {
  const double z = x * x;
  double p = 1 / 20922789888000.0;
  p = p * z - 1 / 87178291200.0;
  p = p * z + 1 / 479001600.0;
  p = p * z - 1 / 3628800.0;
  p = p * z + 1 / 40320.0;
  p = p * z - 1 / 720.0;
  p = p * z + 1 / 24.0;
  const double half = 0.5 * z, head = 1 - half;
  return head + (((1 - head) - half) + (z * z * p - x * low));
}

// Arc tangent of y/x for 0 <= y <= x, x > 0.
double atan_octant(double y, double x) {
  struct Anchor {
    double x, high, low;
  };
  static constexpr Anchor kAnchors[5] = {{0, 0, 0},
                                         {0.25, 0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
                                         {0.5, 0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
                                         {0.75, 0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
                                         {1, 0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}};
  if (std::isinf(x)) return std::isinf(y) ? kPi / 4 : 0;
  const double scale = x > 0x1p1000 ? 0x1p-8 : 1;  // the sum below must not overflow
  const Anchor& anchor = kAnchors[static_cast<int>(y / x * 4 + 0.5)];
  const double t = (y * scale - x * scale * anchor.x) / (x * scale + y * scale * anchor.x);
  const double z = t * t;
  double p = 1 / 17.0;
  p = p * z - 1 / 15.0;
  p = p * z + 1 / 13.0;
  p = p * z - 1 / 11.0;
  p = p * z + 1 / 9.0;
  p = p * z - 1 / 7.0;
  p = p * z + 1 / 5.0;
  p = p * z - 1 / 3.0;
  return anchor.high + (t + (t * z * p + anchor.low));
}

}  // namespace

SinCos<double> sin_cos(double x) {
  if (!std::isfinite(x)) return {x - x, x - x};
  const Reduced r = reduce(x);
  const double s = sin_reduced(r.high, r.low), c = cos_reduced(r.high, r.low);
  switch (r.quarter) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

double sin(double x) { return sin_cos(x).sin; }
double cos(double x) { return sin_cos(x).cos; }

double atan2(double y, double x) {
  const double ax = std::fabs(x), ay = std::fabs(y);
  if (!(ax <= HUGE_VAL && ay <= HUGE_VAL)) return x + y;  // NaN
  double angle;
  if (ay <= ax) {
    if (ax == 0) return y;
    angle = atan_octant(ay, ax);
    if (x < 0) angle = kPi - (angle - kPiLow);
  } else {
    const double side = atan_octant(ax, ay);
    angle = x < 0 ? kPi / 2 + (side + kPiLow / 2) : kPi / 2 - (side - kPiLow / 2);
  }
  return std::copysign(angle, y);
}

double acos(double x) {
  if (x >= 1) return 0;
  if (x <= -1) return kPi;
  return 2 * atan2(std::sqrt(1 - x), std::sqrt(1 + x));
}

double log(double x) {
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // in [0.5, 1)
  if (m < 0.70710678118654752) {
    m *= 2;
    --exponent;
  }
  const double z = (m - 1) / (m + 1), square = z * z;
  double sum = 0;
  for (int k = 25; k >= 1; k -= 2) sum = sum * square + 1.0 / k;
  return 2 * z * sum + exponent * 0.69314718055994530942;
}

SinCos<float> sin_cos(float x) {
  const SinCos<double> r = sin_cos(static_cast<double>(x));
  return {rounded_to_float(r.sin), rounded_to_float(r.cos)};
}
float sin(float x) { return rounded_to_float(sin(static_cast<double>(x))); }
float cos(float x) { return rounded_to_float(cos(static_cast<double>(x))); }
float atan2(float y, float x) {
  return rounded_to_float(atan2(static_cast<double>(y), static_cast<double>(x)));
}
float acos(float x) { return rounded_to_float(acos(static_cast<double>(x))); }

}  // namespace skerry::core::trig
