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

// Contacts whose normals differ from the deepest's by less than this (14 degrees) share its manifold.
constexpr float kSameCluster = 0.97f;
// Points nearer to each other than this part of the shape's size are one.
constexpr float kSamePoint = 1e-3f;

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

  float longest() const {
    return std::max(max[0] - min[0], std::max(max[1] - min[1], max[2] - min[2]));
  }
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
    if (!over_face(*placed.triangle, p)) return;
    const float separation = dot(normal, face.points[0] - p);
    list.add(p + normal * (0.5f * separation), separation, facing.ids[0]);
  }
  list.choose(patch);
}

std::uint32_t feature_of(std::uint32_t triangle, std::uint32_t feature) {
  return (triangle * 0x9e3779b1u) ^ (feature * 0x85ebca77u);
}

void keep(const ContactPatch& patch, std::uint32_t triangle, MeshPoints& points) {
  if (patch.count == 0) return;
  const std::uint32_t contact = points.begin_contact(patch.normal);
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    const ContactPoint& point = patch.points[i];
    points.add(contact, point.position, point.separation, feature_of(triangle, point.feature));
  }
}

// Name of a face's corner: the same on whatever triangle it lies.
constexpr std::uint32_t kCornerFeature = 0x80000000u;

// A convex shape against batches of triangles; what it finds goes to `points`.
class TriangleCollider {
 public:
  TriangleCollider(const PlacedShape& shape, Query& query, MeshScratch& scratch)
      : shape_(shape), query_(query), scratch_(scratch), middle_(middle(shape)) {
    if (is_polytope(shape_)) prepare_search(shape, query.margin, scratch.box, scratch.search);
  }

