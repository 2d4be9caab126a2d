#include "collision/query_ray.h"

#include <algorithm>
#include <cmath>

namespace skerry::collision {
namespace {

using core::cross;
using core::dot;

double component(const V3d& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
V3d unit(int axis, double sign) {
  return {axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0};
}

// The stretch of the ray that lies in all convex sets met so far, and the normal where it begins.
struct Stretch {
  double enter = -HUGE_VAL, leave = HUGE_VAL;
  V3d normal{0, 0, 0};

  void from(double t, const V3d& n) {
    if (t <= enter) return;
    enter = t;
    normal = n;
  }
  void until(double t) { leave = std::min(leave, t); }
  void nowhere() { leave = -HUGE_VAL; }

  // The half-space whose boundary is `height` below the ray's origin and falls away by `rise` per t.
  void half_space(double height, double rise, const V3d& n) {
    if (rise < 0)
      from(-height / rise, n);
    else if (rise > 0)
      until(-height / rise);
    else if (height > 0)
      nowhere();
  }
  LocalHit result(double most) const {
    if (enter > leave || leave <= 0 || enter > most) return {};
    if (enter < 0) return {true, true, 0, normal};
    return {true, false, enter, normal};
  }
};

LocalHit ray_box(const V3d& half, const LocalRay& ray) {
  Stretch stretch;
  for (int axis = 0; axis < 3; ++axis) {
    const double o = component(ray.origin, axis), d = component(ray.along, axis);
    const double h = component(half, axis);
    stretch.half_space(o - h, d, unit(axis, 1));
    stretch.half_space(-o - h, -d, unit(axis, -1));
  }
  return stretch.result(ray.most);
}

LocalHit ray_hull(const core::HullGeometry& hull, const LocalRay& ray) {
  Stretch stretch;
  for (const auto& face : hull.faces) {
    const V3d n = wide(face.normal);
    stretch.half_space(dot(n, ray.origin) - double(face.offset), dot(n, ray.along), n);
    if (stretch.enter > stretch.leave) return {};
  }
  return stretch.result(ray.most);
}

// Where a line is within a distance of the origin: the roots of |o + t d| = radius. Nothing if it
// only grazes.
struct Roots {
  bool real = false;
  double enter = 0, leave = 0;
};
Roots roots(double dd, double od, double rest_squared, double radius) {
  // rest_squared: of the line's nearest distance from the origin; free of cancellation.
  const double under = radius * radius - rest_squared;
  if (!(under > 0) || !(dd > 0)) return {};
  const double root = std::sqrt(under / dd), middle = -od / dd;
  return {true, middle - root, middle + root};
}

LocalHit ray_sphere(const V3d& center, double radius, const LocalRay& ray) {
  const V3d o = ray.origin - center, d = ray.along;
  const double dd = dot(d, d), od = dot(o, d);
  const V3d nearest = o - d * (od / dd);
  const Roots r = roots(dd, od, dot(nearest, nearest), radius);
  if (!r.real) return {};
  Stretch stretch;
  stretch.from(r.enter, o + d * r.enter);
  stretch.until(r.leave);
  return stretch.result(ray.most);
}

// The infinite cylinder about the y axis: where the ray is in it. `parallel`: it never enters or
// leaves.
struct Tube {
  bool parallel = false, meets = false;
  double enter = -HUGE_VAL, leave = HUGE_VAL;
};
Tube tube(double radius, const LocalRay& ray) {
  const V3d o{ray.origin.x, 0, ray.origin.z}, d{ray.along.x, 0, ray.along.z};
  const double dd = dot(d, d);
  if (!(dd > 1e-30 * dot(ray.along, ray.along)))
    return {true, dot(o, o) <= radius * radius, -HUGE_VAL, HUGE_VAL};
  const V3d nearest = o - d * (dot(o, d) / dd);
  const Roots r = roots(dd, dot(o, d), dot(nearest, nearest), radius);
  return {false, r.real, r.enter, r.leave};
}
V3d radial(const LocalRay& ray, double t) {
  return {ray.origin.x + ray.along.x * t, 0, ray.origin.z + ray.along.z * t};
}

LocalHit ray_cylinder(double radius, double half, const LocalRay& ray) {
  const Tube side = tube(radius, ray);
  if (!side.meets) return {};
  Stretch stretch;
  stretch.half_space(ray.origin.y - half, ray.along.y, {0, 1, 0});
  stretch.half_space(-ray.origin.y - half, -ray.along.y, {0, -1, 0});
  if (!side.parallel) {
    stretch.from(side.enter, radial(ray, side.enter));
    stretch.until(side.leave);
  }
  return stretch.result(ray.most);
}

// The union of a cylinder's side and two balls: it is entered where the first of them is.
LocalHit ray_capsule(double radius, double half, const LocalRay& ray) {
  const V3d o = ray.origin;
  const V3d axis{0, std::clamp(o.y, -half, half), 0};
  if (dot(o - axis, o - axis) < radius * radius) return {true, true, 0, {0, 0, 0}};
  LocalHit best;
  const auto consider = [&best](const LocalHit& hit) {
    if (hit.hit && !hit.inside && (!best.hit || hit.t < best.t)) best = hit;
  };
  consider(ray_sphere({0, half, 0}, radius, ray));
  consider(ray_sphere({0, -half, 0}, radius, ray));
  const Tube side = tube(radius, ray);
  if (side.meets && !side.parallel && side.enter >= 0 && side.enter <= ray.most &&
      std::abs(o.y + ray.along.y * side.enter) <= half)
    consider({true, false, side.enter, radial(ray, side.enter)});
  return best;
}

// x^2 + z^2 = (k u)^2 with u = half - y, the distance below the apex, from 0 to 2 half.
LocalHit ray_cone(double radius, double half, const LocalRay& ray) {
  const V3d o = ray.origin, d = ray.along;
  const double k = radius / (2 * half), kk = k * k, ou = half - o.y, du = -d.y;
  const double c = o.x * o.x + o.z * o.z - kk * ou * ou;
  if (c < 0 && ou > 0 && ou < 2 * half) return {true, true, 0, {0, 0, 0}};
  LocalHit best;
  const auto consider = [&](double t, const V3d& normal) {
    if (t >= 0 && t <= ray.most && (!best.hit || t < best.t)) best = {true, false, t, normal};
  };
  const auto side = [&](double t) {
    const V3d p = o + d * t;
    const double u = half - p.y;
    if (!(u >= 0 && u <= 2 * half)) return;
    const V3d normal{p.x, kk * u, p.z};
    if (dot(normal, d) < 0) consider(t, normal);
  };
  const double a = d.x * d.x + d.z * d.z - kk * du * du, b = o.x * d.x + o.z * d.z - kk * ou * du;
  // Of the two forms of a root each is taken where it does not cancel. The discriminant
  // b^2 - a c, factored in the same spirit: the cross products of o and d.
  const double oxd = o.x * d.z - o.z * d.x, xu = o.x * du - d.x * ou, zu = o.z * du - d.z * ou;
  const double under = kk * (xu * xu + zu * zu) - oxd * oxd;
  if (under >= 0) {
    const double q = -(b + std::copysign(std::sqrt(under), b));
    if (a != 0) side(q / a);
    if (q != 0) side(c / q);
  }
  if (d.y > 0) {
    const double t = (-half - o.y) / d.y;
    const V3d p = radial(ray, t);
    if (dot(p, p) <= radius * radius) consider(t, {0, -1, 0});
  }
  return best;
}

LocalHit ray_ellipsoid(const V3d& s, const LocalRay& ray) {
  const auto scaled = [&s](const V3d& v) { return V3d{v.x / s.x, v.y / s.y, v.z / s.z}; };
  LocalHit hit = ray_sphere({0, 0, 0}, 1, {scaled(ray.origin), scaled(ray.along), ray.most});
  hit.normal = scaled(hit.normal);
  return hit;
}

LocalHit ray_plane(const V3d& normal, double offset, const LocalRay& ray) {
  Stretch stretch;
  stretch.half_space(dot(normal, ray.origin) - offset, dot(normal, ray.along), normal);
  return stretch.result(ray.most);
}

}  // namespace

LocalHit ray_shape(const core::Collider& collider, const LocalRay& ray) {
  using core::ShapeType;
  const V3d size = wide(collider.size);
  switch (collider.type) {
    case ShapeType::sphere:
      return ray_sphere({0, 0, 0}, size.x, ray);
    case ShapeType::capsule:
      return ray_capsule(size.x, size.y, ray);
    case ShapeType::box:
      return ray_box(size, ray);
    case ShapeType::cylinder:
      return ray_cylinder(size.x, size.y, ray);
    case ShapeType::cone:
      return ray_cone(size.x, size.y, ray);
    case ShapeType::ellipsoid:
      return ray_ellipsoid(size, ray);
    case ShapeType::hull:
      return ray_hull(*collider.hull, ray);
    case ShapeType::plane:
      return ray_plane(size, collider.plane_offset, ray);
    default:
      return {};
  }
}

TriangleRay::TriangleRay(const LocalRay& ray) : ray_(ray) {
  const V3d& d = ray.along;
  z_ = std::abs(d.x) > std::abs(d.y) ? (std::abs(d.x) > std::abs(d.z) ? 0 : 2)
                                     : (std::abs(d.y) > std::abs(d.z) ? 1 : 2);
  x_ = (z_ + 1) % 3;
  y_ = (x_ + 1) % 3;
  shear_x_ = component(d, x_) / component(d, z_);
  shear_y_ = component(d, y_) / component(d, z_);
  shear_z_ = 1 / component(d, z_);
}

LocalHit TriangleRay::hit(const V3d& a, const V3d& b, const V3d& c) const {
  const auto sheared = [this](const V3d& vertex) {
    const V3d r = vertex - ray_.origin;
    const double z = component(r, z_);
    return V3d{component(r, x_) - shear_x_ * z, component(r, y_) - shear_y_ * z, shear_z_ * z};
  };
  const V3d p = sheared(a), q = sheared(b), r = sheared(c);
  // Twice the areas seen from the ray; of an edge's two triangles exactly opposite.
  const double u = r.x * q.y - r.y * q.x, v = p.x * r.y - p.y * r.x, w = q.x * p.y - q.y * p.x;
  if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return {};
  const double sum = u + v + w;
  if (sum == 0) return {};
  const double t = (u * p.z + v * q.z + w * r.z) / sum;
  if (!(t >= 0 && t <= ray_.most)) return {};
  return {true, false, t, cross(b - a, c - a)};
}

}  // namespace skerry::collision
