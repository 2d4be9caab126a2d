#include "core/mass_properties.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include <Eigen/Eigenvalues>

namespace skerry::core {
namespace {

constexpr double kPi = std::numbers::pi;

MassProperties diagonal(double mass, double x, double y, double z) {
  MassProperties part;
  part.mass = mass;
  part.inertia(0, 0) = x;
  part.inertia(1, 1) = y;
  part.inertia(2, 2) = z;
  return part;
}

// What the parallel axis theorem adds for a mass at this distance from the axis' origin.
Mat3 point_inertia(double mass, const Vec3& r) {
  return mass * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
}

// Integrals over tetrahedra that share the origin: volume, of x, and of x x^T.
struct VolumeIntegrals {
  double volume = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();

  void add_tetrahedron(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double six_volume = a.dot(b.cross(c));
    const Vec3 sum = a + b + c;
    volume += six_volume / 6;
    first += (six_volume / 24) * sum;
    second += (six_volume / 120) *
              (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
};

Vec3 mean(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& point : points) sum += point;
  return points.empty() ? sum : Vec3(sum / double(points.size()));
}

}  // namespace

MassProperties solid_sphere(double radius, double density) {
  return solid_ellipsoid({radius, radius, radius}, density);
}

MassProperties hollow_sphere(double radius, double area_density) {
  const double mass = 4 * kPi * radius * radius * area_density;
  const double moment = 2.0 / 3.0 * mass * radius * radius;
  return diagonal(mass, moment, moment, moment);
}

MassProperties solid_ellipsoid(const Vec3& semi_axes, double density) {
  const double mass = 4.0 / 3.0 * kPi * semi_axes.x() * semi_axes.y() * semi_axes.z() * density;
  const Vec3 s = semi_axes.cwiseProduct(semi_axes);
  return diagonal(mass, mass / 5 * (s.y() + s.z()), mass / 5 * (s.x() + s.z()),
                  mass / 5 * (s.x() + s.y()));
}

MassProperties solid_box(const Vec3& half_extents, double density) {
  const double mass = 8 * half_extents.x() * half_extents.y() * half_extents.z() * density;
  const Vec3 s = half_extents.cwiseProduct(half_extents);
  return diagonal(mass, mass / 3 * (s.y() + s.z()), mass / 3 * (s.x() + s.z()),
                  mass / 3 * (s.x() + s.y()));
}

MassProperties solid_capsule(double radius, double half_height, double density) {
  const double r2 = radius * radius, h2 = half_height * half_height;
  const double middle = 2 * kPi * r2 * half_height * density;
  const double caps = 4.0 / 3.0 * kPi * r2 * radius * density;  // both
  // A cap's centre of mass lies 3/8 r beyond the disc that cuts it off.
  const double across =
      middle * (h2 / 3 + r2 / 4) + caps * (0.4 * r2 + h2 + 0.75 * half_height * radius);
  const double along = middle * r2 / 2 + caps * 0.4 * r2;
  return diagonal(middle + caps, across, along, across);
}

MassProperties solid_cylinder(double radius, double half_height, double density) {
  const double r2 = radius * radius, h2 = half_height * half_height;
  const double mass = 2 * kPi * r2 * half_height * density;
  const double across = mass * (h2 / 3 + r2 / 4);
  return diagonal(mass, across, mass * r2 / 2, across);
}

MassProperties solid_cone(double radius, double half_height, double density) {
  const double r2 = radius * radius, h2 = half_height * half_height;
  const double mass = 2.0 / 3.0 * kPi * r2 * half_height * density;
  const double across = 0.15 * mass * (r2 + h2);
  MassProperties part = diagonal(mass, across, 0.3 * mass * r2, across);
  part.center = {0, -half_height / 2, 0};
  return part;
}

MassProperties closed_mesh(std::span<const Vec3> vertices,
                           std::span<const std::array<std::uint32_t, 3>> triangles,
                           double density) {
  // About the mean of the vertices: a small mesh far from its origin would cancel away.
  const Vec3 origin = mean(vertices);
  VolumeIntegrals sum;
  for (const auto& [a, b, c] : triangles)
    sum.add_tetrahedron(vertices[a] - origin, vertices[b] - origin, vertices[c] - origin);

  MassProperties part;
  part.center = origin;
  part.mass = density * sum.volume;
  if (sum.volume == 0) return part;
  const Vec3 center = sum.first / sum.volume;
  part.center += center;
  const Mat3 second = sum.second - sum.volume * center * center.transpose();
  part.inertia = density * (second.trace() * Mat3::Identity() - second);
  return part;
}

MassProperties point_masses(std::span<const PointMass> points) {
  MassProperties sum;
  for (const PointMass& point : points) {
    sum.mass += point.mass;
    sum.center += point.mass * point.position;
  }
  if (sum.mass == 0) return {};
  sum.center /= sum.mass;
  for (const PointMass& point : points)
    sum.inertia += point_inertia(point.mass, point.position - sum.center);
  return sum;
}

MassProperties placed(const MassProperties& part, const Pose& pose) {
  const Mat3 rotation = pose.orientation.toRotationMatrix();
  const Mat3 inertia = rotation * part.inertia * rotation.transpose();
  return {part.mass, rotation * part.center + pose.position,
          (inertia + inertia.transpose()) / 2};  // exactly symmetric
}

MassProperties combined(std::span<const MassProperties> parts) {
  MassProperties sum;
  for (const MassProperties& part : parts) {
    sum.mass += part.mass;
    sum.center += part.mass * part.center;
  }
  if (sum.mass == 0) return {};
  sum.center /= sum.mass;
  for (const MassProperties& part : parts)
    sum.inertia += part.inertia + point_inertia(part.mass, part.center - sum.center);
  return sum;
}

MassProperties scaled_to(const MassProperties& part, double mass) {
  if (!(part.mass > 0))
    throw std::invalid_argument("a part of mass " + std::to_string(part.mass) +
                                " kg cannot be scaled to another mass");
  return {mass, part.center, part.inertia * (mass / part.mass)};
}

bool is_physical_inertia(const Mat3& inertia) {
  constexpr double kSlack = 1e-6;
  constexpr double kRounding = 1e-14;  // of the eigenvalues: a singular matrix must not pass
  if (!inertia.allFinite()) return false;
  const double scale = inertia.cwiseAbs().maxCoeff();
  if ((inertia - inertia.transpose()).cwiseAbs().maxCoeff() > kSlack * scale) return false;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia, Eigen::EigenvaluesOnly);
  if (solver.info() != Eigen::Success) return false;
  const Vec3 moment = solver.eigenvalues();  // ascending
  return moment[0] > kRounding * moment[2] && moment[0] + moment[1] >= moment[2] * (1 - kSlack);
}

}  // namespace skerry::core
