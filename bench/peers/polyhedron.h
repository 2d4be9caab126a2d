// Convex polyhedra in double precision, for the measurements that no engine may make for itself.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <skerry/types.h>

namespace skerry::peers {

struct Face {
  Vec3 normal = Vec3::Zero();               // unit, outward
  double offset = 0;                        // normal.x = offset on the face
  std::vector<std::uint32_t> corners = {};  // counter-clockwise seen from outside
};

struct Polyhedron {
  std::vector<Vec3> points;
  std::vector<Face> faces;
  // Directions that a separating-axis test needs, each once, whatever its sign.
  std::vector<Vec3> normals;
  std::vector<Vec3> edges;
};

// For a few dozen points at most (tries every plane). Each point must be a corner of the hull;
// throws std::invalid_argument if the points lie in a plane.
Polyhedron convex_hull(std::span<const Vec3> points);

std::vector<Vec3> box_corners(const Vec3& half_extents);

struct SolidMass {
  double volume = 0;                 // m^3
  Vec3 center = Vec3::Zero();        // m
  Mat3 unit_inertia = Mat3::Zero();  // m^2: inertia about the centre for a mass of 1 kg
};
SolidMass solid_mass(const Polyhedron& solid);

}  // namespace skerry::peers
