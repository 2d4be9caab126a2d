#include "solver/moment_shift.h"

#include <algorithm>

namespace skerry::solver {
namespace {

// Part of the spread of momenta that is added to it in all directions: almost nothing, so that bodies that
// move along one line are not turned about it; then more, until all shifts are small.
constexpr double kLeastSpread = 1e-9, kMostSpread = 10, kMoreSpread = 10;
constexpr double kLeft = 1e-3;  // part of a change that may be left

}  // namespace

void MomentShift::begin(double inner_radii, double time) {
  bodies_.clear();
  inner_radii_ = inner_radii;
  time_ = time;
}

void MomentShift::add(const core::BodyMass& mass, const Vec3& velocity) {
  const double limit = std::min(inner_radii_ * double(mass.inner_radius), time_ * velocity.norm());
  bodies_.push_back({velocity, mass.mass, limit});
}

// r x v changes the sum of m d x v by -S r with S = sum m (v^2 1 - v v^T).
bool MomentShift::solve(const Vec3& change) {
  turn_.setZero();
  Mat3 spread = Mat3::Zero();
  for (const Body& body : bodies_) {
    const Vec3& v = body.velocity;
    spread += body.mass * (v.squaredNorm() * Mat3::Identity() - v * v.transpose());
  }
  const double trace = spread.trace();
  if (change.isZero(0)) return true;
  if (!change.allFinite() || !spread.allFinite() || !(trace > 0)) return false;
  for (double part = kLeastSpread; part < kMostSpread; part *= kMoreSpread) {
    const Mat3 padded = spread + (part * trace) * Mat3::Identity();
    turn_ = padded.inverse() * change;
    if (are_small()) return (change - spread * turn_).norm() <= kLeft * change.norm();
  }
  turn_.setZero();
  return false;
}

bool MomentShift::are_small() const {
  for (const Body& body : bodies_)
    if (!(turn_.cross(body.velocity).squaredNorm() <= body.limit * body.limit)) return false;
  return true;
}

}  // namespace skerry::solver
