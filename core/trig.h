// Sine, cosine, arc tangent, arc cosine, logarithm in plain arithmetic: the same bits from every compiler,
// library and machine, which libm does not promise. Use these wherever the result feeds state.
//
//   Accuracy  double: at most 0.8 (sin, cos), 1.7 (atan2) and 2.2 (acos) units in the last place
//             over a million arguments (tests/core/trig_test.cpp). Angles beyond 5e5 rad are wrong
//             by 4e-17 of themselves. float: computed in double, then rounded.
//   Method    Angles: three-part reduction by pi/2 (Cody and Waite 1980), Taylor series of degree
//             17 and 16 on |x| <= pi/4. Arc tangent: nearest quarter by the addition theorem,
//             Taylor series of degree 17 on |x| <= 1/8.
//   Errors    sin, cos of infinity and NaN are NaN.
#pragma once

namespace skerry::core::trig {

template <class T>
struct SinCos {
  T sin, cos;
};

SinCos<double> sin_cos(double x);
double sin(double x);
double cos(double x);
// Angle of the point (x, y), in [-pi, pi]; 0 at the origin. Signs of zeros as in C's atan2, except
// that a negative zero x counts as a positive one.
double atan2(double y, double x);
// In [0, pi]; arguments beyond [-1, 1] by rounding are taken as the bound.
double acos(double x);
// Natural, of x > 0; relative error 1e-15, near 1 too. Series of the area hyperbolic tangent, degree 25.
double log(double x);

SinCos<float> sin_cos(float x);
float sin(float x);
float cos(float x);
float atan2(float y, float x);
float acos(float x);

}  // namespace skerry::core::trig
