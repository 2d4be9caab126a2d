// Round shapes against a triangle of a mesh.
#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

using core::cross;
using core::dot;

bool leans_too_far(const Triangle& triangle, const V3f& out) {
  const float up = dot(out, triangle.normal);
  if (up < 0) return true;
  if (up > 0.9999f) return false;
  for (int i = 0; i < 3; ++i) {
    const V3f edge = triangle.corner[(i + 1) % 3] - triangle.corner[i];
    const V3f away = direction(cross(edge, triangle.normal), {0, 0, 0});
    const float lean = dot(out, away);
    if (lean <= 1e-3f) continue;
    if (!triangle.touchable[i]) return true;
    const float most = dot(triangle.beyond[i], away),
                most_up = dot(triangle.beyond[i], triangle.normal);
    if (lean * most_up > most * up + 1e-3f) return true;
  }
  return false;
}

bool over_face(const Triangle& t, const V3f& p) {
  for (int i = 0; i < 3; ++i) {
    const V3f edge = t.corner[(i + 1) % 3] - t.corner[i];
    if (dot(cross(t.normal, edge), p - t.corner[i]) < 0) return false;
  }
  return true;
}

V3f cap_normal(const PlacedShape& shape, std::uint32_t index) {
  return index == 0 ? -shape.axes.c1 : shape.axes.c1;
}

Cap facing_cap(const PlacedShape& shape, const Triangle& t) {
  // Beyond 30 degrees off the triangle it is the rim that touches.
  constexpr float kFacing = 0.866f;
  // A triangle that is parallel to the cap is as near everywhere.
  constexpr float kParallel = 0.99999f;
  constexpr float kTie = 1e-3f;  // of the radius
  Cap cap;
  cap.index = dot(shape.axes.c1, t.normal) < 0 ? 1 : 0;
  if (cap.index == 1 && shape.collider->type == ShapeType::cone) return cap;
  const V3f normal = cap_normal(shape, cap.index), down = -t.normal;
  const float radius = shape.collider->size.x, facing = dot(normal, down);
  if (facing < kFacing) return cap;
  V3f nearest = t.corner[0] - shape.center;
  for (int i = 1; i < 3; ++i) {
    const V3f corner = t.corner[i] - shape.center;
    if (dot(normal, corner) < dot(normal, nearest)) nearest = corner;
  }
  const float along = dot(normal, nearest);
  cap.separation = along - shape.collider->size.y;
  const V3f across = nearest - normal * along;
  const float of_face = dot(t.normal, shape.center - t.corner[0]) - extent(shape, down);
  const bool within_rim = facing > kParallel || dot(across, across) < radius * radius;
  if (within_rim && cap.separation > of_face - kTie * radius)
    cap.along = leans_too_far(t, -normal) ? Cap::Along::triangle : Cap::Along::cap;
  else if (!(t.touchable[0] || t.touchable[1] || t.touchable[2]))
    cap.along = Cap::Along::triangle;
  return cap;
}

namespace {

struct Nearest {
  V3f on_shape, on_triangle;
  float squared = 3e38f;
  void consider(const V3f& p, const V3f& q) {
    const float d = dot(p - q, p - q);
    if (d >= squared) return;
    *this = {p, q, d};
  }
};

V3f edge(const Triangle& t, int i) { return t.corner[(i + 1) % 3] - t.corner[i]; }

V3f nearest_on_segment(const V3f& tail, const V3f& along, const V3f& p) {
  const float t = dot(p - tail, along) / std::max(dot(along, along), 1e-30f);
  return tail + along * std::clamp(t, 0.0f, 1.0f);
}

void consider_point(const Triangle& t, const V3f& p, Nearest& nearest) {
  if (over_face(t, p)) {
    nearest.consider(p, p - t.normal * dot(t.normal, p - t.corner[0]));
    return;
  }
  for (int i = 0; i < 3; ++i) nearest.consider(p, nearest_on_segment(t.corner[i], edge(t, i), p));
}

// Two segments (Ericson, 5.1.9).
void consider_segments(const V3f& p, const V3f& u, const V3f& q, const V3f& v, Nearest& nearest) {
  const V3f r = p - q;
  const float uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
  const float denominator = uu * vv - uv * uv;
  const float s = denominator > 1e-7f * uu * vv
                      ? std::clamp((uv * vr - ur * vv) / denominator, 0.0f, 1.0f)
                      : 0.5f;
  const V3f on_v = nearest_on_segment(q, v, p + u * s);
  nearest.consider(nearest_on_segment(p, u, on_v), on_v);
}

struct Segment {
  V3f tail, along;
  V3f at(float t) const { return tail + along * t; }
};

Nearest nearest_to_segment(const Triangle& t, const Segment& segment) {
  Nearest nearest;
  consider_point(t, segment.tail, nearest);
  consider_point(t, segment.at(1), nearest);
  for (int i = 0; i < 3; ++i)
    consider_segments(segment.tail, segment.along, t.corner[i], edge(t, i), nearest);
  return nearest;
}

bool pierces(const Triangle& t, const Segment& segment) {
  const float h0 = dot(t.normal, segment.tail - t.corner[0]);
  const float h1 = dot(t.normal, segment.at(1) - t.corner[0]);
  return (h0 < 0) != (h1 < 0) && over_face(t, segment.at(h0 / (h0 - h1)));
}

// The ends of the stretch that lies over the face.
void add_over_face(const Triangle& t, const Segment& segment, float radius, PointList& list) {
  float low = 0, high = 1;
  for (int i = 0; i < 3; ++i) {
    const V3f inward = cross(t.normal, edge(t, i));
    const float h0 = dot(inward, segment.tail - t.corner[i]), slope = dot(inward, segment.along);
    if (slope > 0)
      low = std::max(low, -h0 / slope);
    else if (slope < 0)
      high = std::min(high, -h0 / slope);
    else if (h0 < 0)
      return;
  }
  if (low > high) return;
  for (const float s : {low, high}) {
    const V3f p = segment.at(s);
    const float separation = dot(t.normal, p - t.corner[0]) - radius;
    list.add(p - t.normal * (radius + 0.5f * separation), separation, s == low ? 0 : 1);
    if (high - low < 1e-4f) break;
  }
}

}  // namespace

void capsule_triangle(const PlacedShape& a, const PlacedShape& b, Query& query,
                      ContactPatch& patch) {
  const Triangle& t = *b.triangle;
  const float radius = a.collider->size.x;
  const V3f half = a.axes.c1 * a.collider->size.y;
  const Segment segment{a.center - half, half * 2};
  patch.count = 0;
  const Nearest nearest = nearest_to_segment(t, segment);
  const V3f out = direction(nearest.on_shape - nearest.on_triangle, t.normal);
  if (pierces(t, segment) || dot(out, t.normal) > 0.999f) {
    PointList list(query, -t.normal);
    add_over_face(t, segment, radius, list);
    list.choose(patch);
    return;
  }
  if (leans_too_far(t, out)) return;
  const float separation = std::sqrt(nearest.squared) - radius;
  single_point(query, -out, nearest.on_shape - out * (radius + 0.5f * separation), separation, 2,
               patch);
}

}  // namespace skerry::collision
