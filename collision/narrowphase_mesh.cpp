#include "collision/narrowphase_mesh.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

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

SurfaceTriangle mesh_triangle(const MeshGeometry& mesh, std::uint32_t index) {
  SurfaceTriangle t;
  const auto& corners = mesh.triangles[index];
  for (unsigned i = 0; i < 3; ++i) t.corner[i] = mesh.vertices[corners[i]];
  t.normal = mesh.normals[index];
  t.touchable = mesh.convex_edges[index];
  for (unsigned i = 0; i < 3; ++i) {
    const std::uint32_t neighbour = mesh.neighbours[index][i];
    if (neighbour == core::kNone)
      t.border |= 1u << i;
    else if (t.touchable >> i & 1)
      t.beyond[i] = mesh.normals[neighbour];
  }
  t.touchable |= t.border;
  return t;
}

// The triangle in a lane, once it is placed.
Triangle triangle_of(const TriangleBatch& batch, int lane) {
  const auto row = [&](int first) {
    return V3f{batch.rows[first][lane], batch.rows[first + 1][lane], batch.rows[first + 2][lane]};
  };
  Triangle t;
  t.normal = row(TriangleBatch::kNormal);
  for (int i = 0; i < 3; ++i) {
    t.corner[i] = row(TriangleBatch::kCorner + 3 * i);
    t.beyond[i] = row(TriangleBatch::kBeyond + 3 * i);
    t.touchable[i] = batch.rows[TriangleBatch::kTouchable + i][lane] > 0;
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
  scratch.places.clear();
  std::size_t left = 0;
  for (const MeshPoint& candidate : scratch.points) {
    if (dot(candidate.normal, normal) < kSameCluster) {
      scratch.points[left++] = candidate;
    } else if (!scratch.places.hold_one_near(candidate.point.position, near * near)) {
      scratch.places.add(candidate.point.position);
      scratch.cluster.push_back(candidate.point);
    }
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

// A convex shape against batches of triangles; what it finds goes to `points`.
class TriangleCollider {
 public:
  TriangleCollider(const PlacedShape& shape, Query& query, MeshScratch& scratch)
      : shape_(shape), query_(query), scratch_(scratch), middle_(middle(shape)) {
    if (is_polytope()) prepare_search(shape, query.margin, scratch.box, scratch.search);
  }

  void collide(const PlacedShape& surface, std::span<const std::uint32_t> triangles) {
    const int count = static_cast<int>(triangles.size());
    TriangleBatch& batch = scratch_.batch;
    gather(*surface.collider, triangles);
    unsigned near = place_triangles({surface.center, surface.axes}, middle_, count, batch);
    if (shape_.collider->type == ShapeType::sphere) {
      near &= touch_triangles(shape_.center, shape_.collider->size.x + query_.margin, count, batch,
                              scratch_.touches);
    } else if (is_polytope()) {
      near &= search_triangles(scratch_.search, count, batch, scratch_.axes);
    }
    for (; near != 0; near &= near - 1) {
      const int lane = std::countr_zero(near);
      ContactPatch patch;
      patch.count = 0;
      collide_lane(lane, patch);
      keep(patch, triangles[static_cast<std::size_t>(lane)], scratch_.points);
    }
  }
  std::uint32_t failures() const { return failures_; }

 private:
  bool is_polytope() const {
    return shape_.collider->type == ShapeType::box || shape_.collider->type == ShapeType::hull;
  }

  void gather(const Collider& surface, std::span<const std::uint32_t> triangles) {
    TriangleBatch& batch = scratch_.batch;
    int lane = 0;
    for (const std::uint32_t index : triangles)
      batch.put(lane++, surface.type == ShapeType::height_field
                            ? field_triangle(*surface.field, index)
                            : mesh_triangle(*surface.mesh, index));
    // The last lanes of a short batch: any triangle will do.
    if (lane < TriangleBatch::kSize)
      for (auto& row : batch.rows) std::fill(row + lane, row + TriangleBatch::kSize, row[0]);
  }

  void collide_lane(int lane, ContactPatch& patch) {
    if (shape_.collider->type == ShapeType::sphere) return collide_sphere(lane, patch);
    const Triangle triangle = triangle_of(scratch_.batch, lane);
    PlacedShape placed;
    placed.triangle = &triangle;
    placed.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    if (is_polytope())
      return polytope_triangle(shape_, placed, scratch_.search, scratch_.axes, lane, query_, patch);
    const float lowest =
        dot(triangle.normal, shape_.center - triangle.corner[0]) - extent(shape_, -triangle.normal);
    if (lowest > query_.margin) return;
    if (shape_.collider->type == ShapeType::capsule)
      return capsule_triangle(shape_, placed, query_, patch);
    query_.cache = 0;
    if (!convex_convex(shape_, placed, query_, patch)) {
      ++failures_;
    } else if (patch.count > 0 && leans_too_far(triangle, -patch.normal)) {
      patch.count = 0;
      face_contact(shape_, placed, query_, patch);
    }
  }

  void collide_sphere(int lane, ContactPatch& patch) {
    const TriangleTouches& touches = scratch_.touches;
    const V3f out{touches.out[0][lane], touches.out[1][lane], touches.out[2][lane]};
    const float radius = shape_.collider->size.x;
    const float separation = touches.distance[lane] - radius;
    single_point(query_, -out, shape_.center - out * (radius + 0.5f * separation), separation, 0,
                 patch);
  }

  const PlacedShape& shape_;
  Query& query_;
  MeshScratch& scratch_;
  V3f middle_;
  std::uint32_t failures_ = 0;
};

}  // namespace

// No early exit, so that the compiler takes several at a time.
bool Places::hold_one_near(const V3f& position, float squared) const {
  unsigned near = 0;
  const std::size_t count = x_.size();
  const float *x = x_.data(), *y = y_.data(), *z = z_.data();
  for (std::size_t i = 0; i < count; ++i) {
    const V3f r{x[i] - position.x, y[i] - position.y, z[i] - position.z};
    near |= dot(r, r) < squared ? 1u : 0u;
  }
  return near != 0;
}

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
  TriangleCollider collider(a, query, scratch);
  const std::span<const std::uint32_t> triangles = scratch.triangles;
  for (std::size_t first = 0; first < triangles.size(); first += TriangleBatch::kSize)
    collider.collide(b, triangles.subspan(first, std::min<std::size_t>(TriangleBatch::kSize,
                                                                       triangles.size() - first)));
  query.cache = 0;
  gather_patches(scratch, patches);
  return collider.failures();
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
