// Any two convex shapes, by their support functions.
//
//   Apart    distance of the cores (a sphere's centre, a capsule's axis, else the shape itself) by
//            Gilbert, Johnson and Keerthi (1988), in double.
//   Overlap  the least depth over directions: the best of a fixed set of directions, each pushed
//            downhill by moving b out along it and asking for the nearest points there. The depth
//            never grows from push to push, and a direction is left in place only if it is a local
//            minimum.
#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"
#include "collision/simplex_weights.h"
#include "core/rounding.h"

namespace skerry::collision {

using core::cross;
using core::dot;

namespace {

using V3d = core::V3<double>;

V3d wide(const V3f& v) { return {double(v.x), double(v.y), double(v.z)}; }
V3f narrow(const V3d& v) {
  return {core::rounded_to_float(v.x), core::rounded_to_float(v.y), core::rounded_to_float(v.z)};
}
double length(const V3d& v) { return std::sqrt(dot(v, v)); }

// A convex shape in double, with the radius of its rounding taken off.
class Core {
 public:
  explicit Core(const PlacedShape& shape)
      : shape_(shape),
        center_(wide(shape.center)),
        x_(wide(shape.axes.c0)),
        y_(wide(shape.axes.c1)),
        z_(wide(shape.axes.c2)) {
    if (shape.triangle != nullptr) {
      const V3f* c = shape.triangle->corner;
      size_ = double(core::length(c[1] - c[0]));
      middle_ = wide((c[0] + c[1] + c[2]) * (1.0f / 3));
      return;
    }
    const V3d s = wide(shape.collider->size);
    const ShapeType type = shape.collider->type;
    middle_ = center_;
    size_ = type == ShapeType::hull ? double(shape.collider->hull->inner_radius)
            : type == ShapeType::sphere || type == ShapeType::capsule
                ? 0
                : std::min(s.x, type == ShapeType::cylinder || type == ShapeType::cone
                                    ? s.y
                                    : std::min(s.y, s.z));
    if (type == ShapeType::hull)
      middle_ = center_ + wide(shape.axes * shape.collider->hull->center);
    if (type == ShapeType::sphere || type == ShapeType::capsule) radius_ = s.x;
  }

  double radius() const { return radius_; }
  double size() const { return size_; }
  V3d middle() const { return middle_; }
  V3d axis(int i) const { return i == 0 ? x_ : i == 1 ? y_ : z_; }
  const PlacedShape& shape() const { return shape_; }

  // The core's farthest point along d (of any length but zero).
  V3d support(const V3d& d) const {
    if (shape_.triangle != nullptr) return farthest(shape_.triangle->corner, 3, d);
    const V3d local{dot(x_, d), dot(y_, d), dot(z_, d)}, s = wide(shape_.collider->size);
    V3d p{0, 0, 0};
    switch (shape_.collider->type) {
      case ShapeType::capsule:
        p = {0, std::copysign(s.y, local.y), 0};
        break;
      case ShapeType::box:
        p = {std::copysign(s.x, local.x), std::copysign(s.y, local.y), std::copysign(s.z, local.z)};
        break;
      case ShapeType::cylinder:
        p = rim(local, s.x);
        p.y = std::copysign(s.y, local.y);
        break;
      case ShapeType::cone:
        p = rim(local, s.x);
        p.y = -s.y;
        if (local.y * s.y > dot(local, p)) p = {0, s.y, 0};
        break;
      case ShapeType::ellipsoid: {
        const V3d scaled{s.x * local.x, s.y * local.y, s.z * local.z};
        const double scale = 1 / length(scaled);
        p = {s.x * scaled.x * scale, s.y * scaled.y * scale, s.z * scaled.z * scale};
        break;
      }
      case ShapeType::hull: {
        const auto& vertices = shape_.collider->hull->vertices;
        p = farthest(vertices.data(), vertices.size(), local);
        break;
      }
      case ShapeType::sphere:
      case ShapeType::plane:
      case ShapeType::mesh:
      case ShapeType::height_field:
        break;
    }
    return center_ + ((x_ * p.x + y_ * p.y) + z_ * p.z);
  }

 private:
  static V3d rim(const V3d& local, double radius) {
    const double across = std::sqrt(local.x * local.x + local.z * local.z);
    if (across < 1e-300) return {radius, 0, 0};
    return {local.x * radius / across, 0, local.z * radius / across};
  }
  static V3d farthest(const V3f* points, std::size_t count, const V3d& d) {
    std::size_t best = 0;
    double reach = dot(wide(points[0]), d);
    for (std::size_t i = 1; i < count; ++i) {
      const double r = dot(wide(points[i]), d);
      if (r <= reach) continue;
      reach = r;
      best = i;
    }
    return wide(points[best]);
  }

