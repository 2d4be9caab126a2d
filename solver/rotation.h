// Rotation of a rigid body about its centre of mass, driven by its angular momentum.
//
//   Maths    L(t) = L0 + torque t (world). In body axes, l = R^T L and w = I^-1 l obey Euler's
//            equations l' = l x w + R^T torque; the rotation since the start obeys d' = d w / 2.
//            Solved by the power series of l and d: their terms follow from each other by Cauchy
//            products (Taylor-series method: Jorba and Zou 2005, "A software package for the
//            numerical integration of ODE by means of high-order Taylor methods"). Isotropic and
//            axially symmetric bodies have closed forms.
//   Accuracy The angular momentum is an input and not touched. Orientation: 1e-15 per step; energy
//            drifts by less than 1e-12 in 120 s (tests/solver/rotation_test.cpp).
//   Locks    One free axis: exact. Two: second order, with the cleared inverse inertia that
//            core::inv_inertia_w defines.
#pragma once

#include "core/bodies.h"

namespace skerry::solver {

// A body that turns so fast that a step would need more than this many series (about one per
// radian) is turned by what these cover: momentum and energy hold, its phase is lost.
inline constexpr int kMaxSeries = 1024;

// The orientation turned by |turn| rad about turn (world).
Quat turned(const Quat& orientation, const Vec3& turn);

// omega = R I^-1 R^T L, zero about locked axes.
Vec3 angular_velocity(const core::BodyMass& mass, std::uint32_t flags, const Quat& orientation,
                      const Vec3& angular_momentum);

// Orientation after `duration` s of constant torque (N m, world). `flags` are the body's.
Quat orientation_after(double duration, const core::BodyMass& mass, std::uint32_t flags,
                       const Quat& orientation, const Vec3& angular_momentum, const Vec3& torque);

}  // namespace skerry::solver
