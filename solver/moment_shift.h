// Bodies shifted by little so that the moment of their momenta changes by a given amount.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/bodies.h"

namespace skerry::solver {

// Of all shifts d that do, those with the least sum of m d^2 are r x v with one r for all. They are held
// small against the bodies; what that leaves undone is left.
class MomentShift {
 public:
  // A body may be shifted by `inner_radii`, and by what it flies in `time` s, at most.
  void begin(double inner_radii, double time);
  // `velocity`: m/s; if the velocities are those about the common centre of mass, that does not move.
  void add(const core::BodyMass& mass, const Vec3& velocity);
  // `change`: kg m^2/s, of the sum of centre x momentum, to be taken back. Whether nearly all of it is.
  bool solve(const Vec3& change);
  // m, of a body in the order of add.
  Vec3 shift(std::size_t i) const { return turn_.cross(bodies_[i].velocity); }

 private:
  struct Body {
    Vec3 velocity;
    double mass, limit;
  };
  bool are_small() const;

  double inner_radii_ = 0, time_ = 0;
  std::vector<Body> bodies_;
  Vec3 turn_ = Vec3::Zero();  // s
};

// What one body's stop changed in the moment of the momenta of its island.
struct MomentChange {
  std::uint32_t island;
  core::BodyIndex body;
  Vec3 change;  // kg m^2/s
};

}  // namespace skerry::solver
