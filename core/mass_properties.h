// Mass, centre of mass and inertia of solids, shells, meshes and assemblies.
//
//   Units  kg, m, kg m^2. Inertia is about the centre of mass, in the axes of the frame given.
//   Source Inertia tensors of the standard solids; parallel axis theorem; closed meshes by the
//          divergence theorem (Mirtich 1996, "Fast and accurate computation of polyhedral mass
//          properties"; Eberly 2002, "Polyhedral mass properties").
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <skerry/types.h>

namespace skerry::core {

struct MassProperties {
  double mass = 0;
  Vec3 center = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
};

MassProperties solid_sphere(double radius, double density);
MassProperties hollow_sphere(double radius, double area_density);  // kg/m^2
MassProperties solid_ellipsoid(const Vec3& semi_axes, double density);
MassProperties solid_box(const Vec3& half_extents, double density);
MassProperties solid_capsule(double radius, double half_height, double density);   // axis y
MassProperties solid_cylinder(double radius, double half_height, double density);  // axis y
MassProperties solid_cone(double radius, double half_height, double density);      // apex at +y
// Closed, consistently wound outward. A mesh wound inward gives negative mass.
MassProperties closed_mesh(std::span<const Vec3> vertices,
                           std::span<const std::array<std::uint32_t, 3>> triangles, double density);
struct PointMass {
  double mass;
  Vec3 position;
};
MassProperties point_masses(std::span<const PointMass> points);

// The same matter seen from a frame in which its own frame has this pose.
MassProperties placed(const MassProperties& part, const Pose& pose);
// Sum of parts given in one frame.
MassProperties combined(std::span<const MassProperties> parts);
// Same distribution, other mass. Throws std::invalid_argument if the part has no mass.
MassProperties scaled_to(const MassProperties& part, double mass);

// True for a symmetric positive definite matrix that obeys the triangle inequality of principal
// moments (with a relative slack of 1e-6), as every real body's inertia does.
bool is_physical_inertia(const Mat3& inertia);

}  // namespace skerry::core
