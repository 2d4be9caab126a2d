#include "solver/standing_loads.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"
#include "core/vec.h"

namespace skerry::solver {

using core::kNone;
using core::Manifold;

void StandingLoads::begin(std::uint32_t rows, const Vec3& gravity, double substep, Scope scope) {
  substep_ = substep;
  scope_ = scope;
  touching_ = gravity.norm() * substep * substep;  // what is farther falls first
  up_ = gravity / -gravity.norm();
  const Vec3 aside = std::abs(up_.x()) < 0.5 ? Vec3(1, 0, 0) : Vec3(0, 0, 1);
  across_[0] = up_.cross(aside).normalized();
  across_[1] = up_.cross(across_[0]);
  if (loads_.size() < rows) loads_.resize(rows);
  rows_.clear();
  supports_.clear();
}

void StandingLoads::add_body(std::uint32_t row, double weight) {
  loads_[row] = {};
  loads_[row].force = weight;
  rows_.push_back(row);
}

void StandingLoads::add(const Support& support) { supports_.push_back(support); }

void StandingLoads::share() {
  link();
  sort();
  find_ground();
  for (const std::uint32_t row : order_) {
    const Load& body = loads_[row];
    if (!body.stands || !body.shares) continue;
    find_points(body);
    if (points_.empty()) continue;
    spread(body);
    hand_on(body);
  }
}

void StandingLoads::link() {
  for (std::size_t i = supports_.size(); i-- > 0;) {
    Support& support = supports_[i];
    Load& above = loads_[support.above];
    above.shares = (above.first == kNone || above.shares) && counts(support);
    support.next = above.first;
    above.first = static_cast<std::uint32_t>(i);
    if (support.below != kGround) ++loads_[support.below].awaited;
  }
}

// Bodies after all that rests on them. Those that rest on each other in a ring are left out.
void StandingLoads::sort() {
  order_.clear();
  for (const std::uint32_t row : rows_)
    if (loads_[row].awaited == 0) order_.push_back(row);
  for (std::size_t done = 0; done < order_.size(); ++done) {
    for (std::uint32_t i = loads_[order_[done]].first; i != kNone; i = supports_[i].next) {
      const std::uint32_t below = supports_[i].below;
      if (below != kGround && --loads_[below].awaited == 0) order_.push_back(below);
    }
  }
}

void StandingLoads::find_ground() {
  for (std::size_t done = order_.size(); done-- > 0;) {
    Load& body = loads_[order_[done]];
    for (std::uint32_t i = body.first; i != kNone; i = supports_[i].next) {
      const Support& support = supports_[i];
      body.stands = body.stands || !counts(support) || support.below == kGround ||
                    loads_[support.below].stands;
    }
  }
}

double StandingLoads::across(int axis, const Support& support, std::uint32_t point,
                             int side) const {
  const Vec3 at = core::to_double(support.manifold->points[point].position) + support.shift[side];
  const Vec3& a = across_[axis];
  return (a.x() * at.x() + a.y() * at.y()) + a.z() * at.z();
}

bool StandingLoads::counts(const Support& support) const {
  return scope_ != Scope::begun || support.manifold->begins;
}

bool StandingLoads::touches(const Manifold& manifold, std::uint32_t point) const {
  return manifold.begins ? double(manifold.points[point].separation) <= touching_
                         : manifold.normal_impulse[point] > 0;
}

// On a slope the rest is friction's.
double StandingLoads::along_normal(const Manifold& manifold) const {
  return std::abs(up_.dot(core::to_double(manifold.normal)));
}

void StandingLoads::find_points(const Load& body) {
  points_.clear();
  for (std::uint32_t i = body.first; i != kNone; i = supports_[i].next) {
    const Support& support = supports_[i];
    for (std::uint32_t p = 0; p < support.manifold->point_count; ++p) {
      if (!touches(*support.manifold, p)) continue;
      points_.push_back({i, p, {across(0, support, p, 0), across(1, support, p, 0)}, 0});
    }
  }
}

// Shares linear in the place, whose sum and moment are those of the load; none below zero.
void StandingLoads::spread(const Load& body) {
  constexpr double kLine = 1e-3;  // points in a line bear no moment about it
  const auto count = static_cast<double>(points_.size());
  double mean[2] = {0, 0};
  for (const Point& point : points_) {
    mean[0] += point.place[0];
    mean[1] += point.place[1];
  }
  mean[0] /= count;
  mean[1] /= count;
  double s00 = 0, s01 = 0, s11 = 0;
  for (Point& point : points_) {
    const double x = point.place[0] - mean[0], y = point.place[1] - mean[1];
    s00 += x * x;
    s01 += x * y;
    s11 += y * y;
  }
  const double least = kLine * (s00 + s11);
  s00 += least;
  s11 += least;
  const double det = s00 * s11 - s01 * s01;
  const double inv_det = det > 0 ? 1 / det : 0;
  const double m0 = body.moment[0] - body.force * mean[0];
  const double m1 = body.moment[1] - body.force * mean[1];
  const double tilt0 = (s11 * m0 - s01 * m1) * inv_det, tilt1 = (s00 * m1 - s01 * m0) * inv_det;
  double sum = 0;
  for (Point& point : points_) {
    const double x = point.place[0] - mean[0], y = point.place[1] - mean[1];
    point.share = std::max(0.0, body.force / count + (tilt0 * x + tilt1 * y));
    sum += point.share;
  }
  const double scale = sum > 0 ? body.force / sum : 0;
  for (Point& point : points_) point.share *= scale;
}

void StandingLoads::hand_on(const Load& body) {
  for (const Point& point : points_) {
    Support& support = supports_[point.support];
    support.load += point.share;
    if (scope_ == Scope::all_anew || support.manifold->begins) {
      support.manifold->normal_impulse[point.index] =
          core::rounded_to_float(point.share * along_normal(*support.manifold) * substep_);
    }
    if (support.below == kGround) continue;
    Load& below = loads_[support.below];
    below.force += point.share;
    for (int axis = 0; axis < 2; ++axis)
      below.moment[axis] += point.share * across(axis, support, point.index, 1);
  }
  for (std::uint32_t i = body.first; i != kNone; i = supports_[i].next) {
    Manifold& m = *supports_[i].manifold;
    const double load = supports_[i].load * along_normal(m) / m.point_count;
    m.statics_impulse = m.standing_impulse = core::rounded_to_float(load * substep_);
    m.carried_impulse = carried_of(m, m.statics_impulse);
  }
}

}  // namespace skerry::solver
