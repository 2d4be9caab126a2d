#include "pipeline/edge_checks.h"

#include <cmath>
#include <cstdio>

#include <skerry/error.h>

namespace skerry::pipeline {
namespace {

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}
std::string text(const Vec3& v) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "(%.9g, %.9g, %.9g)", v.x(), v.y(), v.z());
  return buffer;
}
std::string text(const Quat& q) {
  return "(x " + text(q.x()) + ", y " + text(q.y()) + ", z " + text(q.z()) + ", w " + text(q.w()) +
         ")";
}

[[noreturn]] void refuse(const std::string& field, const std::string& rule,
                         const std::string& value) {
  throw InputError(field, field + ": must be " + rule + ", got " + value);
}

bool finite(const Vec3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

// Of an enumerator, which casts and other languages can make anything.
template <class Enum>
void check_choice(const std::string& field, Enum value, Enum last) {
  const int number = static_cast<int>(value), most = static_cast<int>(last);
  if (number < 0 || number > most) {
    refuse(field, "one of its " + std::to_string(most + 1) + " choices", std::to_string(number));
  }
}

void check_count(const char* field, int count) {
  if (count < 1 || count > 10000) refuse(field, "between 1 and 10000", std::to_string(count));
}

// Of a part of a body from the body's origin: no farther than a shape can be long.
bool is_offset(const Vec3& value) { return value.cwiseAbs().maxCoeff() <= 1e7 && finite(value); }
void check_offset(const std::string& field, const Vec3& value) {
  if (!is_offset(value)) {
    refuse(field, "finite and at most 1e7 m in each axis", text(value));
  }
}

struct GeometryCheck {
  const std::string& field;
  BodyType type;

  void operator()(const Sphere& s) const { check_length(field + ".radius", s.radius); }
  void operator()(const Capsule& s) const {
    check_length(field + ".radius", s.radius);
    check_length(field + ".half_height", s.half_height);
  }
  void operator()(const Box& s) const { lengths(".half_extents", s.half_extents); }
  void operator()(const Cylinder& s) const {
    check_length(field + ".radius", s.radius);
    check_length(field + ".half_height", s.half_height);
  }
  void operator()(const Cone& s) const {
    check_length(field + ".radius", s.radius);
    check_length(field + ".half_height", s.half_height);
  }
  void operator()(const Ellipsoid& s) const { lengths(".semi_axes", s.semi_axes); }
  void operator()(const ConvexHull& s) const {
    if (s.points.size() < 4) {
      refuse(field + ".points", "at least 4 points", std::to_string(s.points.size()));
    }
    for (std::size_t i = 0; i < s.points.size(); ++i) {
      check_offset(field + ".points[" + std::to_string(i) + "]", s.points[i]);
    }
    lengths(".scale", s.scale);
    Vec3 low = s.points[0], high = low;
    for (const Vec3& point : s.points) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    if (!is_offset(low.cwiseProduct(s.scale)) || !is_offset(high.cwiseProduct(s.scale)))
      refuse(field + ".scale", "one that leaves the points within 1e7 m in each axis",
             text(s.scale));
    const double size = (high - low).cwiseProduct(s.scale).maxCoeff();
    if (!(size >= 1e-6)) refuse(field + ".points", "at least 1e-6 m across", text(size));
  }
  void operator()(const Plane& s) const {
    if (type == BodyType::dynamic) {
      throw InputError(field, field + ": a plane belongs to a fixed or kinematic body");
    }
    check_unit(field + ".normal", s.normal);
    if (!(std::abs(s.offset) <= 1e12))
      refuse(field + ".offset", "finite and at most 1e12 m in size", text(s.offset));
  }
  void operator()(const TriangleMesh& s) const {
    if (!s.data) throw InputError(field + ".data", field + ".data: must not be null");
    if (s.data->triangles.empty()) refuse(field + ".data", "a mesh with triangles", "an empty one");
    lengths(".scale", s.scale);
  }
  void operator()(const HeightField& s) const {
    if (type == BodyType::dynamic) {
      throw InputError(field, field + ": a height field belongs to a fixed or kinematic body");
    }
    if (!s.data) throw InputError(field + ".data", field + ".data: must not be null");
    lengths(".scale", s.scale);
  }

 private:
  void lengths(const char* name, const Vec3& v) const {
    const char* axes[] = {".x", ".y", ".z"};
    for (int i = 0; i < 3; ++i) check_length(field + name + axes[i], v[i]);
  }
};

void check_shape(const std::string& field, const Shape& shape, BodyType type) {
  std::visit(GeometryCheck{field, type}, shape.geometry);
  check_offset(field + ".local_pose.position", shape.options.local_pose.position);
  check_rotation(field + ".local_pose.orientation", shape.options.local_pose.orientation);
  if (shape.options.density) check_positive(field + ".density", *shape.options.density);
  if (shape.options.material) check_material(field + ".material.", *shape.options.material);
}

}  // namespace

