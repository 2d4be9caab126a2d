// Where two features lie over each other.
#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

using core::cross;
using core::dot;

namespace {

constexpr std::uint32_t kMaxCorners = 2 * Feature::kMaxPoints + 4;
// How far outside the reference polygon a corner may lie and still count as inside, as a part of
// the polygon's size. Features that coincide would otherwise change with every rounding.
constexpr float kClipTolerance = 1e-3f;

struct PolygonCorner {
  V3f position;
  std::uint32_t id;
};
struct Polygon {
  std::uint32_t count = 0;
  PolygonCorner corners[kMaxCorners + 1];  // one more for what is not kept
  // Kept or not, without a branch: nobody can tell beforehand.
  void add(bool kept, const V3f& position, std::uint32_t id) {
    corners[count] = {position, id};
    count += kept && count < kMaxCorners ? 1u : 0u;
  }
};

// Name of the place where the edge between two corners meets the plane of a reference edge.
std::uint32_t crossing_id(std::uint32_t a, std::uint32_t b, std::uint32_t plane) {
  std::uint32_t h = std::min(a, b) * 0x9e3779b1u;
  h = (h ^ std::max(a, b)) * 0x85ebca77u;
  h = (h ^ plane) * 0xc2b2ae3du;
  return ((h ^ (h >> 15)) & 0x3fffffffu) | 0x40000000u;
}

// Heights of a polygon's corners over a plane.
struct Heights {
  float at[kMaxCorners];
  bool all_inside = true;

  Heights(const Polygon& polygon, const V3f& outward, float offset) {
    for (std::uint32_t i = 0; i < polygon.count; ++i) {
      at[i] = dot(outward, polygon.corners[i].position) - offset;
      all_inside &= at[i] <= 0;
    }
  }
};

// Keeps what lies on the inner side of a plane (Sutherland and Hodgman). `closed`: a polygon, else
// a line of two corners.
void cut(const Polygon& from, const Heights& heights, std::uint32_t plane, bool closed,
         Polygon& to) {
  to.count = 0;
  const std::uint32_t edges = closed ? from.count : from.count - 1;
  for (std::uint32_t i = 0; i < edges; ++i) {
    const std::uint32_t j = i + 1 < from.count ? i + 1 : 0;
    const PolygonCorner &tail = from.corners[i], &head = from.corners[j];
    const float h0 = heights.at[i], h1 = heights.at[j];
    to.add(h0 <= 0, tail.position, tail.id);
    to.add((h0 <= 0) != (h1 <= 0),
           tail.position + (head.position - tail.position) * (h0 / (h0 - h1)),
           crossing_id(tail.id, head.id, plane));
  }
  if (!closed) to.add(heights.at[edges] <= 0, from.corners[edges].position, from.corners[edges].id);
}

V3f polygon_normal(const Feature& polygon, const V3f& outward) {
  V3f sum{0, 0, 0};
  for (std::uint32_t i = 1; i + 1 < polygon.count; ++i)
    sum = sum +
          cross(polygon.points[i] - polygon.points[0], polygon.points[i + 1] - polygon.points[0]);
  return direction(sum, outward);
}

float size(const Feature& polygon) {
  float squared = 0;
  for (std::uint32_t i = 1; i < polygon.count; ++i) {
    const V3f r = polygon.points[i] - polygon.points[0];
    squared = std::max(squared, dot(r, r));
  }
  return std::sqrt(squared);
}

// Two lines side by side: the ends of the stretch they share.
void clip_lines(const Feature& a, const Feature& b, const V3f& normal, PointList& list) {
  const V3f along_a = a.points[1] - a.points[0], along_b = b.points[1] - b.points[0];
  const float squared = dot(along_a, along_a);
  const V3f across = cross(along_a, along_b);
  // More than 3 degrees off parallel they cross in a point.
  if (!(dot(across, across) < 0.0025f * squared * dot(along_b, along_b))) return;
  const auto parameter = [&](const V3f& p) { return dot(p - a.points[0], along_a) / squared; };
  const float t0 = parameter(b.points[0]), t1 = parameter(b.points[1]);
  const float low = std::max(0.0f, std::min(t0, t1)), high = std::min(1.0f, std::max(t0, t1));
  if (high - low < 1e-3f) return;
  for (const float t : {low, high}) {
    const V3f pa = a.points[0] + along_a * t;
    const V3f pb = b.points[0] + along_b * ((t - t0) / (t1 - t0));
    const float separation = dot(normal, pb - pa);
    list.add(pa + normal * (0.5f * separation), separation,
             (a.ids[0] * 256u + b.ids[0]) * 2u + (t == low ? 0u : 1u));
  }
}

}  // namespace

void clip_against(const Feature& reference, const V3f& face, const Feature& incident,
                  const V3f& outward, bool a_is_reference, PointList& list) {
  Polygon polygons[2];
  Polygon *now = &polygons[0], *next = &polygons[1];
  for (std::uint32_t i = 0; i < incident.count; ++i)
    now->add(true, incident.points[i], incident.ids[i]);
  const bool closed = incident.count > 2;
  const float tolerance = kClipTolerance * size(reference);
  for (std::uint32_t i = 0; i < reference.count && now->count > 0; ++i) {
    const V3f tail = reference.points[i];
    const V3f head = reference.points[i + 1 < reference.count ? i + 1 : 0];
    const V3f side = cross(head - tail, outward);
    const Heights heights(*now, side, dot(side, tail) + tolerance * core::length(side));
    if (heights.all_inside) continue;
    cut(*now, heights, reference.ids[i], closed, *next);
    std::swap(now, next);
    if (!closed && now->count == 1) break;
  }
  const float scale = 1 / std::max(dot(face, outward), 0.1f);
  const std::uint32_t side = a_is_reference ? 0 : 0x80000000u;
  for (std::uint32_t i = 0; i < now->count; ++i) {
    const V3f p = now->corners[i].position;
    const float separation = dot(face, p - reference.points[0]) * scale;
    list.add(p - outward * (0.5f * separation), separation, now->corners[i].id | side);
  }
}

void clip_features(const Feature& a, const Feature& b, const V3f& normal, PointList& list) {
  if (a.count == 2 && b.count == 2) {
    clip_lines(a, b, normal, list);
  } else if (a.count > 2 && b.count > 1) {
    // The face that is more at right angles to the normal gives the plane; a's if they tie.
    const V3f face_a = polygon_normal(a, normal);
    const V3f face_b = b.count > 2 ? polygon_normal(b, -normal) : normal;
    if (dot(face_b, -normal) > dot(face_a, normal) + 1e-3f)
      clip_against(b, face_b, a, -normal, false, list);
    else
      clip_against(a, face_a, b, normal, true, list);
  } else if (b.count > 2 && a.count > 1) {
    clip_against(b, polygon_normal(b, -normal), a, -normal, false, list);
  }
}

}  // namespace skerry::collision
