#include "collision/time_of_impact.h"

#include <algorithm>
#include <cmath>

#include "core/trig.h"

namespace skerry::collision {

using core::Collider;
using core::cross;
using core::dot;
using core::ShapeType;

namespace {

// Of the largest ball in a cone, whose centre lies this far above the base.
double cone_inner_radius(const Collider& c) {
  const double r = double(c.size.x), height = 2 * double(c.size.y);
  return r * height / (r + std::sqrt(r * r + height * height));
}

double mesh_inner_radius(const core::MeshGeometry& mesh) {
  core::V3f low = mesh.vertices[0], high = low;
  for (const core::V3f& v : mesh.vertices) {
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  const core::V3f size = high - low;
  return double(0.125f * std::min({size.x, size.y, size.z}));
}

M3d turned(const V3d& axis, double angle, const M3d& axes) {
  const auto [sin, cos] = core::trig::sin_cos(angle);
  const auto turn = [&, s = sin, c = cos](const V3d& v) {
    return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c));
  };
  return {turn(axes.c0), turn(axes.c1), turn(axes.c2)};
}

}  // namespace

double inner_radius(const Collider& c) {
  switch (c.type) {
    case ShapeType::sphere:
    case ShapeType::capsule:
      return double(c.size.x);
    case ShapeType::cylinder:
      return double(std::min(c.size.x, c.size.y));
    case ShapeType::box:
    case ShapeType::ellipsoid:
      return double(std::min({c.size.x, c.size.y, c.size.z}));
    case ShapeType::cone:
      return cone_inner_radius(c);
    case ShapeType::hull:
      return double(c.hull->inner_radius);
    case ShapeType::mesh:
      return mesh_inner_radius(*c.mesh);
    default:
      return 0;
  }
}

V3d Sweep::center_at(double t) const {
  const double u = std::min(t, end);
  return (center + way * u) - bend * (u * (1 - u));
}

int Sweep::stretch_at(double t) const {
  return std::clamp(static_cast<int>(t * stretches), 0, stretches - 1);
}

void Sweep::set_stretch(int i, const Quat& from, const Quat& to) {
  Quat turn = to * from.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  Stretch& s = stretch[i];
  s.axes = matrix_of(from);
  s.angle = sine > 0 ? 2 * core::trig::atan2(sine, turn.w()) : 0;
  s.axis = sine > 0 ? wide(Vec3(turn.vec() / sine)) : V3d{0, 0, 0};
}

M3d Sweep::axes_at(double t) const {
  const double u = std::min(t, end);
  const int i = stretch_at(u);
  const Stretch& s = stretch[i];
  return s.angle == 0 ? s.axes : turned(s.axis, s.angle * (u * stretches - i), s.axes);
}

double Sweep::speed_along(const V3d& unit, double t) const {
  if (t >= end) return 0;
  const double steady = dot(unit, way), bent = dot(unit, bend);
  const double linear = steady + std::max(bent * (2 * t - 1), bent * (2 * end - 1));
  double fastest = 0;
  for (int i = stretch_at(t); i <= stretch_at(end); ++i) {
    const V3d across = cross(unit, stretch[i].axis);
    fastest = std::max(fastest, std::fabs(stretch[i].angle) * std::sqrt(dot(across, across)));
  }
  return linear + fastest * stretches * turn_radius;
}

void SweptShape::place(double t) {
  const M3d body = sweep->axes_at(t);
  if (core.kind == ConvexCore::Kind::triangle) {
    core.center = sweep->center_at(t);
    for (int i = 0; i < 3; ++i) core.corner[i] = body * corner[i];
    return;
  }
  core.center =
      sweep->center_at(t) + body * (local_center + local_axes * (shrink_about * (1 - shrink)));
  core.axes = product(body, local_axes);
  if (shrink == 1) return;
  core.axes = {core.axes.c0 * shrink, core.axes.c1 * shrink, core.axes.c2 * shrink};
}

void SweptShape::erode(const Collider& collider, double depth) {
  switch (collider.type) {
    case ShapeType::sphere:
    case ShapeType::capsule:
      core.radius -= depth;
      break;
    case ShapeType::cone: {
      const double inner = cone_inner_radius(collider);
      shrink = 1 - depth / inner;
      shrink_about = {0, inner - double(collider.size.y), 0};
      break;
    }
    case ShapeType::hull:
      shrink = 1 - depth / double(collider.hull->inner_radius);
      shrink_about = wide(collider.hull->center);
      break;
    default:
      core.size = core.size - V3d{depth, depth, depth};
      break;
  }
}

