#include "collision/narrowphase_mesh.h"

#include <algorithm>
#include <cmath>

#include "collision/height_field.h"
#include "collision/mesh_tree.h"

namespace skerry::collision {

using core::cross;
using core::dot;
using core::MeshGeometry;
using core::transposed_times;

namespace {

// Contacts whose normals differ by less than this (14 degrees) share a manifold.
constexpr float kSameCluster = 0.97f;

V3f normal_of(const MeshGeometry& mesh, std::uint32_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const V3f a = mesh.vertices[t[0]];
  return direction(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a), {0, 1, 0});
}

// A triangle of a placed mesh.
Triangle triangle_at(const PlacedShape& placed, std::uint32_t index) {
  if (placed.collider->type == ShapeType::height_field) return field_triangle(placed, index);
  const MeshGeometry& mesh = *placed.collider->mesh;
  const auto& corners = mesh.triangles[index];
  Triangle t;
  t.index = index;
  for (int i = 0; i < 3; ++i)
    t.corner[i] = placed.center + placed.axes * mesh.vertices[corners[static_cast<unsigned>(i)]];
  t.normal = placed.axes * normal_of(mesh, index);
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t neighbour = mesh.neighbours[index][static_cast<unsigned>(i)];
    const bool border = neighbour == core::kNone;
    t.touchable[i] = border || (mesh.convex_edges[index] >> i & 1) != 0;
    if (!t.touchable[i]) continue;
    t.beyond[i] = border ? direction(cross(t.corner[(i + 1) % 3] - t.corner[i], t.normal), t.normal)
                         : placed.axes * normal_of(mesh, neighbour);
  }
  return t;
}

// Bounds of a shape in a mesh's frame, grown by a margin.
struct Bounds {
  float min[3], max[3];
};
Bounds bounds_in(const PlacedShape& mesh, const PlacedShape& shape, float margin) {
  const V3f center = transposed_times(mesh.axes, shape.center - mesh.center);
  const float c[3] = {center.x, center.y, center.z};
  const V3f axis[3] = {mesh.axes.c0, mesh.axes.c1, mesh.axes.c2};
  Bounds bounds;
  for (int i = 0; i < 3; ++i) {
    // Rounding far from the mesh's origin must not lose what touches.
    const float slack = margin + 1e-6f * std::fabs(c[i]);
    bounds.min[i] = c[i] - extent(shape, -axis[i]) - slack;
    bounds.max[i] = c[i] + extent(shape, axis[i]) + slack;
  }
  return bounds;
}

V3f middle(const PlacedShape& shape) {
  if (shape.collider->type != ShapeType::hull) return shape.center;
  return shape.center + shape.axes * shape.collider->hull->center;
}

// The contact of the triangle's face, whatever else may be nearer: for shapes that reach through.
void face_contact(const PlacedShape& shape, const PlacedShape& placed, const Query& query,
                  ContactPatch& patch) {
  const V3f normal = -placed.triangle->normal;
  Feature facing, face;
  facing_feature(shape, normal, facing);
  facing_feature(placed, -normal, face);
  PointList list(query, normal);
  if (facing.count > 1) {
    clip_features(facing, face, normal, list);
  } else {
    const V3f p = facing.points[0];
    for (int i = 0; i < 3; ++i) {
      const V3f tail = face.points[i], head = face.points[(i + 1) % 3];
      if (dot(cross(placed.triangle->normal, head - tail), p - tail) < 0) return;
    }
    const float separation = dot(normal, face.points[0] - p);
    list.add(p + normal * (0.5f * separation), separation, facing.ids[0]);
  }
  list.choose(patch);
}

// One triangle; false if no contact could be computed.
bool collide_triangle(const PlacedShape& shape, const PlacedShape& placed, Query& query,
                      ContactPatch& patch) {
  patch.count = 0;
  query.cache = 0;
  switch (shape.collider->type) {
    case ShapeType::sphere:
      sphere_triangle(shape, placed, query, patch);
      return true;
    case ShapeType::capsule:
      capsule_triangle(shape, placed, query, patch);
      return true;
    case ShapeType::box:
    case ShapeType::hull:
      polytope_polytope(shape, placed, query, patch);
      return true;
    default:
      break;
  }
  if (!convex_convex(shape, placed, query, patch)) return false;
  if (patch.count > 0 && leans_too_far(*placed.triangle, -patch.normal)) {
    patch.count = 0;
    face_contact(shape, placed, query, patch);
  }
  return true;
}

