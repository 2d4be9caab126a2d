#include "collision/query_convex.h"

#include <algorithm>
#include <cmath>

#include "collision/polytope_lanes.h"
#include "collision/simplex_weights.h"

namespace skerry::collision {
namespace {

using core::cross;
using core::dot;

V3d rim(const V3d& along, double radius) {
  const double across = std::sqrt(along.x * along.x + along.z * along.z);
  if (across < 1e-300) return {radius, 0, 0};
  return {along.x * radius / across, 0, along.z * radius / across};
}

// The lowest of equal ones. First products alone, side by side: the compiler makes lanes of that loop.
V3d farthest(const PolytopeLanes& hull, const V3d& along) {
  constexpr std::uint32_t kBlock = PolytopeLanes::kPad;
  const float* const x = hull.vertices;
  const float* const y = x + hull.vertex_stride;
  const float* const z = y + hull.vertex_stride;
  std::uint32_t best = 0;
  double most = -HUGE_VAL;
  for (std::uint32_t first = 0; first < hull.vertex_count; first += kBlock) {
    double reach[kBlock];
    for (std::uint32_t i = 0; i < kBlock; ++i)
      reach[i] = (double(x[first + i]) * along.x + double(y[first + i]) * along.y) +
                 double(z[first + i]) * along.z;
    for (std::uint32_t i = 0; i < kBlock; ++i) {
      const bool farther = reach[i] > most;
      most = farther ? reach[i] : most;
      best = farther ? first + i : best;
    }
  }
  return {double(x[best]), double(y[best]), double(z[best])};
}

V3d local_support(const ConvexCore& core, const V3d& d) {
  const V3d& s = core.size;
  switch (core.kind) {
    case ConvexCore::Kind::segment:
      return {0, std::copysign(s.y, d.y), 0};
    case ConvexCore::Kind::box:
      return {std::copysign(s.x, d.x), std::copysign(s.y, d.y), std::copysign(s.z, d.z)};
    case ConvexCore::Kind::cylinder: {
      V3d p = rim(d, s.x);
      p.y = std::copysign(s.y, d.y);
      return p;
    }
    case ConvexCore::Kind::cone: {
      V3d p = rim(d, s.x);
      p.y = -s.y;
      return d.y * s.y > dot(d, p) ? V3d{0, s.y, 0} : p;
    }
    case ConvexCore::Kind::ellipsoid: {
      const V3d scaled{s.x * d.x, s.y * d.y, s.z * d.z};
      const double scale = 1 / length(scaled);
      return {s.x * scaled.x * scale, s.y * scaled.y * scale, s.z * scaled.z * scale};
    }
    case ConvexCore::Kind::hull:
      return farthest(core.hull->lanes->view, d);
    case ConvexCore::Kind::point:
    case ConvexCore::Kind::triangle:
      break;
  }
  return {0, 0, 0};
}

}  // namespace

V3d ConvexCore::support(const V3d& along) const {
  if (kind == Kind::point) return center;
  if (kind == Kind::triangle) {
    const double reach[3] = {dot(corner[0], along), dot(corner[1], along), dot(corner[2], along)};
    const int best =
        reach[1] > reach[0] ? (reach[2] > reach[1] ? 2 : 1) : (reach[2] > reach[0] ? 2 : 0);
    return center + corner[best];
  }
  return center + axes * local_support(*this, transposed_times(axes, along));
}

double ConvexCore::reach(const V3d& unit) const {
  return dot(unit, support(unit) - center) + radius;
}

ConvexCore convex_core(const core::Collider& collider, const V3d& center, const M3d& axes) {
  using Kind = ConvexCore::Kind;
  using core::ShapeType;
  ConvexCore core;
  core.center = center;
  core.axes = axes;
  core.size = wide(collider.size);
  switch (collider.type) {
    case ShapeType::capsule:
      core.kind = Kind::segment;
      core.radius = core.size.x;
      break;
    case ShapeType::box:
      core.kind = Kind::box;
      break;
    case ShapeType::cylinder:
      core.kind = Kind::cylinder;
      break;
    case ShapeType::cone:
      core.kind = Kind::cone;
      break;
    case ShapeType::ellipsoid:
      core.kind = Kind::ellipsoid;
      break;
    case ShapeType::hull:
      core.kind = Kind::hull;
      core.hull = collider.hull;
      break;
    default:
      core.radius = core.size.x;
      break;
  }
  return core;
}

ConvexCore in_frame(const ConvexCore& core, const V3d& origin, const V3d& place, const M3d& axes) {
  ConvexCore local = core;
  local.center = transposed_times(axes, (origin - place) + core.center);
  local.axes = {transposed_times(axes, core.axes.c0), transposed_times(axes, core.axes.c1),
                transposed_times(axes, core.axes.c2)};
  for (V3d& corner : local.corner) corner = transposed_times(axes, corner);
  return local;
}

namespace {

// A point of the difference a - b and where it comes from.
struct Corner {
  V3d p, a, b;
};

// Up to four corners with the weights of their point nearest to the origin.
struct Simplex {
  int count = 0;
  Corner corner[4];
  double weight[4];

