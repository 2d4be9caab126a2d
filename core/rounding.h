// Rounding a double to float so that every compiler does it.
#pragma once

namespace skerry::core {

// `value` rounded to the nearest float. gcc 12 drops this rounding where it turns two of them and the
// widenings that follow into vector operations (-O2 and up, -ftree-slp-vectorize): (double)(float)x
// becomes x. The empty statement hides from it where the float comes from, and costs nothing.
// docs/decisions/0004-rounding-to-float.md
inline float rounded_to_float(double value) {
  auto rounded = static_cast<float>(value);
#if defined(__GNUC__) && !defined(__clang__) && defined(__SSE2__)
  asm("" : "+x"(rounded));
#elif defined(__GNUC__) && !defined(__clang__)
  asm("" : "+m"(rounded));
#endif
  return rounded;
}

}  // namespace skerry::core
