#include "scenes/force_fields.h"

#include <algorithm>
#include <cmath>

#include "scenes/rigid_maths.h"

namespace skerry::scenes {
namespace {

double length(const Vec3& v) { return std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z()); }

Vec3 force(const UniformField& field, const FieldSample& at) {
  return field.force + at.mass * field.acceleration;
}
Vec3 force(const DragField& field, const FieldSample& at) {
  return -(field.linear + field.quadratic * length(at.velocity)) * at.velocity;
}
Vec3 force(const AttractorField& field, const FieldSample& at) {
  const Vec3 d = field.point - at.position;
  const double square = d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
  const double r2 = square + field.softening * field.softening;
  if (!(r2 > 0)) return Vec3::Zero();
  return (at.mass * field.strength / (r2 * std::sqrt(r2))) * d;
}
Vec3 force(const SpringField& field, const FieldSample& at) {
  return field.stiffness * (field.anchor - at.position) - field.damping * at.velocity;
}
Vec3 force(const WindField& field, const FieldSample& at) {
  const double gust = field.gust_amplitude * sin_cos(2 * kPi * at.time / field.gust_period).sin;
  const Vec3 wind = (1 + gust) * field.velocity;
  return field.drag * (wind - at.velocity);
}

}  // namespace

ForceField make_field(const FieldDesc& field, std::span<const BodyId> bodies) {
  std::vector<BodyId> only(bodies.begin(), bodies.end());
  std::sort(only.begin(), only.end());
  return std::visit(
      [&](const auto& law) -> ForceField {
        return [law, only = std::move(only)](const FieldSample& at) -> FieldForce {
          if (!only.empty() && !std::binary_search(only.begin(), only.end(), at.body)) return {};
          return {force(law, at), Vec3::Zero()};
        };
      },
      field.field);
}

}  // namespace skerry::scenes