void check_finite(const std::string& field, double value) {
  if (!std::isfinite(value)) refuse(field, "finite", text(value));
}
void check_finite(const std::string& field, const Vec3& value) {
  if (!finite(value)) refuse(field, "finite", text(value));
}
void check_positive(const std::string& field, double value) {
  if (!std::isfinite(value) || value <= 0) refuse(field, "positive and finite", text(value));
}
void check_not_negative(const std::string& field, double value) {
  if (!std::isfinite(value) || value < 0) refuse(field, "zero or more and finite", text(value));
}
void check_coefficient(const std::string& field, double value) {
  if (!(value >= 0 && value <= 1e6)) refuse(field, "between 0 and 1e6", text(value));
}
void check_frequency(const std::string& field, double value) {
  if (value != 0 && !(value >= 1e-9 && value <= 1e9))
    refuse(field, "0 or between 1e-9 and 1e9 Hz", text(value));
}
void check_position(const std::string& field, const Vec3& value) {
  if (!finite(value) || value.cwiseAbs().maxCoeff() > 1e12) {
    refuse(field, "finite and at most 1e12 m in each axis", text(value));
  }
}
void check_rate(const std::string& field, const Vec3& value) {
  if (!finite(value) || value.cwiseAbs().maxCoeff() > 1e9) {
    refuse(field, "finite and at most 1e9 per second in each axis", text(value));
  }
}
void check_impulse(const Vec3& impulse, const Vec3& linear, const Vec3& angular) {
  if (finite(linear) && finite(angular) && linear.cwiseAbs().maxCoeff() <= 1e9 &&
      angular.cwiseAbs().maxCoeff() <= 1e9) {
    return;
  }
  refuse("impulse", "one that leaves the body at velocities of at most 1e9 per second",
         text(impulse));
}
void check_mass(const std::string& field, double value) {
  if (!(value >= 1e-20 && value <= 1e30)) {
    refuse(field, "a mass between 1e-20 and 1e30 kg", text(value));
  }
}
void check_length(const std::string& field, double value) {
  if (!(value >= 1e-6 && value <= 1e7)) {
    refuse(field, "a length between 1e-6 and 1e7 m", text(value));
  }
}
void check_rotation(const std::string& field, const Quat& value) {
  const double norm = std::sqrt(value.x() * value.x() + value.y() * value.y() +
                                value.z() * value.z() + value.w() * value.w());
  if (!(std::abs(norm - 1) <= 1e-3)) refuse(field, "a unit quaternion", text(value));
}
void check_pose(const std::string& field, const Pose& pose) {
  check_position(field + ".position", pose.position);
  check_rotation(field + ".orientation", pose.orientation);
}
void check_unit(const std::string& field, const Vec3& value) {
  if (!finite(value) || !(std::abs(value.norm() - 1) <= 1e-3)) {
    refuse(field, "a unit vector", text(value));
  }
}

