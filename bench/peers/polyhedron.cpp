#include "bench/peers/polyhedron.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace skerry::peers {
namespace {

constexpr double kSame = 1e-9;  // relative: planes and directions closer than this are one

double extent(std::span<const Vec3> points) {
  double largest = 0;
  for (const Vec3& p : points) largest = std::max(largest, (p - points[0]).norm());
  return largest;
}

void add_direction(std::vector<Vec3>& known, const Vec3& direction) {
  for (const Vec3& d : known) {
    if (d.cross(direction).squaredNorm() < kSame) return;
  }
  known.push_back(direction);
}

class HullBuilder {
 public:
  explicit HullBuilder(std::span<const Vec3> points) : tolerance_(kSame * extent(points)) {
    hull_.points.assign(points.begin(), points.end());
  }

  Polyhedron build() {
    const auto count = static_cast<std::uint32_t>(hull_.points.size());
    for (std::uint32_t a = 0; a < count; ++a) {
      for (std::uint32_t b = a + 1; b < count; ++b) {
        for (std::uint32_t c = b + 1; c < count; ++c) try_plane(a, b, c);
      }
    }
    if (hull_.faces.size() < 4) throw std::invalid_argument("a hull needs points in space");
    for (const Face& face : hull_.faces) add_directions(face);
    return std::move(hull_);
  }

 private:
  void try_plane(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const auto& p = hull_.points;
    Vec3 normal = (p[b] - p[a]).cross(p[c] - p[a]);
    if (normal.norm() <= tolerance_ * tolerance_) return;
    normal.normalize();
    double above = 0, below = 0;
    for (const Vec3& q : p) {
      above = std::max(above, normal.dot(q - p[a]));
      below = std::max(below, -normal.dot(q - p[a]));
    }
    if (above <= tolerance_ && below > tolerance_) add_face(normal, normal.dot(p[a]));
    if (below <= tolerance_ && above > tolerance_) add_face(-normal, -normal.dot(p[a]));
  }

  void add_face(const Vec3& normal, double offset) {
    for (const Face& face : hull_.faces) {
      if ((face.normal - normal).squaredNorm() < kSame) return;
    }
    Face face = {normal, offset};
    for (std::uint32_t i = 0; i < hull_.points.size(); ++i) {
      if (std::abs(normal.dot(hull_.points[i]) - offset) <= tolerance_) face.corners.push_back(i);
    }
    sort_corners(face);
    hull_.faces.push_back(std::move(face));
  }

  void sort_corners(Face& face) const {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t i : face.corners) middle += hull_.points[i];
    middle /= static_cast<double>(face.corners.size());
    const Vec3 u = (hull_.points[face.corners[0]] - middle).normalized();
    const Vec3 v = face.normal.cross(u);
    const auto angle = [&](std::uint32_t i) {
      const Vec3 d = hull_.points[i] - middle;
      return std::atan2(v.dot(d), u.dot(d));
    };
    std::sort(face.corners.begin(), face.corners.end(),
              [&](std::uint32_t a, std::uint32_t b) { return angle(a) < angle(b); });
  }

  void add_directions(const Face& face) {
    add_direction(hull_.normals, face.normal);
    for (std::size_t i = 0; i < face.corners.size(); ++i) {
      const Vec3& from = hull_.points[face.corners[i]];
      const Vec3& to = hull_.points[face.corners[(i + 1) % face.corners.size()]];
      add_direction(hull_.edges, (to - from).normalized());
    }
  }

  Polyhedron hull_;
  double tolerance_;
};

}  // namespace

Polyhedron convex_hull(std::span<const Vec3> points) { return HullBuilder(points).build(); }

std::vector<Vec3> box_corners(const Vec3& h) {
  std::vector<Vec3> corners;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) corners.emplace_back(x * h.x(), y * h.y(), z * h.z());
    }
  }
  return corners;
}

// Sums over the tetrahedra that the origin makes with each triangle of the surface.
SolidMass solid_mass(const Polyhedron& solid) {
  SolidMass sum;
  Mat3 second_moment = Mat3::Zero();
  for (const Face& face : solid.faces) {
    for (std::size_t i = 2; i < face.corners.size(); ++i) {
      const Vec3& a = solid.points[face.corners[0]];
      const Vec3& b = solid.points[face.corners[i - 1]];
      const Vec3& c = solid.points[face.corners[i]];
      const double six_volumes = a.dot(b.cross(c));
      const Vec3 s = a + b + c;
      sum.volume += six_volumes / 6;
      sum.center += six_volumes / 24 * s;
      second_moment +=
          six_volumes / 120 *
          (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
    }
  }
  sum.center /= sum.volume;
  const Mat3 central = second_moment / sum.volume - sum.center * sum.center.transpose();
  sum.unit_inertia = central.trace() * Mat3::Identity() - central;
  return sum;
}

}  // namespace skerry::peers
