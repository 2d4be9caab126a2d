// Colliders: the shapes of bodies, one row each, placed relative to the body's centre of mass.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <skerry/shapes.h>

#include "core/bodies.h"
#include "core/vec.h"

namespace skerry::core {

// In the canonical order of pairs of types: a kernel for (a, b) exists with a <= b.
enum class ShapeType : std::uint8_t {
  sphere,
  capsule,
  box,
  cylinder,
  cone,
  ellipsoid,
  hull,
  plane,
  mesh,
  height_field,
};
inline constexpr int kShapeTypeCount = 10;
// A surface of triangles.
constexpr bool is_surface(ShapeType type) { return type >= ShapeType::mesh; }

// Rows of a hull for the separating-axis kernel; the collision room's business.
struct HullLanes;

// A convex polytope: outward faces with vertices counter-clockwise seen from outside, and half
// edges. The frame's origin is that of the shape. Built by collision::build_hull.
struct HullGeometry {
  struct Face {
    V3f normal;           // unit, outward
    float offset;         // m, normal.x on the face
    std::uint16_t first;  // into face_vertices
    std::uint16_t count;
  };
  struct Edge {
    std::uint16_t tail, head;  // vertices
    std::uint16_t left_face, right_face;
  };
  std::vector<V3f> vertices;
  std::vector<Face> faces;
  std::vector<std::uint16_t> face_vertices;
  std::vector<Edge> edges;  // each once, tail < head
  V3f center;               // m, of volume
  float inner_radius = 0;   // m, of the largest sphere about `center` inside
  std::shared_ptr<const HullLanes> lanes;
};

// A triangle mesh with its bounding-volume tree. Built by collision::build_mesh; the tree's layout
// is the collision room's business.
struct MeshTree;
struct MeshGeometry {
  std::vector<V3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<V3f> normals;  // [triangles] unit, to the front
  // [triangles] across the edges (v0v1, v1v2, v2v0): neighbour triangle, kNone at a border.
  std::vector<std::array<std::uint32_t, 3>> neighbours;
  // [triangles] bit e set: edge e is convex (may give edge contacts); clear: flat or concave.
  std::vector<std::uint8_t> convex_edges;
  // [triangles] rows of MeshData::triangles; empty: the same rows, for none was left out.
  std::vector<std::uint32_t> source;
  std::shared_ptr<const MeshTree> tree;
};

// Heights over a grid, see skerry::HeightField. Built by collision::build_height_field, which says
// how its triangles are numbered.
struct HeightFieldGeometry {
  static constexpr std::uint8_t kHole = 0x80;

  std::uint32_t columns = 0, rows = 0;  // samples along x and z
  double step_x = 1, step_z = 1;        // m
  std::vector<float> heights;           // m, [row * columns + column]
  float low = 0, high = 0;              // m, of all heights
  // [row * (columns - 1) + column] kHole, or bits 0-2 and 3-5: convex edges of its two triangles.
  std::vector<std::uint8_t> cells;
  std::shared_ptr<const MeshTree> blocks;  // items are blocks of 2 x 2 cells
};

struct Collider {
  ShapeType type = ShapeType::sphere;
  bool alive = false;
  bool sensor = false;
  bool has_local_rotation = false;
  float turn_radius = 0;  // m, how far a turn of the body by one radian can move a point of it
  BodyIndex body = kNone;
  ColliderIndex next_in_body = kNone;
  std::uint32_t shape_in_body = 0;  // position in BodyDesc::shapes

  V3f local_position{0, 0, 0};     // m, of the shape frame from the centre of mass, body axes
  Q4f local_rotation{0, 0, 0, 1};  // shape axes in body axes

  // sphere: radius,-,-; capsule, cylinder, cone: radius, half height,-; box: half extents;
  // ellipsoid: semi axes; plane: normal
  V3f size{0, 0, 0};
  double plane_offset = 0;  // m, along the normal, in the shape frame
  const HullGeometry* hull = nullptr;
  const MeshGeometry* mesh = nullptr;
  const HeightFieldGeometry* field = nullptr;

  float friction = 0.6f;
  float restitution = 0;
  float rolling_resistance = 0;  // m
  Filter filter;
};

struct Colliders {
  std::vector<Collider> rows;            // [ColliderIndex]; holes where !alive
  std::vector<ColliderIndex> free_rows;  // sorted descending
  // Keeps geometry alive; [ColliderIndex].
  std::vector<std::shared_ptr<const void>> geometry;
};

// skerry::Filter's rule.
bool filters_meet(const Filter& a, const Filter& b);

}  // namespace skerry::core