void check_query_point(const std::string& field, const Vec3& point) {
  check_finite(field, point);
  if (point.cwiseAbs().maxCoeff() > 1e15) refuse(field, "within 1e15 m of the origin", text(point));
}

namespace {
void check_translation(const std::string& field, const Vec3& translation) {
  check_query_point(field, translation);
  if (!(translation.norm() >= 1e-9)) refuse(field, "at least 1e-9 m long", text(translation));
}
}  // namespace

void check_ray(const RayCast& ray) {
  check_query_point("origin", ray.origin);
  check_translation("translation", ray.translation);
}
void check_cast(const ShapeCast& cast) {
  check_query_pose("pose", cast.pose);
  check_translation("translation", cast.translation);
}
void check_query_pose(const std::string& field, const Pose& pose) {
  check_query_point(field + ".position", pose.position);
  check_rotation(field + ".orientation", pose.orientation);
}
void check_max_distance(double max_distance) {
  if (!(max_distance >= 0 && max_distance <= 1e15))
    refuse("max_distance", "between 0 and 1e15 m", text(max_distance));
}
void check_query_shape(const Shape& shape) {
  const auto& g = shape.geometry;
  if (std::holds_alternative<Plane>(g) || std::holds_alternative<TriangleMesh>(g) ||
      std::holds_alternative<HeightField>(g))
    throw InputError("shape", "shape: a query needs a convex shape that is bounded");
  check_shape("shape", shape, BodyType::fixed);
}

void check_settings(const WorldSettings& settings) {
  check_rate("gravity", settings.gravity);
  if (settings.workers < 0 || settings.workers > 1024) {
    refuse("workers", "between 0 (automatic) and 1024", std::to_string(settings.workers));
  }
  check_choice("mode", settings.mode, ThreadingMode::job_system);
  check_choice("block_policy", settings.block_policy, BlockPolicy::never);
  check_choice("affinity", settings.affinity, Affinity::spread);
  check_choice("integrator", settings.integrator, Integrator::exact);
  check_choice("broadphase", settings.broadphase, BroadphaseKind::fcl);
  check_choice("solver.kind", settings.solver.kind, SolverKind::penalty);
  check_choice("solver.pgs.correction", settings.solver.pgs.correction,
               PositionCorrection::split_impulse);
  if (!(settings.rate_hz >= 1 && settings.rate_hz <= 1e6)) {
    refuse("rate_hz", "between 1 and 1e6 Hz", text(settings.rate_hz));
  }
  check_not_negative("wait.spin_us", settings.wait.spin_us);
  const SolverSettings& solver = settings.solver;
  if (solver.substeps < 1 || solver.substeps > 64) {
    refuse("solver.substeps", "between 1 and 64", std::to_string(solver.substeps));
  }
  check_count("solver.pgs.iterations", solver.pgs.iterations);
  check_not_negative("solver.pgs.correction_rate", solver.pgs.correction_rate);
  check_not_negative("solver.pgs.slop", solver.pgs.slop);
  check_count("solver.penalty.substeps", solver.penalty.substeps);
  check_positive("solver.penalty.hertz", solver.penalty.hertz);
  check_positive("solver.contact_hertz", solver.contact_hertz);
  check_coefficient("solver.contact_damping_ratio", solver.contact_damping_ratio);
  check_not_negative("solver.max_push_velocity", solver.max_push_velocity);
  check_not_negative("solver.restitution_threshold", solver.restitution_threshold);
  check_positive("solver.joint_hertz", solver.joint_hertz);
  check_coefficient("solver.joint_damping_ratio", solver.joint_damping_ratio);
  check_not_negative("sleep.linear_threshold", settings.sleep.linear_threshold);
  check_not_negative("sleep.angular_threshold", settings.sleep.angular_threshold);
  check_positive("sleep.time", settings.sleep.time);
  if (!(settings.hit_speed >= 0)) refuse("hit_speed", "zero or more", text(settings.hit_speed));
  if (settings.pool && settings.mode != ThreadingMode::job_system &&
      settings.mode != ThreadingMode::dedicated_thread_jobs) {
    throw InputError("pool", std::string("pool: only the job_system modes run on a host's pool, "
                                         "not ") +
                                 to_string(settings.mode));
  }
}

