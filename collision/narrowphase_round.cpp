// Spheres and capsules against each other and against boxes and hulls.
#include <algorithm>
#include <array>
#include <cmath>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

using core::cross;
using core::dot;
using core::HullGeometry;
using core::length;
using core::transposed_times;

namespace {

// Capsules closer to parallel than this (sine of the angle, about 3 degrees) touch in two points.
constexpr float kParallelSine = 0.05f;
// A box axis closer than this to a right angle with the normal is one along which a capsule may
// touch in two points.
constexpr float kAcross = 0.05f;

float radius(const PlacedShape& shape) { return shape.collider->size.x; }
float half_height(const PlacedShape& shape) { return shape.collider->size.y; }
float clamp(float value, float low, float high) { return std::min(std::max(value, low), high); }

// Two balls about points of their shapes. `otherwise` is the normal if the points coincide.
void balls(const V3f& pa, float ra, const V3f& pb, float rb, const V3f& otherwise, Query& query,
           ContactPatch& patch) {
  const V3f r = pb - pa;
  const V3f normal = direction(r, otherwise);
  const float separation = dot(r, normal) - (ra + rb);
  query.apart = separation;
  single_point(query, normal, pa + normal * (ra + 0.5f * separation), separation, 0, patch);
}

V3f component(int axis) {
  return {axis == 0 ? 1.0f : 0, axis == 1 ? 1.0f : 0, axis == 2 ? 1.0f : 0};
}
float component(const V3f& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

V3f clamped(const V3f& p, const V3f& half) {
  return {clamp(p.x, -half.x, half.x), clamp(p.y, -half.y, half.y), clamp(p.z, -half.z, half.z)};
}

// Axis and depth (<= 0 inside) of the face of a box nearest to a point.
struct BoxFace {
  int axis;
  float separation;
};
BoxFace nearest_face(const V3f& p, const V3f& half) {
  BoxFace face{0, std::fabs(p.x) - half.x};
  if (std::fabs(p.y) - half.y > face.separation) face = {1, std::fabs(p.y) - half.y};
  if (std::fabs(p.z) - half.z > face.separation) face = {2, std::fabs(p.z) - half.z};
  return face;
}

}  // namespace

void sphere_sphere(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch) {
  balls(a.center, radius(a), b.center, radius(b), {0, 1, 0}, query, patch);
}

void sphere_capsule(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch) {
  const V3f axis = b.axes.c1;
  const float along = clamp(dot(a.center - b.center, axis), -half_height(b), half_height(b));
  balls(a.center, radius(a), b.center + axis * along, radius(b), perpendicular(axis), query, patch);
}

void sphere_box(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch) {
  const V3f half = b.collider->size;
  const V3f p = transposed_times(b.axes, a.center - b.center);
  const V3f outside = p - clamped(p, half);
  const float squared = dot(outside, outside);
  V3f out;  // from the box to the sphere, box axes
  float separation;
  if (squared > 1e-30f) {
    const float distance = std::sqrt(squared);
    out = outside * (1 / distance);
    separation = distance - radius(a);
  } else {
    const BoxFace face = nearest_face(p, half);
    out = component(face.axis) * (component(p, face.axis) < 0 ? -1.0f : 1.0f);
    separation = face.separation - radius(a);
  }
  const V3f normal = -(b.axes * out);
  query.apart = separation;
  single_point(query, normal, a.center + normal * (radius(a) + 0.5f * separation), separation, 0,
               patch);
}

namespace {

struct Nearest {
  V3f point;
  float squared;
};

// Nearest point of a face of a hull; `p` is in front of it by `height`.
Nearest nearest_on_face(const HullGeometry& hull, const HullGeometry::Face& face, const V3f& p,
                        float height) {
  const std::uint16_t* vertex = hull.face_vertices.data() + face.first;
  Nearest nearest{p - face.normal * height, height * height};
  bool inside = true;
  for (std::uint32_t i = 0; i < face.count; ++i) {
    const V3f v = hull.vertices[vertex[i]];
    const V3f edge = hull.vertices[vertex[i + 1 < face.count ? i + 1 : 0]] - v;
    if (dot(cross(edge, p - v), face.normal) >= 0) continue;
    const V3f q = v + edge * clamp(dot(p - v, edge) / dot(edge, edge), 0, 1);
    const float squared = dot(p - q, p - q);
    if (inside || squared < nearest.squared) nearest = {q, squared};
    inside = false;
  }
  return nearest;
}

}  // namespace

// From outside the nearest point lies on one of the faces that see the centre.
void sphere_hull(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch) {
  const HullGeometry& hull = *b.collider->hull;
  const V3f p = transposed_times(b.axes, a.center - b.center);
  patch.count = 0;
  V3f out{0, 1, 0};
  float height = -3e38f;
  Nearest nearest{p, 3e38f};
  for (const HullGeometry::Face& face : hull.faces) {
    const float h = dot(face.normal, p) - face.offset;
    if (h > radius(a) + query.margin) return;
    if (h > height) {
      height = h;
      out = face.normal;
    }
    if (h <= 0) continue;
    const Nearest candidate = nearest_on_face(hull, face, p, h);
    if (candidate.squared < nearest.squared) nearest = candidate;
  }
  if (height > 0) {
    out = direction(p - nearest.point, out);
    height = dot(p - nearest.point, out);
  }
  const V3f normal = -(b.axes * out);
  const float separation = height - radius(a);
  query.apart = separation;
  single_point(query, normal, a.center + normal * (radius(a) + 0.5f * separation), separation, 0,
               patch);
}

namespace {

// The sine below which nearest_parameters may take other points than the nearest.
constexpr float kNearlyNearest = 1e-3f;

// Points of the two axes at the parameters that are nearest to each other, m from the centres.
struct AxisParameters {
  float a, b;
};
AxisParameters nearest_parameters(const V3f& between, const V3f& ua, const V3f& ub, float ha,
                                  float hb) {
  const float cosine = dot(ua, ub), da = dot(ua, between), db = dot(ub, between);
  const float sine_squared = std::max(1 - cosine * cosine, kNearlyNearest * kNearlyNearest);
  const float sa = clamp((da - cosine * db) / sine_squared, -ha, ha);
  const float sb = clamp(cosine * sa - db, -hb, hb);
  return {clamp(cosine * sb + da, -ha, ha), sb};
}

// Nearly parallel: the ends of the stretch along which the two lie side by side, if there is one.
bool side_by_side(const PlacedShape& a, const PlacedShape& b, const V3f& normal, const Query& query,
                  ContactPatch& patch) {
  const V3f ua = a.axes.c1, ub = b.axes.c1, between = b.center - a.center;
  const float ha = half_height(a), hb = half_height(b), middle = dot(ua, between);
  const float reach = hb * std::fabs(dot(ua, ub));
  const float low = std::max(-ha, middle - reach), high = std::min(ha, middle + reach);
  if (high - low < 0.01f * (radius(a) + radius(b))) return false;
  PointList list(query, normal);
  for (const float s : {low, high}) {
    const V3f pa = a.center + ua * s;
    const V3f pb = b.center + ub * clamp(dot(ub, pa - b.center), -hb, hb);
    const float separation = dot(pb - pa, normal) - (radius(a) + radius(b));
    list.add(pa + normal * (radius(a) + 0.5f * separation), separation, s == low ? 0 : 1);
  }
  list.choose(patch);
  return true;
}

}  // namespace

void capsule_capsule(const PlacedShape& a, const PlacedShape& b, Query& query,
                     ContactPatch& patch) {
  const V3f ua = a.axes.c1, ub = b.axes.c1;
  const AxisParameters at =
      nearest_parameters(b.center - a.center, ua, ub, half_height(a), half_height(b));
  const V3f pa = a.center + ua * at.a, pb = b.center + ub * at.b;
  const V3f across = cross(ua, ub);
  const float sine_squared = dot(across, across);
  V3f otherwise = direction(across, perpendicular(ua));
  if (dot(otherwise, b.center - a.center) < 0) otherwise = -otherwise;
  if (sine_squared < 1e-8f) otherwise = perpendicular(ua);
  const V3f normal = direction(pb - pa, otherwise);
  // End to end the axes lie along the normal: one point.
  if (sine_squared < kParallelSine * kParallelSine && std::fabs(dot(normal, ua)) < kAcross &&
      side_by_side(a, b, normal, query, patch))
    return;
  balls(pa, radius(a), pb, radius(b), otherwise, query, patch);
  // Of axes that are all but parallel these are not quite the nearest points.
  query.apart -= kNearlyNearest * (half_height(a) + half_height(b));
}

// -- Capsule and box. In box axes: the capsule's axis is p + t d, t in [-1, 1].
namespace {

struct Axis {
  V3f p, d;
  V3f at(float t) const { return p + d * t; }
};

// Slope of half the squared distance between the box and the axis at t; never falls with t.
float slope(const Axis& axis, const V3f& half, float t) {
  const V3f q = axis.at(t);
  return dot(axis.d, q - clamped(q, half));
}

// Where the axis is nearest to the box. The squared distance is convex and, between the six places
// where the axis crosses a face plane, quadratic: bracket its minimum by those, then solve.
float nearest_parameter(const Axis& axis, const V3f& half) {
  float low = -1, high = 1;
  float slope_low = slope(axis, half, low), slope_high = slope(axis, half, high);
  if (slope_low >= 0 && slope_high > slope_low) return low;
  if (slope_high <= 0 && slope_high > slope_low) return high;
  for (int i = 0; i < 6; ++i) {
    const float d = component(axis.d, i % 3), h = component(half, i % 3);
    if (std::fabs(d) < 1e-12f) continue;
    const float t = ((i < 3 ? h : -h) - component(axis.p, i % 3)) / d;
    if (!(t > low && t < high)) continue;
    const float s = slope(axis, half, t);
    if (s < 0) {
      low = t;
      slope_low = s;
    } else {
      high = t;
      slope_high = s;
    }
  }
  const float rise = slope_high - slope_low;
  return rise > 0 ? clamp(low - slope_low * (high - low) / rise, low, high) : 0.5f * (low + high);
}

// The axis runs through the box: the cheapest way out among face normals and their crosses with it.
struct WayOut {
  V3f out;  // unit, from the box to the capsule
  float separation;
};
WayOut way_out(const Axis& axis, const V3f& half) {
  WayOut best{{0, 1, 0}, -3e38f};
  const auto consider = [&](const V3f& n) {
    const float center = dot(n, axis.p);
    const float reach = std::fabs(n.x) * half.x + std::fabs(n.y) * half.y +
                        std::fabs(n.z) * half.z + std::fabs(dot(n, axis.d));
    const float separation = std::fabs(center) - reach;
    if (separation > best.separation) best = {center < 0 ? -n : n, separation};
  };
  for (int i = 0; i < 3; ++i) consider(component(i));
  for (int i = 0; i < 3; ++i) {
    const V3f n = cross(component(i), axis.d);
    if (dot(n, n) > 1e-6f * dot(axis.d, axis.d)) consider(direction(n, {0, 1, 0}));
  }
  return best;
}

// What of the box faces `out`: a face if two components of it vanish, an edge if one does.
struct Facing {
  int across = 0;  // axes at right angles to `out`
  int along = 0;   // the last of them: for an edge its direction
};
Facing facing(const V3f& out) {
  Facing facing;
  for (int i = 0; i < 3; ++i)
    if (std::fabs(component(out, i)) < kAcross) facing = {facing.across + 1, i};
  return facing;
}

// The stretch of the axis that lies over the box, seen along `out`; empty (low > high) unless a
// face or a parallel edge faces it.
std::array<float, 2> stretch_over(const Axis& axis, const V3f& half, const V3f& out) {
  const Facing over = facing(out);
  const float parallel = std::fabs(component(axis.d, over.along));
  const bool line = over.across == 2 || (over.across == 1 && parallel > 0.9987f * length(axis.d));
  if (!line) return {1, -1};
  float low = -1, high = 1;
  for (int i = 0; i < 3; ++i) {
    if (std::fabs(component(out, i)) > kAcross) continue;
    const float d = component(axis.d, i), p = component(axis.p, i), h = component(half, i);
    if (std::fabs(d) < 1e-12f) continue;
    const float t1 = (-h - p) / d, t2 = (h - p) / d;
    low = std::max(low, std::min(t1, t2));
    high = std::min(high, std::max(t1, t2));
  }
  return {low, high};
}

// Where an axis that runs through the box, at `separation` along `out`, passes the edge that faces
// `out`.
float edge_parameter(const Axis& axis, const V3f& half, const V3f& out, float separation) {
  int j = 0;
  float steepest = 0;
  for (int i = 0; i < 3; ++i) {
    if (std::fabs(component(out, i)) < kAcross || !(std::fabs(component(axis.d, i)) > steepest))
      continue;
    steepest = std::fabs(component(axis.d, i));
    j = i;
  }
  if (steepest < 1e-12f) return 0;
  const float edge = std::copysign(component(half, j), component(out, j));
  return clamp(
      (edge + component(out, j) * separation - component(axis.p, j)) / component(axis.d, j), -1, 1);
}

}  // namespace

void capsule_box(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch) {
  const V3f half = b.collider->size;
  const float r = radius(a);
  const Axis axis{transposed_times(b.axes, a.center - b.center),
                  transposed_times(b.axes, a.axes.c1 * half_height(a))};
  const float t = nearest_parameter(axis, half);
  const V3f gap = axis.at(t) - clamped(axis.at(t), half);
  const float squared = dot(gap, gap), distance = std::sqrt(squared);
  patch.count = 0;
  query.apart = distance - r;
  if (squared > (r + query.margin) * (r + query.margin)) return;

  WayOut way;
  const float size = std::max(half.x, std::max(half.y, half.z));
  if (squared > 1e-12f * size * size) {
    way = {gap * (1 / distance), distance};
  } else {
    way = way_out(axis, half);
  }
  const V3f normal = -(b.axes * way.out);
  PointList list(query, normal);
  const float top =
      std::fabs(way.out.x) * half.x + std::fabs(way.out.y) * half.y + std::fabs(way.out.z) * half.z;
  const auto add = [&](float s, std::uint32_t feature) {
    const V3f p = axis.at(s);
    const float separation = dot(way.out, p) - top - r;
    list.add(b.center + b.axes * p + normal * (r + 0.5f * separation), separation, feature);
  };
  auto [low, high] = stretch_over(axis, half, way.out);
  // Where the axis passes an edge by a hair, the nearest point lies just beside what the face carries.
  if (low <= high && way.separation > 0) {
    low = std::min(low, t);
    high = std::max(high, t);
  }
  if ((high - low) * half_height(a) > 0.02f * r) {
    add(low, 0);
    add(high, 1);
  } else {
    add(way.separation < 0 ? edge_parameter(axis, half, way.out, way.separation) : t, 2);
  }
  list.choose(patch);
}

}  // namespace skerry::collision
