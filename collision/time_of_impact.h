// When two moving shapes first touch.
//
//   Maths    conservative advancement (Mirtich 1996, "Impulse-based dynamic simulation of rigid body
//            systems"; for turning bodies as in Zhang, Lee and Kim 2006, "Interactive continuous
//            collision detection for non-convex polyhedra"): the plane that parts the shapes at one
//            pose parts them until their motion along its normal has used up the gap. It is followed
//            for as long as it parts them; only then the nearest points are sought anew.
//   Threads  pure functions.
#pragma once

#include "collision/query_convex.h"
#include "core/colliders.h"

namespace skerry::collision {

// Radius (m) of the largest ball inside a shape; of a mesh, a quarter of the half thickness of its
// box. Zero for planes.
double inner_radius(const core::Collider& collider);

// How a body moves over a step, in a frame of world axes with any origin; t runs from 0 to 1. The
// centre follows center + way t - bend t (1 - t); the body turns at a steady rate in each of a number
// of stretches of equal time.
struct Sweep {
  static constexpr int kMostStretches = 32;
  struct Stretch {
    M3d axes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  // at its start
    V3d axis{0, 0, 0};                          // unit
    double angle = 0;                           // rad
  };

  V3d center{0, 0, 0};     // m
  V3d way{0, 0, 0};        // m, over the whole step
  V3d bend{0, 0, 0};       // m
  double end = 1;          // from here on the body stands still
  double turn_radius = 0;  // m, see core::BodyMass
  int stretches = 1;
  Stretch stretch[kMostStretches];

  // A stretch from one orientation to another by the shorter way.
  void set_stretch(int i, const Quat& from, const Quat& to);

  V3d center_at(double t) const;
  M3d axes_at(double t) const;
  // Upper bound of how fast any point moves along a unit direction, m per step, from t on.
  double speed_along(const V3d& unit, double t) const;

 private:
  int stretch_at(double t) const;
};

// A shape of a moving body.
struct SweptShape {
  const Sweep* sweep = nullptr;
  ConvexCore core;            // placed by place()
  V3d local_center{0, 0, 0};  // m, of the shape frame in the body's
  M3d local_axes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  V3d corner[3];      // of a triangle, m, in the body's frame
  double shrink = 1;  // the core is smaller by this factor about `shrink_about` (shape frame)
  V3d shrink_about{0, 0, 0};

  void place(double t);
  // Makes the shape smaller by a depth (m, below its inner radius): all that is left lies at least
  // about that deep inside.
  void erode(const core::Collider& collider, double depth);
};
// A convex shape.
SweptShape swept_shape(const core::Collider& collider, const Sweep& sweep);
// A triangle, corners in its body's frame.
SweptShape swept_triangle(const V3d (&corner)[3], const Sweep& sweep);
// A half-space, always second in a pair: `normal` unit and `offset` in its body's frame.
struct SweptPlane {
  const Sweep* sweep = nullptr;
  V3d normal{0, 1, 0};
  double offset = 0;  // m
};

inline constexpr double kNever = 2;

// The first time in [from, last] at which the two are nearer than `near` (m, above zero), or kNever.
// Never too late; the two are then nearer than `near`, but no nearer than half of it.
double first_near(SweptShape& a, SweptShape& b, double near, double from, double last);
double first_near(SweptShape& a, const SweptPlane& b, double near, double from, double last);

// A time in [0, last] at which two that are nearer than `near` at 0 are not, or kNever: the first of
// a number of samples.
double first_apart(SweptShape& a, SweptShape& b, double near, double last);
double first_apart(SweptShape& a, const SweptPlane& b, double near, double last);

}  // namespace skerry::collision
