#include "tests/collision/query_oracle.h"

#include <algorithm>
#include <cmath>

namespace skerry::test {
namespace {

double radial(const Vec3& p) { return std::hypot(p.x(), p.z()); }

// In the shape's frame; the tolerance widens the shape.
struct Contains {
  Vec3 p;
  double tolerance;

  bool operator()(const Sphere& s) const { return p.norm() <= s.radius + tolerance; }
  bool operator()(const Capsule& s) const {
    const Vec3 axis(0, std::clamp(p.y(), -s.half_height, s.half_height), 0);
    return (p - axis).norm() <= s.radius + tolerance;
  }
  bool operator()(const Box& s) const {
    return ((p.cwiseAbs() - s.half_extents).array() <= tolerance).all();
  }
  bool operator()(const Cylinder& s) const {
    return std::abs(p.y()) <= s.half_height + tolerance && radial(p) <= s.radius + tolerance;
  }
  bool operator()(const Cone& s) const {
    const double height = 2 * s.half_height;
    const double slant = std::hypot(s.radius, height);
    // Distance from the slanted side, seen across the axis.
    const double side = (radial(p) * height - (s.half_height - p.y()) * s.radius) / slant;
    return p.y() >= -s.half_height - tolerance && side <= tolerance;
  }
  bool operator()(const Ellipsoid& s) const {
    const double least = s.semi_axes.minCoeff();
    return p.cwiseQuotient(s.semi_axes).norm() <= 1 + tolerance / least;
  }
  // No plane through three of the points has all points on one side and p beyond it.
  bool operator()(const ConvexHull& s) const {
    const auto& q = s.points;
    for (std::size_t i = 0; i < q.size(); ++i)
      for (std::size_t j = i + 1; j < q.size(); ++j)
        for (std::size_t k = j + 1; k < q.size(); ++k) {
          const Vec3 n = (q[j] - q[i]).cross(q[k] - q[i]).normalized();
          for (const double sign : {1.0, -1.0}) {
            if (sign * n.dot(p - q[i]) <= tolerance) continue;
            const bool outer = std::all_of(q.begin(), q.end(), [&](const Vec3& other) {
              return sign * n.dot(other - q[i]) <= 1e-12;
            });
            if (outer) return false;
          }
        }
    return true;
  }
  template <class Other>
  bool operator()(const Other&) const {
    return false;
  }
};

struct Support {
  Vec3 d;

  Vec3 operator()(const Sphere& s) const { return d.normalized() * s.radius; }
  Vec3 operator()(const Capsule& s) const {
    return d.normalized() * s.radius + Vec3(0, std::copysign(s.half_height, d.y()), 0);
  }
  Vec3 operator()(const Box& s) const {
    return {std::copysign(s.half_extents.x(), d.x()), std::copysign(s.half_extents.y(), d.y()),
            std::copysign(s.half_extents.z(), d.z())};
  }
  Vec3 disc(double radius, double y) const {
    const double r = radial(d);
    return r > 0 ? Vec3(d.x() * radius / r, y, d.z() * radius / r) : Vec3(0, y, 0);
  }
  Vec3 operator()(const Cylinder& s) const {
    return disc(s.radius, std::copysign(s.half_height, d.y()));
  }
  Vec3 operator()(const Cone& s) const {
    const Vec3 base = disc(s.radius, -s.half_height), apex(0, s.half_height, 0);
    return d.dot(apex) > d.dot(base) ? apex : base;
  }
  Vec3 operator()(const Ellipsoid& s) const {
    const Vec3 e = d.cwiseProduct(s.semi_axes).normalized();
    return e.cwiseProduct(s.semi_axes);
  }
  Vec3 operator()(const ConvexHull& s) const {
    return *std::max_element(s.points.begin(), s.points.end(),
                             [&](const Vec3& a, const Vec3& b) { return d.dot(a) < d.dot(b); });
  }
  template <class Other>
  Vec3 operator()(const Other&) const {
    return Vec3::Zero();
  }
};

}  // namespace

bool Solid::contains(const Vec3& point, double tolerance) const {
  return std::visit(Contains{pose.orientation.conjugate() * (point - pose.position), tolerance},
                    geometry);
}
Vec3 Solid::support(const Vec3& along) const {
  return pose.position +
         pose.orientation * std::visit(Support{pose.orientation.conjugate() * along}, geometry);
}

double first_inside(const Solid& solid, const Vec3& origin, const Vec3& translation) {
  constexpr int kSamples = 2000;
  for (int i = 0; i <= kSamples; ++i) {
    double in = double(i) / kSamples;
    if (!solid.contains(origin + in * translation, 0)) continue;
    if (i == 0) return 0;
    double out = double(i - 1) / kSamples;
    for (int k = 0; k < 60; ++k) {
      const double t = (in + out) / 2;
      (solid.contains(origin + t * translation, 0) ? in : out) = t;
    }
    return in;
  }
  return -1;
}

double plane_gap(const Solid& a, const Vec3& shift, const Solid& b, const Vec3& n) {
  return n.dot(b.support(-n) - a.support(n) - shift);
}

double ray_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& origin,
                    const Vec3& translation) {
  const Vec3 e1 = b - a, e2 = c - a, p = translation.cross(e2);
  const double det = e1.dot(p);
  if (det == 0) return -1;
  const Vec3 s = origin - a, q = s.cross(e1);
  const double u = s.dot(p) / det, v = translation.dot(q) / det, t = e2.dot(q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1 ? t : -1;
}

Vec3 nearest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& point) {
  const Vec3 n = (b - a).cross(c - a).normalized();
  const Vec3 flat = point - n * n.dot(point - a);
  const Vec3 corners[3] = {a, b, c};
  bool inside = true;
  Vec3 best = a;
  double least = 1e300;
  for (int i = 0; i < 3; ++i) {
    const Vec3 tail = corners[i], edge = corners[(i + 1) % 3] - tail;
    if (n.dot(edge.cross(flat - tail)) < 0) inside = false;
    const Vec3 p =
        tail + edge * std::clamp((point - tail).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    if ((p - point).norm() >= least) continue;
    least = (p - point).norm();
    best = p;
  }
  return inside ? flat : best;
}

}  // namespace skerry::test