  template <V3d Corner::*part>
  V3d mean() const {
    V3d sum{0, 0, 0};
    for (int i = 0; i < count; ++i) sum = sum + corner[i].*part * weight[i];
    return sum;
  }
  bool has(const V3d& p) const {
    for (int i = 0; i < count; ++i) {
      const V3d& c = corner[i].p;
      if (c.x == p.x && c.y == p.y && c.z == p.z) return true;
    }
    return false;
  }
  void drop_weightless() {
    int kept = 0;
    for (int i = 0; i < count; ++i) {
      if (!(weight[i] > 0)) continue;
      corner[kept] = corner[i];
      weight[kept++] = weight[i];
    }
    count = kept;
  }
};

// A tetrahedron lower than this part of its size has no inside.
constexpr double kFlat = 1e-13;

// Weights of the nearest point; false if that is the origin itself, inside a tetrahedron.
bool weigh(Simplex& s) {
  double w[3];
  const auto take = [&](int count) {
    for (int i = 0; i < count; ++i) s.weight[i] = w[i];
    return true;
  };
  switch (s.count) {
    case 1:
      s.weight[0] = 1;
      return true;
    case 2:
      weigh_segment(s.corner[0].p, s.corner[1].p, w);
      return take(2);
    case 3:
      weigh_triangle(s.corner[0].p, s.corner[1].p, s.corner[2].p, w);
      return take(3);
    default:
      break;
  }
  static constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
  double nearest = HUGE_VAL, volume = 0;
  double inside[4] = {};
  for (const auto& face : kFaces) {
    const V3d a = s.corner[face[0]].p, b = s.corner[face[1]].p, c = s.corner[face[2]].p;
    const V3d normal = cross(b - a, c - a);
    const double inner = dot(normal, s.corner[face[3]].p - a), origin = -dot(normal, a);
    // On the inner side of this face, as far as a tetrahedron this flat can tell.
    if (inner * origin > 0 && std::abs(inner) > kFlat * length(normal) * length(a)) {
      inside[face[3]] = origin / inner;
      volume += inside[face[3]];
      continue;
    }
    weigh_triangle(a, b, c, w);
    const V3d p = (a * w[0] + b * w[1]) + c * w[2];
    if (dot(p, p) >= nearest) continue;
    nearest = dot(p, p);
    for (double& weight : s.weight) weight = 0;
    for (int i = 0; i < 3; ++i) s.weight[face[i]] = w[i];
  }
  if (nearest < HUGE_VAL) return true;
  for (int i = 0; i < 4; ++i) s.weight[i] = inside[i] / volume;
  return false;
}

// How far planes across n, a unit vector from a to b, part the two; negative if they do not.
double plane_gap(const ConvexCore& a, const V3d& shift, const ConvexCore& b, const V3d& n) {
  return dot(n, b.support(n * -1.0)) - dot(n, a.support(n) + shift);
}

// What rounding leaves of the difference of two points is about this part of their size.
constexpr double kRounding = 1e-15;

}  // namespace

CoreDistance core_distance(const ConvexCore& a, const V3d& shift, const ConvexCore& b,
                           const V3d& guess) {
  constexpr int kMaxSteps = 100;
  constexpr double kEnough = 1e-12;  // of the squared distance
  CoreDistance result;
  Simplex simplex, last;
  V3d v = guess * -1.0;
  if (dot(v, v) == 0) v = {0, -1, 0};
  double squared = HUGE_VAL, parted = 0;  // parted: proved distance, m
  for (int i = 0; i < kMaxSteps; ++i) {
    Corner w;
    w.a = a.support(v * -1.0) + shift;
    w.b = b.support(v);
    w.p = w.a - w.b;
    if (i > 0 && (squared - dot(v, w.p) <= kEnough * squared || simplex.has(w.p))) break;
    parted = std::max(parted, dot(v, w.p) / length(v));
    last = simplex;
    simplex.corner[simplex.count++] = w;
    const bool outside = weigh(simplex);
    simplex.drop_weightless();
    const V3d nearest = simplex.mean<&Corner::p>();
    const double now = dot(nearest, nearest);
    double size = 0;
    for (int k = 0; k < simplex.count; ++k)
      size = std::max(size, dot(simplex.corner[k].p, simplex.corner[k].p));
    const bool overlap = !outside || now <= kRounding * kRounding * size;
    if (overlap && parted <= kRounding * std::sqrt(size)) {
      result.a = simplex.mean<&Corner::a>();
      result.b = simplex.mean<&Corner::b>();
      return result;
    }
    // As near as rounding lets it get: slivers of curved shapes may even seem to hold the origin.
    if (overlap || now >= squared) {
      simplex = last;
      break;
    }
    v = nearest;
    squared = now;
  }
  result.distance = std::sqrt(squared);
  result.normal = v * (-1 / result.distance);
  result.a = simplex.mean<&Corner::a>();
  result.b = simplex.mean<&Corner::b>();
  result.gap = plane_gap(a, shift, b, result.normal);
  return result;
}

V3d common_point(const CoreDistance& found, double radius_a, double radius_b) {
  const double radii = radius_a + radius_b;
  if (found.distance >= radii) return found.b - found.normal * radius_b;
  return found.a + found.normal * (found.distance * radius_a / radii);
}

Touching cast_core(const ConvexCore& a, const V3d& translation, double most, const ConvexCore& b) {
  constexpr int kMaxSteps = 128;
  constexpr double kTouch = 1e-6;  // of the size: nearer than this is as good as touching,
  constexpr double kBlur = 1e-10;  // and nearer than this there is nothing in between
  const double radii = a.radius + b.radius;
  const double size = std::clamp(length(b.center - a.center) + radii, 1e-3, 1.0);
  Touching touching;
  V3d normal = b.center - a.center;
  double t = 0;
  for (int i = 0; i < kMaxSteps; ++i) {
    const CoreDistance now = core_distance(a, translation * t, b, normal);
    const double distance = now.distance - radii;
    touching.point = common_point(now, a.radius, b.radius);
    if (i == 0 && distance <= kBlur * size) {
      touching.hit = touching.at_start = true;
      touching.normal = translation * (-1 / length(translation));
      return touching;
    }
    // Where they touch, the planes across the last normal do: it was with them that a came here. The
    // nearest points, by now too near each other, would tell it less well.
    const bool touches = distance <= kTouch * size;
    double gap = i == 0 ? -HUGE_VAL : plane_gap(a, translation * t, b, normal);
    if (i == 0 || (!touches && now.gap > gap)) {
      normal = now.normal;
      gap = now.gap;
    }
    const double closing = dot(normal, translation);
    if (closing <= 1e-14 * length(translation)) return touching;  // on the way apart
    if (touches) {
      touching.normal = normal * -1.0;
      touching.fraction = t + std::max(distance, 0.0) / closing;
      touching.hit = touching.fraction <= most;
      return touching;
    }
    t += std::max(gap - radii, 0.25 * kTouch * size) / closing;
    if (t > most) return touching;
  }
  return touching;
}

}  // namespace skerry::collision
