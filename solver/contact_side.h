// One of the two bodies of a contact, in the axes of the world, for the code that works in double on one
// contact at a time: the solvers to measure against, and the residuals of the contact law.
#pragma once

#include <skerry/types.h>

namespace skerry::solver {

struct ContactSide {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();  // m/s, rad/s
  Vec3 inv_mass = Vec3::Zero();                        // 1/kg, per axis; 0: does not give way
  Mat3 inv_inertia = Mat3::Zero();                     // kg^-1 m^-2
};

// Velocity of b's side against a's at arms from the two centres.
inline Vec3 relative_velocity(const ContactSide& a, const ContactSide& b, const Vec3& arm_a,
                              const Vec3& arm_b) {
  return b.linear + b.angular.cross(arm_b) - a.linear - a.angular.cross(arm_a);
}

// Velocity change of one side at its arm along `out`, by a unit impulse along `in`.
inline double response(const ContactSide& side, const Vec3& arm, const Vec3& in, const Vec3& out) {
  return out.dot(side.inv_mass.cwiseProduct(in)) +
         arm.cross(out).dot(side.inv_inertia * arm.cross(in));
}

inline double inverse_or_zero(double x) { return x > 0 ? 1 / x : 0; }

}  // namespace skerry::solver