  const PlacedShape& shape_;
  V3d center_, x_, y_, z_, middle_;
  double radius_ = 0, size_ = 0;
};

// A point of the Minkowski difference a - b and where it comes from.
struct Vertex {
  V3d p, a, b;
};

// The simplex of the search, with the weights of the point nearest to the origin.
struct Simplex {
  int count = 0;
  Vertex vertex[4];
  double weight[4];

  V3d nearest() const {
    V3d sum{0, 0, 0};
    for (int i = 0; i < count; ++i) sum = sum + vertex[i].p * weight[i];
    return sum;
  }
  V3d nearest_a() const {
    V3d sum{0, 0, 0};
    for (int i = 0; i < count; ++i) sum = sum + vertex[i].a * weight[i];
    return sum;
  }
  V3d nearest_b() const {
    V3d sum{0, 0, 0};
    for (int i = 0; i < count; ++i) sum = sum + vertex[i].b * weight[i];
    return sum;
  }
  void drop_weightless() {
    int kept = 0;
    for (int i = 0; i < count; ++i) {
      if (weight[i] <= 0) continue;
      vertex[kept] = vertex[i];
      weight[kept++] = weight[i];
    }
    count = kept;
  }
};

// False if the origin is inside.
bool solve_tetrahedron(Simplex& s) {
  static constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
  double nearest = 1e300;
  for (const auto& face : kFaces) {
    const V3d a = s.vertex[face[0]].p, b = s.vertex[face[1]].p, c = s.vertex[face[2]].p;
    const V3d normal = cross(b - a, c - a);
    const double inner = dot(normal, s.vertex[face[3]].p - a), origin = -dot(normal, a);
    if (inner * origin > 0) continue;  // the origin is on the inner side of this face
    double w[3];
    weigh_triangle(a, b, c, w);
    const V3d p = (a * w[0] + b * w[1]) + c * w[2];
    if (dot(p, p) >= nearest) continue;
    nearest = dot(p, p);
    for (double& weight : s.weight) weight = 0;
    for (int i = 0; i < 3; ++i) s.weight[face[i]] = w[i];
  }
  return nearest < 1e300;
}

// False if the origin is inside.
bool weigh(Simplex& s) {
  if (s.count == 4) return solve_tetrahedron(s);
  double w[3] = {1, 0, 0};
  if (s.count == 2) weigh_segment(s.vertex[0].p, s.vertex[1].p, w);
  if (s.count == 3) weigh_triangle(s.vertex[0].p, s.vertex[1].p, s.vertex[2].p, w);
  for (int i = 0; i < 3; ++i) s.weight[i] = w[i];
  return true;
}

struct Distance {
  bool apart = false;
  bool certain = false;        // the normal is right to about 1e-3
  double distance = 0;         // of the cores
  V3d normal{0, 1, 0};         // unit, from a to b
  V3d a{0, 0, 0}, b{0, 0, 0};  // nearest points
};

bool holds(const Simplex& simplex, const V3d& p, double tolerance) {
  for (int i = 0; i < simplex.count; ++i)
    if (length(simplex.vertex[i].p - p) <= tolerance) return true;
  return false;
}

// Distance of the cores with b moved by `shift`. On curved shapes the simplex may become so thin that
// its nearest point is mostly rounding: the best one met counts, not the last.
Distance distance(const Core& a, const Core& b, const V3d& shift, const V3d& start) {
  constexpr int kMaxSteps = 64, kPatience = 16;
  constexpr double kCertain = 1e-6;
  const double scale = a.size() + a.radius() + b.size() + b.radius();
  Simplex simplex, best;
  V3d v = start, best_v = start;
  double best_excess = 1e300;  // of the squared distance, over what is possible
  int best_step = 0;
  Distance result;
  for (int i = 0; i < kMaxSteps; ++i) {
    Vertex w;
    w.a = a.support(v * -1.0);
    w.b = b.support(v) + shift;
    w.p = w.a - w.b;
    const double squared = dot(v, v), excess = squared - dot(v, w.p);
    if (i > 0 && excess < best_excess * squared) {
      best = simplex;
      best_v = v;
      best_excess = excess / squared;
      best_step = i;
    }
    if (i > 0 && excess <= 1e-9 * squared) break;
    if (i - best_step > kPatience && best_excess <= kCertain) break;
    if (holds(simplex, w.p, 1e-12 * scale)) break;  // no new point: as near as it gets
    simplex.vertex[simplex.count++] = w;
    if (!weigh(simplex)) return result;
    simplex.drop_weightless();
    v = simplex.nearest();
    if (dot(v, v) <= 1e-14 * scale * scale) return result;
  }
  if (best_step == 0) return result;
  result.apart = true;
  result.certain = best_excess <= kCertain;
  result.distance = length(best_v);
  result.normal = best_v * (-1 / result.distance);
  result.a = best.nearest_a();
  result.b = best.nearest_b() - shift;
  return result;
}

// Overlap along a direction: how far b must move along it to be clear of a.
double depth(const Core& a, const Core& b, const V3d& n) {
  return dot(n, a.support(n)) - dot(n, b.support(n * -1.0));
}

struct Way {
  double depth = 1e300;
  V3d normal{0, 1, 0};
  V3d a{0, 0, 0}, b{0, 0, 0};
};

// Downhill from a direction.
Way push(const Core& a, const Core& b, const V3d& from) {
  constexpr int kMaxPushes = 12;
  const double gap = 1e-3 * std::min(a.size() + a.radius(), b.size() + b.radius());
  Way way{depth(a, b, from), from, a.support(from), b.support(from * -1.0)};
  for (int i = 0; i < kMaxPushes; ++i) {
    const V3d shift = way.normal * (way.depth + gap);
    const Distance there = distance(a, b, shift, way.normal * -1.0);
    if (!there.apart) break;
    // A face's farthest point is any of its corners; the nearest points are where they meet.
    way.a = there.a;
    way.b = there.b;
    const double d = depth(a, b, there.normal);
    const bool settled = d > way.depth - 1e-6 * gap;
    if (d <= way.depth + 1e-6 * gap) way = {d, there.normal, there.a, there.b};
    if (settled) break;
  }
  return way;
}

// Directions in which depths are compared before the best are pushed.
class Directions {
 public:
  Directions(const Core& a, const Core& b) : a_(a), b_(b) {
    const V3d between = b.middle() - a.middle();
    if (length(between) > 1e-12) consider(between);
    for (int i = 0; i < 3; ++i) {
      both(a.axis(i));
      both(b.axis(i));
      for (int j = 0; j < 3; ++j) both(cross(a.axis(i), b.axis(j)));
    }
    faces_of(a, 1);
    faces_of(b, -1);
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (x != 0 || y != 0 || z != 0) consider({double(x), double(y), double(z)});
  }
  static constexpr int kBest = 10;
  static constexpr double kApart = 0.95;  // cosine
  const Way& best(int i) const { return best_[i]; }