namespace {
void check_damping(const std::string& field, double value) {
  if (!(value >= 0 && value <= 1e9)) refuse(field, "between 0 and 1e9 per second", text(value));
}
}  // namespace

void check_body_type(BodyType type) { check_choice("type", type, BodyType::kinematic); }

void check_body(const BodyDesc& body) {
  check_body_type(body.type);
  check_choice("continuous", body.continuous, ContinuousCollision::never);
  for (std::size_t i = 0; i < body.shapes.size(); ++i) {
    check_shape("shapes[" + std::to_string(i) + "]", body.shapes[i], body.type);
  }
  check_position("position", body.position);
  check_rotation("orientation", body.orientation);
  check_rate("linear_velocity", body.linear_velocity);
  check_rate("angular_velocity", body.angular_velocity);
  check_positive("density", body.density);
  check_material("", {body.friction, body.restitution, body.rolling_resistance});
  if (!(std::abs(body.gravity_scale) <= 1e9)) {
    refuse("gravity_scale", "finite and at most 1e9 in size", text(body.gravity_scale));
  }
  check_damping("linear_damping", body.linear_damping);
  check_damping("angular_damping", body.angular_damping);
  if (body.mass) {
    check_mass("mass.mass", body.mass->mass);
    if (body.mass->center) check_offset("mass.center", *body.mass->center);
  }
  if (body.type == BodyType::fixed &&
      (body.linear_velocity != Vec3::Zero() || body.angular_velocity != Vec3::Zero())) {
    throw InputError("linear_velocity", "linear_velocity: a fixed body cannot have a velocity");
  }
}

void check_material(const std::string& field, const Material& material) {
  check_coefficient(field + "friction", material.friction);
  check_not_negative(field + "restitution", material.restitution);
  if (material.restitution > 1) {
    refuse(field + "restitution", "at most 1", text(material.restitution));
  }
  check_coefficient(field + "rolling_resistance", material.rolling_resistance);
}

void check_dynamic_mass(const core::MassProperties& mass, bool given) {
  if (!(mass.mass > 0)) {
    throw InputError("mass", "mass: a dynamic body without solid shapes needs its mass given");
  }
  if (!given) return check_mass("mass", mass.mass);
  if (!core::is_physical_inertia(mass.inertia)) {
    throw InputError("mass.inertia",
                     "mass.inertia: must be symmetric, positive definite and obey the triangle "
                     "inequality of principal moments");
  }
  if (!(mass.inertia.inverse().cwiseAbs().maxCoeff() <= 1e36)) {
    throw InputError("mass.inertia", "mass.inertia: too small, its inverse is beyond 1e36");
  }
}

void check_time_step(double dt) {
  if (!(dt >= 1e-6 && dt <= 1)) refuse("dt", "between 1e-6 and 1 s", text(dt));
}

void check_command(const Command& command) {
  struct Check {
    void operator()(const Impulse& c) const {
      check_finite("impulse", c.impulse);
      if (c.point) check_finite("point", *c.point);
    }
    void operator()(const Force& c) const {
      check_finite("force", c.force);
      check_finite("torque", c.torque);
    }
    void operator()(const SetVelocity& c) const {
      check_rate("linear", c.linear);
      check_rate("angular", c.angular);
    }
    void operator()(const SetPose& c) const { check_pose("pose", c.pose); }
    void operator()(const Spawn& c) const { check_body(c.body); }
    void operator()(const RemoveBody&) const {}
    void operator()(const SetType&) const {}
    void operator()(const SetFilter&) const {}
    void operator()(const SetMaterial& c) const { check_material("material.", c.material); }
    void operator()(const SetSensor&) const {}
  };
  std::visit(Check{}, command);
}

}  // namespace skerry::pipeline