std::uint32_t feature_of(std::uint32_t triangle, std::uint32_t feature) {
  return (triangle * 0x9e3779b1u) ^ (feature * 0x85ebca77u);
}

void keep(const ContactPatch& patch, std::uint32_t triangle, std::vector<MeshPoint>& points) {
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    MeshPoint point{patch.normal, patch.points[i]};
    point.point.feature = feature_of(triangle, point.point.feature);
    points.push_back(point);
  }
}

// Points of one cluster go to `cluster` and out of `points`; those that coincide (corners shared by
// triangles) only once.
void take_cluster(const V3f& normal, float near, MeshScratch& scratch) {
  scratch.cluster.clear();
  std::size_t left = 0;
  for (const MeshPoint& candidate : scratch.points) {
    if (dot(candidate.normal, normal) < kSameCluster) {
      scratch.points[left++] = candidate;
      continue;
    }
    const auto coincides = [&](const ContactPoint& other) {
      const V3f r = other.position - candidate.point.position;
      return dot(r, r) < near * near;
    };
    if (std::none_of(scratch.cluster.begin(), scratch.cluster.end(), coincides))
      scratch.cluster.push_back(candidate.point);
  }
  scratch.points.resize(left);
}

float spread(const std::vector<MeshPoint>& points) {
  float squared = 0;
  for (const MeshPoint& p : points) {
    const V3f r = p.point.position - points[0].point.position;
    squared = std::max(squared, dot(r, r));
  }
  return std::sqrt(squared);
}

}  // namespace

void gather_patches(MeshScratch& scratch, PatchSet& patches) {
  patches.count = 0;
  const float near = 1e-3f * spread(scratch.points);
  while (!scratch.points.empty() && patches.count < core::kMeshManifolds) {
    const MeshPoint* deepest = &scratch.points[0];
    for (const MeshPoint& p : scratch.points)
      if (p.point.separation < deepest->point.separation - near) deepest = &p;
    const V3f normal = deepest->normal;
    take_cluster(normal, near, scratch);
    choose_points(scratch.cluster.data(), static_cast<std::uint32_t>(scratch.cluster.size()),
                  normal, patches.patch[patches.count++]);
  }
}

std::uint32_t convex_mesh(const PlacedShape& a, const PlacedShape& b, Query& query,
                          MeshScratch& scratch, PatchSet& patches) {
  const Bounds bounds = bounds_in(b, a, query.margin);
  scratch.triangles.clear();
  scratch.points.clear();
  if (b.collider->type == ShapeType::height_field)
    find_field_triangles(*b.collider->field, bounds.min, bounds.max, scratch.triangles);
  else
    b.collider->mesh->tree->query(bounds.min, bounds.max, scratch.triangles);
  std::uint32_t failures = 0;
  const V3f center = middle(a);
  for (const std::uint32_t index : scratch.triangles) {
    const Triangle triangle = triangle_at(b, index);
    if (dot(triangle.normal, center - triangle.corner[0]) < 0) continue;
    const float lowest =
        dot(triangle.normal, a.center - triangle.corner[0]) - extent(a, -triangle.normal);
    if (lowest > query.margin) continue;
    PlacedShape placed;
    placed.triangle = &triangle;
    placed.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    ContactPatch patch;
    if (!collide_triangle(a, placed, query, patch)) ++failures;
    keep(patch, index, scratch.points);
  }
  query.cache = 0;
  gather_patches(scratch, patches);
  return failures;
}

void plane_mesh(const PlacedShape& plane, const PlacedShape& mesh, Query& query,
                MeshScratch& scratch, PatchSet& patches) {
  const V3f up = direction(plane.axes * plane.collider->size, {0, 1, 0});
  const V3f along = transposed_times(mesh.axes, up);
  const std::vector<V3f>& vertices = mesh.collider->mesh->vertices;
  scratch.points.clear();
  for (std::uint32_t i = 0; i < vertices.size(); ++i) {
    const float separation = plane.height + dot(along, vertices[i]);
    if (separation > query.margin) continue;
    const V3f position = mesh.center + mesh.axes * vertices[i] - up * (0.5f * separation);
    if (query.predicted(position, up, separation) <= query.slop)
      scratch.points.push_back({up, {position, separation, i}});
  }
  gather_patches(scratch, patches);
}

}  // namespace skerry::collision