 private:
  void faces_of(const Core& core, double side) {
    const PlacedShape& shape = core.shape();
    if (shape.triangle != nullptr) return consider(wide(shape.triangle->normal) * side);
    if (shape.collider->type != ShapeType::hull) return;
    for (const auto& face : shape.collider->hull->faces)
      consider(wide(shape.axes * face.normal) * side);
  }
  void both(const V3d& n) {
    consider(n);
    consider(n * -1.0);
  }
  void consider(const V3d& n) {
    const double size = length(n);
    if (size < 1e-6) return;
    Way way;
    way.normal = n * (1 / size);
    way.depth = depth(a_, b_, way.normal);
    // One of each neighbourhood, so that several valleys get their turn.
    int i = 0;
    while (i < kBest && best_[i].depth < 1e300 && dot(way.normal, best_[i].normal) < kApart) ++i;
    if (i == kBest) i = kBest - 1;
    if (best_[i].depth <= way.depth) return;
    best_[i] = way;
    for (; i > 0 && best_[i].depth < best_[i - 1].depth; --i) std::swap(best_[i], best_[i - 1]);
  }

  const Core &a_, &b_;
  Way best_[kBest];
};

// The last normal in 32 bits: two octahedral coordinates, the lowest bit set.
std::uint32_t pack(const V3d& n) {
  const double sum = std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z);
  double u = n.x / sum, v = n.z / sum;
  if (n.y < 0) {
    const double fold = (1 - std::fabs(v)) * (u < 0 ? -1 : 1);
    v = (1 - std::fabs(u)) * (v < 0 ? -1 : 1);
    u = fold;
  }
  const auto bits = [](double t) { return static_cast<std::uint32_t>((t + 1) * 32767.5); };
  return bits(u) << 16 | bits(v) | 1u;
}
V3d unpack(std::uint32_t packed) {
  const double u = double(packed >> 16) / 32767.5 - 1, v = double(packed & 0xffffu) / 32767.5 - 1;
  V3d n{u, 1 - std::fabs(u) - std::fabs(v), v};
  if (n.y < 0) {
    n.x = (1 - std::fabs(v)) * (u < 0 ? -1 : 1);
    n.z = (1 - std::fabs(u)) * (v < 0 ? -1 : 1);
  }
  return n * (1 / length(n));
}

// Of a resting contact the last normal (on a surface: the triangle's) is pushed and nothing else
// tried, unless it has become deep.
constexpr double kRestingDepth = 0.05;  // of the smaller size

Way way_out(const Core& a, const Core& b, std::uint32_t cache) {
  const Triangle* triangle = b.shape().triangle;  // surfaces are left to the front
  if (cache != 0 || triangle != nullptr) {
    const Way way = push(a, b, triangle != nullptr ? wide(-triangle->normal) : unpack(cache));
    const double size = std::min(a.size() + a.radius(), b.size() + b.radius());
    if (way.depth + a.radius() + b.radius() < kRestingDepth * size) return way;
  }
  const Directions directions(a, b);
  Way best;
  for (int i = 0; i < Directions::kBest; ++i) {
    if (directions.best(i).depth >= 1e300) continue;
    const Way way = push(a, b, directions.best(i).normal);
    if (way.depth < best.depth) best = way;
  }
  return best;
}

// Nearest points, or the way out. Nearer than this (of the smaller size) the difference of the
// nearest points is too short to tell the normal of curved shapes, and pushing is better.
constexpr double kTooNear = 1e-3;

Way separation(const Core& a, const Core& b, const Query& query) {
  const V3d between = b.middle() - a.middle();
  const V3d start = length(between) > 1e-12 ? between * -1.0 : V3d{0, -1, 0};
  const Distance apart = distance(a, b, {0, 0, 0}, start);
  const double size = std::min(a.size() + a.radius(), b.size() + b.radius());
  if (apart.certain && apart.distance > kTooNear * size)
    return {-apart.distance, apart.normal, apart.a, apart.b};
  const Way way = way_out(a, b, query.cache);
  if (!apart.apart) return way;
  const Way direct = push(a, b, apart.normal);
  return direct.depth < way.depth ? direct : way;
}

struct Touch {
  V3f normal;
  float separation;
  V3f position;  // halfway between the nearest points
};

// A face that looks almost along the normal lends its own, which is free of noise.
void snap(const PlacedShape& a, const PlacedShape& b, const Feature& feature, float side,
          double size, Touch& touch) {
  if (feature.count < 3) return;
  const V3f normal =
      direction(cross(feature.points[1] - feature.points[0], feature.points[2] - feature.points[0]),
                touch.normal) *
      side;
  if (dot(normal, touch.normal) < 0.9998f) return;
  const float separation =
      (dot(normal, b.center - a.center) - extent(b, -normal)) - extent(a, normal);
  if (separation < touch.separation - 1e-4f * core::rounded_to_float(size)) return;
  touch.normal = normal;
  touch.separation = separation;
}

void add_points(const PlacedShape& a, const PlacedShape& b, const Query& query, double size,
                Touch touch, ContactPatch& patch) {
  Feature fa, fb;
  facing_feature(a, touch.normal, fa);
  facing_feature(b, -touch.normal, fb);
  snap(a, b, fa, 1, size, touch);
  snap(a, b, fb, -1, size, touch);
  PointList list(query, touch.normal);
  clip_features(fa, fb, touch.normal, list);
  // Nothing is deeper than the nearest points; but clipping lets features reach a little too far.
  float deepest = 3e38f;
  for (ContactPoint& point : list) {
    point.separation = std::max(point.separation, touch.separation);
    deepest = std::min(deepest, point.separation);
  }
  // The nearest points themselves, where the features do not tell of them.
  constexpr std::uint32_t kNearestId = 0x20000000u;
  if (deepest > touch.separation + 2e-3f * core::rounded_to_float(size))
    list.add(touch.position, touch.separation, kNearestId);
  list.choose(patch);
}

}  // namespace

bool convex_convex(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch) {
  patch.count = 0;
  const Core ca(a), cb(b);
  const double radii = ca.radius() + cb.radius();
  const Way way = separation(ca, cb, query);
  if (!(way.depth < 1e300)) return false;
  query.apart = core::rounded_to_float(-way.depth - radii);
  if (-way.depth - radii > double(query.margin)) return true;
  // Triangles share one cache.
  if (b.triangle == nullptr) query.cache = pack(way.normal);

  Touch touch;
  touch.normal = narrow(way.normal);
  touch.separation = core::rounded_to_float(-way.depth - radii);
  const V3d on_a = way.a + way.normal * ca.radius(), on_b = way.b - way.normal * cb.radius();
  touch.position = narrow((on_a + on_b) * 0.5);
  add_points(a, b, query, std::min(ca.size() + ca.radius(), cb.size() + cb.radius()), touch, patch);
  return true;
}

}  // namespace skerry::collision
