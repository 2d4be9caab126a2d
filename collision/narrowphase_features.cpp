// What a convex shape turns towards another: a face, an edge or a point.
#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"
#include "collision/polytope_axes.h"

namespace skerry::collision {

using core::dot;
using core::HullGeometry;
using core::transposed_times;

namespace {

// Corners of the polygon that stands for a disc.
constexpr int kRim = 16;
constexpr std::uint16_t kLowestId = kRim;  // the point of a rim that reaches farthest
constexpr std::uint16_t kApexId = kRim + 1;
// Cosines of 2 pi k / 16 for k = 0..4.
constexpr float kCosine[5] = {1.0f, 0.92387953f, 0.70710678f, 0.38268343f, 0.0f};

// A direction this close to a right angle with a cylinder's or capsule's axis sees its side.
constexpr float kSideCosine = 0.1f;
constexpr float kCapsuleSideCosine = 0.3f;
// A direction this close to the normal of a cone's mantle sees a line of it.
constexpr float kMantleCosine = 0.995f;

void add(Feature& feature, const V3f& point, std::uint32_t id) {
  feature.points[feature.count] = point;
  feature.ids[feature.count++] = static_cast<std::uint16_t>(id);
}

float rim_cosine(int k) {
  k &= kRim - 1;
  const int quarter = k & 3;
  switch (k >> 2) {
    case 0:
      return kCosine[quarter];
    case 1:
      return -kCosine[4 - quarter];
    case 2:
      return -kCosine[quarter];
    default:
      return kCosine[4 - quarter];
  }
}

// The direction split along a shape's y axis.
struct Split {
  float along;   // cosine with the axis
  float across;  // sine
  V3f radial;    // unit, at right angles to the axis
};
Split split(const PlacedShape& shape, const V3f& toward) {
  const V3f axis = shape.axes.c1;
  const float along = dot(axis, toward);
  const V3f rest = toward - axis * along;
  const V3f radial = direction(rest, shape.axes.c0);
  return {along, dot(rest, radial), radial};
}

// Rim of a disc about the y axis, counter-clockwise seen along -`side` y. The point that reaches
// farthest joins it where the fixed corners, which are stable, would fall short visibly.
void add_rim(const PlacedShape& shape, const Split& split, float side, float y, float radius,
             Feature& feature) {
  const V3f center = shape.center + shape.axes.c1 * y;
  const V3f u = shape.axes.c0 * radius, v = shape.axes.c2 * (-side * radius);
  const float cu = dot(split.radial, shape.axes.c0), cv = dot(split.radial, shape.axes.c2) * -side;
  float reach = -2;  // cosine with the nearest corner
  int nearest = 0;
  for (int k = 0; k < kRim; ++k) {
    const float cosine = cu * rim_cosine(k) + cv * rim_cosine(k - kRim / 4);
    if (cosine > reach) {
      reach = cosine;
      nearest = k;
    }
  }
  const bool lowest = split.across * (1 - reach) > 1e-3f;
  // Does the farthest point come before or after its nearest corner?
  const float turn = rim_cosine(nearest) * cv - rim_cosine(nearest - kRim / 4) * cu;
  for (int k = 0; k < kRim; ++k) {
    if (lowest && k == nearest && turn < 0) add(feature, center + split.radial * radius, kLowestId);
    add(feature, center + u * rim_cosine(k) + v * rim_cosine(k - kRim / 4),
        static_cast<std::uint32_t>(side > 0 ? k : (kRim - k) & (kRim - 1)));
    if (lowest && k == nearest && turn >= 0)
      add(feature, center + split.radial * radius, kLowestId);
  }
}

void cylinder_feature(const PlacedShape& shape, const V3f& toward, Feature& feature) {
  const float radius = shape.collider->size.x, half = shape.collider->size.y;
  const Split s = split(shape, toward);
  if (std::fabs(s.along) > kSideCosine) {
    const float side = s.along > 0 ? 1.0f : -1.0f;
    add_rim(shape, s, side, side * half, radius, feature);
    return;
  }
  const V3f line = shape.center + s.radial * radius;
  add(feature, line - shape.axes.c1 * half, kLowestId);
  add(feature, line + shape.axes.c1 * half, kApexId);
}

void cone_feature(const PlacedShape& shape, const V3f& toward, Feature& feature) {
  const float radius = shape.collider->size.x, half = shape.collider->size.y;
  const Split s = split(shape, toward);
  const V3f apex = shape.center + shape.axes.c1 * half;
  const V3f rim = shape.center - shape.axes.c1 * half + s.radial * radius;
  const float slant = std::sqrt(4 * half * half + radius * radius);
  if (2 * half * s.across + radius * s.along > kMantleCosine * slant) {
    add(feature, rim, kLowestId);
    add(feature, apex, kApexId);
  } else if (2 * half * s.along > radius * s.across) {
    add(feature, apex, kApexId);
  } else if (s.along < -kSideCosine) {
    add_rim(shape, s, -1, -half, radius, feature);
  } else {
    add(feature, rim, kLowestId);
  }
}

void capsule_feature(const PlacedShape& shape, const V3f& toward, Feature& feature) {
  const V3f middle = shape.center + toward * shape.collider->size.x;
  const V3f half = shape.axes.c1 * shape.collider->size.y;
  const float along = dot(shape.axes.c1, toward);
  if (along < kCapsuleSideCosine) add(feature, middle - half, 0);
  if (along > -kCapsuleSideCosine) add(feature, middle + half, 1);
}

void box_feature(const PlacedShape& shape, const V3f& toward, Feature& feature) {
  const V3f half = shape.collider->size;
  const V3f edge[3] = {shape.axes.c0 * half.x, shape.axes.c1 * half.y, shape.axes.c2 * half.z};
  const V3f t = transposed_times(shape.axes, toward);
  const float local[3] = {t.x, t.y, t.z};
  int axis = std::fabs(t.y) > std::fabs(t.x) ? 1 : 0;
  if (std::fabs(t.z) > std::fabs(local[axis])) axis = 2;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const float side = local[axis] < 0 ? -1.0f : 1.0f;
  const V3f middle = shape.center + edge[axis] * side;
  constexpr float kSigns[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (int k = 0; k < 4; ++k) {
    const float su = kSigns[k][0] * side, sv = kSigns[k][1];
    const unsigned id =
        (side > 0 ? 1u << axis : 0) | (su > 0 ? 1u << u : 0) | (sv > 0 ? 1u << v : 0);
    add(feature, middle + edge[u] * su + edge[v] * sv, id);
  }
}

void ellipsoid_feature(const PlacedShape& shape, const V3f& toward, Feature& feature) {
  const V3f s = shape.collider->size, t = transposed_times(shape.axes, toward);
  const V3f scaled{s.x * t.x, s.y * t.y, s.z * t.z};
  const V3f unit = direction(scaled, {0, 1, 0});
  add(feature, shape.center + shape.axes * V3f{s.x * unit.x, s.y * unit.y, s.z * unit.z}, 0);
}

}  // namespace

void face_feature(const PlacedShape& shape, std::uint32_t index, Feature& feature) {
  const HullGeometry& hull = *shape.collider->hull;
  const HullGeometry::Face& face = hull.faces[index];
  // Faces of more corners than fit are thinned out evenly.
  const std::uint32_t kept = std::min<std::uint32_t>(face.count, Feature::kMaxPoints);
  feature.count = 0;
  for (std::uint32_t i = 0; i < kept; ++i) {
    const std::uint32_t corner = kept == face.count ? i : i * std::uint32_t{face.count} / kept;
    const std::uint16_t vertex = hull.face_vertices[face.first + corner];
    add(feature, shape.center + shape.axes * hull.vertices[vertex], vertex);
  }
}

void facing_feature(const PlacedShape& shape, const V3f& toward, Feature& feature) {
  feature.count = 0;
  if (shape.triangle != nullptr) {
    for (std::uint32_t i = 0; i < 3; ++i) add(feature, shape.center + shape.triangle->corner[i], i);
    return;
  }
  switch (shape.collider->type) {
    case ShapeType::sphere:
      add(feature, shape.center + toward * shape.collider->size.x, 0);
      break;
    case ShapeType::capsule:
      capsule_feature(shape, toward, feature);
      break;
    case ShapeType::box:
      box_feature(shape, toward, feature);
      break;
    case ShapeType::cylinder:
      cylinder_feature(shape, toward, feature);
      break;
    case ShapeType::cone:
      cone_feature(shape, toward, feature);
      break;
    case ShapeType::ellipsoid:
      ellipsoid_feature(shape, toward, feature);
      break;
    case ShapeType::hull:
      face_feature(
          shape,
          facing_face(shape.collider->hull->lanes->view, transposed_times(shape.axes, toward)),
          feature);
      break;
    case ShapeType::plane:
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
}

float extent(const PlacedShape& shape, const V3f& along) {
  if (shape.triangle != nullptr) {
    const V3f* c = shape.triangle->corner;
    return std::max(dot(along, c[0]), std::max(dot(along, c[1]), dot(along, c[2])));
  }
  const V3f s = shape.collider->size, d = transposed_times(shape.axes, along);
  const float long_across = std::sqrt(d.x * d.x + d.z * d.z), whole = core::length(along);
  switch (shape.collider->type) {
    case ShapeType::sphere:
      return s.x * whole;
    case ShapeType::capsule:
      return s.x * whole + s.y * std::fabs(d.y);
    case ShapeType::box:
      return s.x * std::fabs(d.x) + s.y * std::fabs(d.y) + s.z * std::fabs(d.z);
    case ShapeType::cylinder:
      return s.x * long_across + s.y * std::fabs(d.y);
    case ShapeType::cone:
      return std::max(s.y * d.y, s.x * long_across - s.y * d.y);
    case ShapeType::ellipsoid:
      return core::length(V3f{s.x * d.x, s.y * d.y, s.z * d.z});
    case ShapeType::hull: {
      float best = -3e38f;
      for (const V3f& v : shape.collider->hull->vertices) best = std::max(best, dot(d, v));
      return best;
    }
    case ShapeType::plane:
    case ShapeType::mesh:
    case ShapeType::height_field:
      break;
  }
  return 0;
}

V3f farthest_point(const PlacedShape& shape, const V3f& along) {
  const float radius = shape.collider->size.x, half = shape.collider->size.y;
  Feature feature;
  switch (shape.collider->type) {
    case ShapeType::cylinder: {
      const Split s = split(shape, along);
      return shape.center + shape.axes.c1 * (s.along > 0 ? half : -half) + s.radial * radius;
    }
    case ShapeType::cone: {
      const Split s = split(shape, along);
      if (2 * half * s.along > radius * s.across) return shape.center + shape.axes.c1 * half;
      return shape.center - shape.axes.c1 * half + s.radial * radius;
    }
    default:
      facing_feature(shape, along, feature);
      return feature.points[0];
  }
}

Corner farthest_corner(const PlacedShape& shape, const V3f& along) {
  const V3f d = transposed_times(shape.axes, along);
  if (shape.collider->type == ShapeType::box) {
    const V3f h = shape.collider->size;
    const V3f p{d.x > 0 ? h.x : -h.x, d.y > 0 ? h.y : -h.y, d.z > 0 ? h.z : -h.z};
    const unsigned id = (d.x > 0 ? 1u : 0) | (d.y > 0 ? 2u : 0) | (d.z > 0 ? 4u : 0);
    return {shape.center + shape.axes * p, static_cast<std::uint16_t>(id)};
  }
  const auto& vertices = shape.collider->hull->vertices;
  std::size_t best = 0;
  for (std::size_t i = 1; i < vertices.size(); ++i)
    if (dot(d, vertices[i]) > dot(d, vertices[best])) best = i;
  return {shape.center + shape.axes * vertices[best], static_cast<std::uint16_t>(best)};
}

namespace {

// Height of a shape's point over a plane, and the contact there.
void add_over_plane(const PlacedShape& shape, const PlacedShape& plane, const V3f& up,
                    const V3f& point, std::uint32_t id, PointList& list) {
  const float separation = plane.height + dot(up, point - shape.center);
  list.add(point - up * (0.5f * separation), separation, id);
}

// The face of a hull that looks down most need not hold its lowest vertex.
void add_lowest_vertex(const PlacedShape& shape, const PlacedShape& plane, const V3f& up,
                       const Feature& feature, PointList& list) {
  const Corner lowest = farthest_corner(shape, -up);
  const std::uint16_t* end = feature.ids + feature.count;
  if (std::find(feature.ids, end, lowest.id) != end) return;
  add_over_plane(shape, plane, up, lowest.point, lowest.id, list);
}

}  // namespace

void convex_plane(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch) {
  const V3f up = direction(b.axes * b.collider->size, {0, 1, 0});
  Feature feature;
  facing_feature(a, -up, feature);
  PointList list(query, -up);
  for (std::uint32_t i = 0; i < feature.count; ++i)
    add_over_plane(a, b, up, feature.points[i], feature.ids[i], list);
  if (a.collider->type == ShapeType::hull) add_lowest_vertex(a, b, up, feature, list);
  list.choose(patch);
}

}  // namespace skerry::collision