SweptShape swept_shape(const Collider& collider, const Sweep& sweep) {
  SweptShape shape;
  shape.sweep = &sweep;
  shape.core = convex_core(collider, {0, 0, 0}, shape.local_axes);
  shape.local_center = wide(collider.local_position);
  if (collider.has_local_rotation) shape.local_axes = matrix_of(collider.local_rotation);
  return shape;
}

SweptShape swept_triangle(const V3d (&corner)[3], const Sweep& sweep) {
  SweptShape shape;
  shape.sweep = &sweep;
  shape.core.kind = ConvexCore::Kind::triangle;
  for (int i = 0; i < 3; ++i) shape.corner[i] = corner[i];
  return shape;
}

namespace {

// What parts two shapes at one instant: a unit direction from a to b, and how far apart two planes
// across it may be moved (m).
struct Parting {
  V3d normal;
  double gap;
};

class ConvexPair {
 public:
  ConvexPair(SweptShape& a, SweptShape& b) : a_(a), b_(b) {}

  Parting part(double t) {
    place(t);
    const V3d guess = found_ ? normal_ : b_.core.center - a_.core.center;
    const CoreDistance d = core_distance(a_.core, {0, 0, 0}, b_.core, guess);
    if (!(d.distance > 0)) return {normal_, -1e300};
    found_ = true;
    normal_ = d.normal;
    return {d.normal, d.gap - a_.core.radius - b_.core.radius};
  }
  double gap_along(const V3d& normal, double t) {
    place(t);
    return dot(normal, b_.core.support(normal * -1.0) - a_.core.support(normal)) - a_.core.radius -
           b_.core.radius;
  }
  double closing(const V3d& normal, double t) const {
    return a_.sweep->speed_along(normal, t) + b_.sweep->speed_along(normal * -1.0, t);
  }

 private:
  void place(double t) {
    a_.place(t);
    b_.place(t);
  }
  SweptShape &a_, &b_;
  V3d normal_{0, 1, 0};
  bool found_ = false;
};

class PlanePair {
 public:
  PlanePair(SweptShape& a, const SweptPlane& b) : a_(a), b_(b) {}

  Parting part(double t) {
    const V3d normal = b_.sweep->axes_at(t) * b_.normal * -1.0;
    return {normal, gap_along(normal, t)};
  }
  double gap_along(const V3d& normal, double t) {
    a_.place(t);
    const V3d up = b_.sweep->axes_at(t) * b_.normal;
    const V3d on_plane = b_.sweep->center_at(t) + up * b_.offset;
    return dot(normal, on_plane - a_.core.support(normal)) - a_.core.radius;
  }
  double closing(const V3d& normal, double t) const {
    return a_.sweep->speed_along(normal, t) + b_.sweep->speed_along(normal * -1.0, t);
  }

 private:
  SweptShape& a_;
  const SweptPlane& b_;
};

// How long one direction is followed before the nearest points are sought again, and how often they
// are sought: a pair that is still not apart then counts as near.
constexpr int kMaxMarch = 24;
constexpr int kMaxPartings = 96;

template <class Pair>
double first_near_of(Pair pair, double near, double from, double last) {
  double t = from;
  for (int i = 0; i < kMaxPartings; ++i) {
    const Parting parting = pair.part(t);
    double gap = parting.gap;
    if (!(gap > near)) return t;
    for (int k = 0; k < kMaxMarch && gap > near; ++k) {
      const double closing = pair.closing(parting.normal, t);
      if (!(closing > 0)) return kNever;
      t += (gap - 0.5 * near) / closing;
      if (t > last) return kNever;
      gap = pair.gap_along(parting.normal, t);
    }
  }
  return t;
}

template <class Pair>
double first_apart_of(Pair pair, double near, double last) {
  constexpr int kSamples = 32;
  for (int i = 1; i < kSamples; ++i)
    if (pair.part(last * i / kSamples).gap > near) return last * i / kSamples;
  return kNever;
}

}  // namespace

double first_near(SweptShape& a, SweptShape& b, double near, double from, double last) {
  return first_near_of(ConvexPair(a, b), near, from, last);
}
double first_near(SweptShape& a, const SweptPlane& b, double near, double from, double last) {
  return first_near_of(PlanePair(a, b), near, from, last);
}
double first_apart(SweptShape& a, SweptShape& b, double near, double last) {
  return first_apart_of(ConvexPair(a, b), near, last);
}
double first_apart(SweptShape& a, const SweptPlane& b, double near, double last) {
  return first_apart_of(PlanePair(a, b), near, last);
}

}  // namespace skerry::collision
