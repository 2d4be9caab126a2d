// Continuous collision: which bodies are too fast for the contacts of one pose, and how far they
// got. Written by the solve (its own bodies only), read by the sweeps after it.
#pragma once

#include <algorithm>
#include <vector>

#include "core/bodies.h"

namespace skerry::core {

// What moved a body in this step.
enum class FastFlight : std::uint8_t {
  free,    // external forces alone
  pushed,  // contacts too
  joined,  // or joints, or damping within the contact solver
};

// A fast body, or one that joints may hold to one, at the start of the step, and how it turned in it.
struct FastStart {
  BodyPose pose;
  BodyMotion motion;
  BodyForce force;  // the user's
  FastFlight flight = FastFlight::free;
  double angle = 0;         // rad, about, over the step
  double impact = -1;       // s: when a pushed body got its final momentum; negative: unknown
  std::vector<Quat> knots;  // orientations between start and end, evenly spaced in time
};

// Two colliders of which one belongs to a fast body, and when they touch.
struct FastPair {
  ColliderIndex a = 0, b = 0;
  BodyIndex body_a = 0, body_b = 0;
  double touch = 0;           // part of the step; above 1: they do not
  bool sensor = false;        // one of them is a sensor's: nobody stops
  std::uint32_t row = kNone;  // in ContactTable::pairs, if it is there
};

struct FastBodies {
  std::vector<FastStart> start;   // [body rows]; valid where kFast, or awake and held by locks
  std::vector<double> part;       // [body rows] part of the step made before it met something, <= 1
  std::vector<BodyIndex> bodies;  // fast ones of this step, ascending
  std::vector<FastPair> pairs;    // of this step; ascending (a, b)
  std::vector<BodyIndex> stopped;  // those whose step was cut short, ascending
  std::vector<BodyIndex> moved;    // these, and those that were moved with them
  std::vector<FastPair> crossed;   // a sensor's, that touched before anybody stopped; ascending

  void resize(std::uint32_t rows) {
    if (start.size() >= rows) return;
    start.resize(rows);
    part.resize(rows, 1);
  }
};

// A body may move this far in a step (m) on the word of contacts that were made at its start: up to
// the gap that every contact foresees, or half way to its middle. Beyond that the planes of those
// contacts say little about what it will meet.
inline double safe_motion(const BodyMass& mass) {
  return std::max(0.005, 0.5 * double(mass.inner_radius));
}

// Upper bound (m) of how far a body's points move in dt, but for a ball's own turning.
inline double motion_of(const BodyMass& mass, const BodyMotion& motion, double dt) {
  return (motion.linear.norm() + motion.angular.norm() * double(mass.turn_radius)) * dt;
}

inline bool moves_fast(const Bodies& bodies, BodyIndex body, double dt) {
  return motion_of(bodies.mass[body], bodies.motion[body], dt) > safe_motion(bodies.mass[body]);
}

// Whether two bodies move so fast past each other: bodies that fall side by side do not.
inline bool part_fast(const BodyMass& mass_a, const BodyMotion& a, const BodyMass& mass_b,
                      const BodyMotion& b, double dt) {
  const double turning =
      a.angular.norm() * double(mass_a.turn_radius) + b.angular.norm() * double(mass_b.turn_radius);
  return ((a.linear - b.linear).norm() + turning) * dt >
         std::min(safe_motion(mass_a), safe_motion(mass_b));
}

// A gap (m) between two bodies that are in touch, as far as continuous collision goes: far below
// their size, and above what single precision makes of their distance. `apart`: m, of the centres.
inline double touch_gap(const BodyMass& a, const BodyMass& b, double apart) {
  double inner = 1;
  for (const BodyMass* mass : {&a, &b})
    if (mass->mass > 0 && mass->inner_radius > 0)
      inner = std::min(inner, double(mass->inner_radius));
  return 2e-3 * inner + 3e-7 * (std::max(apart, 0.0) + a.radius + b.radius);
}

}  // namespace skerry::core
