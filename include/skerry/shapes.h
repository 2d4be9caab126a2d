// Collision shapes. All lengths in m, in the shape's own frame; the axis of capsule, cylinder and
// cone is +y; the local pose of a Shape places that frame in its body.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <skerry/types.h>

namespace skerry {

struct Sphere {
  double radius = 0.5;
  bool hollow = false;  // thin shell: changes the mass properties, not the contacts
};
struct Capsule {
  double radius = 0.5;
  double half_height = 0.5;  // of the cylindrical part
};
struct Box {
  Vec3 half_extents = {0.5, 0.5, 0.5};
};
struct Cylinder {
  double radius = 0.5;
  double half_height = 0.5;
};
// Apex at +half_height, base disc at -half_height. The centre of mass is a quarter of the height
// above the base.
struct Cone {
  double radius = 0.5;
  double half_height = 0.5;
};
struct Ellipsoid {
  Vec3 semi_axes = {0.5, 0.5, 0.5};
};
// The convex hull of the points times the scale; needs at least four that do not lie in a plane.
struct ConvexHull {
  std::vector<Vec3> points;
  Vec3 scale = {1, 1, 1};
};
// The half-space normal.x <= offset. Bodies with a plane must be fixed or kinematic.
struct Plane {
  Vec3 normal = {0, 1, 0};
  double offset = 0;
};
// Triangles over a shared vertex list, counter-clockwise seen from outside. A dynamic body needs a
// closed (watertight, consistently wound) mesh unless its mass is given.
struct MeshData {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
struct TriangleMesh {
  std::shared_ptr<const MeshData> data;
  Vec3 scale = {1, 1, 1};
};

// Heights over a regular grid; +y is up and the front. Sample (column c, row r) lies at
// (c, heights[r * columns + c], r), each cell is two triangles that meet in its diagonal from (c, r)
// to (c + 1, r + 1). Cell number r * (columns - 1) + c has the triangles 2 * cell (the side of
// greater z) and 2 * cell + 1.
struct HeightFieldData {
  std::uint32_t columns = 0, rows = 0;   // samples along x and z, at least 2 each
  std::vector<float> heights;            // [rows * columns]
  std::vector<std::uint8_t> holes = {};  // [cells] not 0: no surface there; empty: no holes
};
// Bodies with a height field must be fixed or kinematic.
struct HeightField {
  std::shared_ptr<const HeightFieldData> data;
  Vec3 scale = {1, 1, 1};  // of sample coordinates; x and z: m between samples
};

using ShapeGeometry = std::variant<Sphere, Capsule, Box, Cylinder, Cone, Ellipsoid, ConvexHull,
                                   Plane, TriangleMesh, HeightField>;

// Coulomb friction and Newtonian restitution. A pair combines by sqrt(a*b) for friction and
// max(a, b) for restitution and rolling resistance.
struct Material {
  double friction = 0.6;
  double restitution = 0.0;
  double rolling_resistance = 0.0;  // m: torque limit per newton of normal force
};

// Two shapes meet if each one's category is in the other's mask, unless they share a nonzero
// group: a positive group always meets, a negative one never.
struct Filter {
  std::uint32_t category = 1;
  std::uint32_t mask = 0xffffffffu;
  std::int32_t group = 0;
};

struct ShapeOptions {
  Pose local_pose = {};                             // in the body frame
  std::optional<double> density = std::nullopt;     // kg/m^3 (kg/m^2 for hollow); none: the body's
  std::optional<Material> material = std::nullopt;  // none: the body's
  Filter filter = {};
  bool sensor = false;  // reports overlaps, never pushes
};

// One shape of a body; several make a compound.
struct Shape {
  template <class Geometry>
  requires std::is_constructible_v<ShapeGeometry, Geometry> Shape(
      Geometry shape_geometry, ShapeOptions shape_options = {})  // NOLINT: implicit on purpose
      : geometry(std::move(shape_geometry)), options(std::move(shape_options)) {}

  ShapeGeometry geometry;
  ShapeOptions options;
};

}  // namespace skerry