  void collide(const PlacedShape& surface, std::span<const std::uint32_t> triangles) {
    const int count = static_cast<int>(triangles.size());
    TriangleBatch& batch = scratch_.batch;
    gather(*surface.collider, triangles);
    unsigned near = place_triangles({surface.center, surface.axes}, middle_, count, batch);
    if (shape_.collider->type == ShapeType::sphere) {
      near &= touch_triangles(shape_.center, shape_.collider->size.x + query_.margin, count, batch,
                              scratch_.touches);
    } else if (is_polytope(shape_)) {
      near &= search_triangles(scratch_.search, count, batch, scratch_.axes);
      clip(near & ~scratch_.axes.by_edges, triangles);
      near &= scratch_.axes.by_edges;
    } else if (shape_.collider->type == ShapeType::capsule) {
      touch_triangles(capsule_axis(), query_.margin, motion(), near, batch, scratch_.clips);
      keep_clips(triangles, TriangleClips::kNearest + 1);
      near = 0;
    } else if (has_cap()) {
      const CapLanes cap = cap_triangles(capped_shape(), query_.margin, near, batch, scratch_.axes);
      clip(cap.flat, triangles);
      near = cap.near & ~cap.flat;
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

  ClipQuery motion() const { return {query_.linear, query_.angular, query_.dt, query_.slop}; }

  CapsuleAxis capsule_axis() const {
    const V3f half = shape_.axes.c1 * shape_.collider->size.y;
    return {shape_.center - half, half * 2, shape_.collider->size.x};
  }

  bool has_cap() const {
    return shape_.collider->type == ShapeType::cylinder || shape_.collider->type == ShapeType::cone;
  }

  CappedShape capped_shape() const {
    return {shape_.center, shape_.axes, shape_.collider->size.x, shape_.collider->size.y,
            shape_.collider->type == ShapeType::cone};
  }

  // Triangles that take a face of the shape, face by face.
  void clip(unsigned lanes, std::span<const std::uint32_t> triangles) {
    const TriangleAxes& axes = scratch_.axes;
    while (lanes != 0) {
      const float facing = axes.facing[std::countr_zero(lanes)];
      unsigned same = 0;
      for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
        const int lane = std::countr_zero(rest);
        if (axes.facing[lane] == facing) same |= 1u << lane;
      }
      lanes &= ~same;
      set_face(static_cast<std::uint32_t>(facing));
      clip_triangles(face_, motion(), same, scratch_.batch, axes, scratch_.clips);
      keep_clips(triangles, TriangleClips::kCorners + static_cast<int>(face_.count));
    }
  }

  void set_face(std::uint32_t index) {
    if (face_index_ == index) return;
    face_index_ = index;
    const V3f normal = has_cap() ? cap_normal(shape_, index) : scratch_.search.face_normals[index];
    clip_face(shape_, index, normal, face_);
  }

  void keep_clips(std::span<const std::uint32_t> triangles, int most) {
    const TriangleClips& clips = scratch_.clips;
    unsigned any = 0;
    for (int i = 0; i < most; ++i) any |= clips.valid[i];
    std::uint32_t contact[TriangleBatch::kSize];
    for (; any != 0; any &= any - 1) {
      const int lane = std::countr_zero(any);
      contact[lane] = scratch_.points.begin_contact(
          {clips.normal[0][lane], clips.normal[1][lane], clips.normal[2][lane]});
    }
    for (int i = 0; i < most; ++i) {
      const TriangleClips::Candidate& from = clips.candidates[i];
      for (unsigned lanes = clips.valid[i]; lanes != 0; lanes &= lanes - 1) {
        const int lane = std::countr_zero(lanes);
        const std::uint32_t triangle = triangles[static_cast<std::size_t>(lane)];
        scratch_.points.add(
            contact[lane], {from.position[0][lane], from.position[1][lane], from.position[2][lane]},
            from.separation[lane], clip_feature(i, from.side[lane], triangle));
      }
    }
  }
  std::uint32_t clip_feature(int candidate, float side, std::uint32_t triangle) const {
    if (shape_.collider->type == ShapeType::capsule)
      return feature_of(triangle, static_cast<std::uint32_t>(candidate));
    if (candidate >= TriangleClips::kCorners)
      return kCornerFeature | face_.ids[candidate - TriangleClips::kCorners];
    const auto edge = static_cast<std::uint32_t>(candidate);
    const std::uint32_t of_face = side < 0 ? 0 : 1 + face_.ids[static_cast<int>(side)];
    return feature_of(triangle, of_face * TriangleClips::kCorners + edge);
  }

  void collide_lane(int lane, ContactPatch& patch) {
    if (shape_.collider->type == ShapeType::sphere) return collide_sphere(lane, patch);
    const Triangle triangle = triangle_of(scratch_.batch, lane);
    PlacedShape placed;
    placed.triangle = &triangle;
    placed.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    if (is_polytope(shape_))
      return edge_triangle(shape_, placed, scratch_.search, scratch_.axes, lane, query_, patch);
    const float lowest =
        dot(triangle.normal, shape_.center - triangle.corner[0]) - extent(shape_, -triangle.normal);
    if (lowest > query_.margin) return;
    if (meets_face(triangle)) return face_contact(shape_, placed, query_, patch);
    query_.cache = 0;
    if (!convex_convex(shape_, placed, query_, patch)) {
      ++failures_;
    } else if (patch.count > 0 && leans_too_far(triangle, -patch.normal)) {
      patch.count = 0;
      face_contact(shape_, placed, query_, patch);
    }
  }

  // Does the shape reach through the triangle's plane farthest over the triangle itself?
  bool meets_face(const Triangle& triangle) const {
    return over_face(triangle, farthest_point(shape_, -triangle.normal));
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
  ClipFace face_;
  std::uint32_t face_index_ = 0xffffffffu;  // of `face_`
  std::uint32_t failures_ = 0;
};

}  // namespace

void gather_patches(MeshPoints& points, float near, PatchSet& patches) {
  patches.count = 0;
  PointChoice choice;
  choice.near = near;
  while (patches.count < core::kMeshManifolds) {
    const MeshPoints::Contact* deepest = points.deepest(choice.near);
    if (deepest == nullptr) return;
    ContactPatch& patch = patches.patch[patches.count];
    choice.patch = static_cast<float>(patches.count++);
    const MeshPoints::Taken taken = points.take(deepest->normal, kSameCluster, choice.patch);
    patch.normal = choice.normal = taken.normal;
    choice.deep = taken.separation + choice.near;
    choose_spread(points.blocks(), choice);
    patch.count = choice.count;
    for (std::uint32_t i = 0; i < choice.count; ++i) patch.points[i] = points.at(choice.index[i]);
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
  query.apart = 0;  // what the kernels said is of one triangle each
  const float size = bounds.longest() - 2 * query.margin;  // a fast shape is no larger
  gather_patches(scratch.points, kSamePoint * size, patches);
  return collider.failures();
}

void plane_mesh(const PlacedShape& plane, const PlacedShape& mesh, Query& query,
                MeshScratch& scratch, PatchSet& patches) {
  const V3f up = direction(plane.axes * plane.collider->size, {0, 1, 0});
  const V3f along = transposed_times(mesh.axes, up);
  const std::vector<V3f>& vertices = mesh.collider->mesh->vertices;
  scratch.points.clear();
  const std::uint32_t contact = scratch.points.begin_contact(up);
  for (std::uint32_t i = 0; i < vertices.size(); ++i) {
    const float separation = plane.height + dot(along, vertices[i]);
    if (separation > query.margin) continue;
    const V3f position = mesh.center + mesh.axes * vertices[i] - up * (0.5f * separation);
    if (query.predicted(position, up, separation) <= query.slop)
      scratch.points.add(contact, position, separation, i);
  }
  gather_patches(scratch.points, kSamePoint * scratch.points.spread(), patches);
}

}  // namespace skerry::collision
