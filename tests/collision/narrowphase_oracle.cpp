#include "tests/collision/narrowphase_oracle.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace skerry::test {
namespace {

// In the shape's frame, `d` of any length.
struct Support {
  Vec3 d;

  Vec3 operator()(const Sphere& s) const { return s.radius * d.normalized(); }
  Vec3 operator()(const Capsule& s) const {
    return s.radius * d.normalized() + Vec3(0, d.y() < 0 ? -s.half_height : s.half_height, 0);
  }
  Vec3 operator()(const Box& s) const {
    return {std::copysign(s.half_extents.x(), d.x()), std::copysign(s.half_extents.y(), d.y()),
            std::copysign(s.half_extents.z(), d.z())};
  }
  Vec3 radial(double radius) const {
    const double r = std::hypot(d.x(), d.z());
    return r > 0 ? Vec3(d.x() * radius / r, 0, d.z() * radius / r) : Vec3(radius, 0, 0);
  }
  Vec3 operator()(const Cylinder& s) const {
    return radial(s.radius) + Vec3(0, std::copysign(s.half_height, d.y()), 0);
  }
  Vec3 operator()(const Cone& s) const {
    const Vec3 apex(0, s.half_height, 0), rim = radial(s.radius) - apex;
    return d.dot(apex) > d.dot(rim) ? apex : rim;
  }
  Vec3 operator()(const Ellipsoid& s) const {
    const Vec3 scaled = s.semi_axes.cwiseProduct(d);
    return s.semi_axes.cwiseProduct(scaled.normalized());
  }
  Vec3 operator()(const ConvexHull& s) const {
    return *std::max_element(s.points.begin(), s.points.end(),
                             [&](const Vec3& p, const Vec3& q) { return p.dot(d) < q.dot(d); });
  }
  Vec3 operator()(const Plane&) const { return Vec3::Zero(); }
  Vec3 operator()(const HeightField&) const { return Vec3::Zero(); }  // not convex
  Vec3 operator()(const TriangleMesh& s) const {
    return *std::max_element(s.data->vertices.begin(), s.data->vertices.end(),
                             [&](const Vec3& p, const Vec3& q) { return p.dot(d) < q.dot(d); });
  }
};

const std::vector<Vec3>& sphere_directions() {
  static const std::vector<Vec3> directions = [] {
    constexpr int kCount = 600;
    std::vector<Vec3> all;
    for (int i = 0; i < kCount; ++i) {
      const double y = 1 - (2 * i + 1.0) / kCount, r = std::sqrt(1 - y * y);
      const double angle = std::numbers::pi * (3 - std::sqrt(5.0)) * i;
      all.emplace_back(r * std::cos(angle), y, r * std::sin(angle));
    }
    return all;
  }();
  return directions;
}

struct Gap {
  const ShapeGeometry& a;
  const Pose& pose_a;
  const ShapeGeometry& b;
  const Pose& pose_b;
  double operator()(const Vec3& n) const { return gap_along(a, pose_a, b, pose_b, n); }
};

// Climbs from a direction by steps that halve when none of six neighbours is higher in four tries, each
// turned against the last: along a sharp ridge few directions lead up.
Sweep climb(const Gap& gap, Sweep from) {
  double step = 0.08;
  int tries = 0;
  for (int i = 0; i < 600 && step > 2e-6; ++i) {
    const Vec3 u = from.normal.unitOrthogonal(), v = from.normal.cross(u);
    Sweep best = from;
    for (int k = 0; k < 6; ++k) {
      const double angle = (k + 0.25 * tries) * std::numbers::pi / 3;
      const Vec3 n =
          (from.normal + step * (std::cos(angle) * u + std::sin(angle) * v)).normalized();
      if (const double s = gap(n); s > best.separation) best = {s, n};
    }
    if (best.separation > from.separation) {
      from = best;
    } else if (++tries == 4) {
      tries = 0;
      step *= 0.5;
    }
  }
  return from;
}

Sweep consider(const Gap& gap, Sweep best, const Vec3& axis) {
  if (axis.norm() < 1e-9) return best;
  for (const double sign : {1.0, -1.0})
    if (const double s = gap(sign * axis.normalized()); s > best.separation)
      best = {s, sign * axis.normalized()};
  return best;
}

Sweep box_axes(const Gap& gap) {
  const Mat3 ra = gap.pose_a.orientation.toRotationMatrix();
  const Mat3 rb = gap.pose_b.orientation.toRotationMatrix();
  Sweep best{-1e300, Vec3::UnitY()};
  for (int i = 0; i < 3; ++i) {
    best = consider(gap, best, ra.col(i));
    best = consider(gap, best, rb.col(i));
    for (int j = 0; j < 3; ++j) best = consider(gap, best, ra.col(i).cross(rb.col(j)));
  }
  return best;
}

}  // namespace

Vec3 support(const ShapeGeometry& geometry, const Pose& pose, const Vec3& direction) {
  const Vec3 local = pose.orientation.conjugate() * direction;
  return pose.orientation * std::visit(Support{local}, geometry) + pose.position;
}

double gap_along(const ShapeGeometry& a, const Pose& pose_a, const ShapeGeometry& b,
                 const Pose& pose_b, const Vec3& direction) {
  return direction.dot(support(b, pose_b, -direction) - support(a, pose_a, direction));
}

Sweep sweep(const ShapeGeometry& a, const Pose& pose_a, const ShapeGeometry& b, const Pose& pose_b,
            std::size_t count) {
  const Gap gap{a, pose_a, b, pose_b};
  if (std::holds_alternative<Box>(a) && std::holds_alternative<Box>(b)) return box_axes(gap);
  std::vector<Sweep> starts(count, {-1e300, Vec3::UnitY()});
  for (const Vec3& n : sphere_directions()) {
    const double s = gap(n);
    if (s <= starts.back().separation) continue;
    starts.back() = {s, n};
    std::sort(starts.begin(), starts.end(),
              [](const Sweep& x, const Sweep& y) { return x.separation > y.separation; });
  }
  Sweep best{-1e300, Vec3::UnitY()};
  for (const Sweep& start : starts) {
    const Sweep top = climb(gap, start);
    if (top.separation > best.separation) best = top;
  }
  return best;
}

}  // namespace skerry::test
