#include "bench/peers/peer_scene.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace skerry::peers {
namespace {

constexpr double kPi = 3.14159265358979323846;

void require(bool condition, const std::string& what) {
  if (!condition) throw std::invalid_argument("the peers cannot be given " + what);
}

std::vector<Vec3> scaled_points(const ConvexHull& hull) {
  std::vector<Vec3> points = hull.points;
  for (Vec3& point : points) point = point.cwiseProduct(hull.scale);
  return points;
}

PeerShape to_peer_shape(const ShapeGeometry& geometry) {
  PeerShape shape;
  if (const auto* box = std::get_if<Box>(&geometry)) {
    shape.half_extents = box->half_extents;
    shape.solid = convex_hull(box_corners(box->half_extents));
  } else if (const auto* sphere = std::get_if<Sphere>(&geometry)) {
    require(!sphere->hollow, "a hollow sphere");
    shape.form = Form::sphere;
    shape.radius = sphere->radius;
  } else if (const auto* hull = std::get_if<ConvexHull>(&geometry)) {
    shape.form = Form::hull;
    shape.solid = convex_hull(scaled_points(*hull));
  } else {
    require(false, "a shape other than box, sphere and convex hull");
  }
  return shape;
}

bool same_geometry(const PeerShape& shape, const ShapeGeometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) {
    return shape.form == Form::box && shape.half_extents == box->half_extents;
  }
  if (const auto* sphere = std::get_if<Sphere>(&geometry)) {
    return shape.form == Form::sphere && shape.radius == sphere->radius && !sphere->hollow;
  }
  if (const auto* hull = std::get_if<ConvexHull>(&geometry)) {
    return shape.form == Form::hull && shape.solid.points == scaled_points(*hull);
  }
  return false;
}

void set_mass(PeerBody& body, const PeerShape& shape, double density) {
  if (shape.form == Form::sphere) {
    const double r = shape.radius;
    body.mass = density * 4 / 3 * kPi * r * r * r;
    body.inertia.setConstant(0.4 * body.mass * r * r);
    return;
  }
  const SolidMass solid = solid_mass(shape.solid);
  const Vec3 diagonal = solid.unit_inertia.diagonal();
  const Mat3 rest = solid.unit_inertia - Mat3(diagonal.asDiagonal());
  require(solid.center.norm() < 1e-9 && rest.norm() < 1e-9 * diagonal.norm(),
          "a hull whose own frame is not central and principal");
  body.mass = density * solid.volume;
  body.inertia = body.mass * diagonal;
}

void require_plain(const BodyDesc& body) {
  require(body.type != BodyType::kinematic, "a kinematic body");
  require(body.shapes.size() == 1, "a body of no shape or several");
  const ShapeOptions& options = body.shapes[0].options;
  require(options.local_pose.position.isZero() &&
              options.local_pose.orientation.coeffs() == Quat::Identity().coeffs(),
          "a shape displaced in its body");
  require(!options.sensor && options.filter.group == 0 && options.filter.mask == 0xffffffffu,
          "a sensor or a collision filter");
  require(!body.mass && body.gravity_scale == 1, "a body with a mass or gravity of its own");
  require(body.linear_damping == 0 && body.angular_damping == 0, "damping");
  const AxisLocks& locks = body.locks;
  for (const bool locked : locks.translation) require(!locked, "an axis lock");
  for (const bool locked : locks.rotation) require(!locked, "an axis lock");
}

std::uint32_t find_or_add(std::vector<PeerShape>& shapes, const ShapeGeometry& geometry) {
  for (std::uint32_t i = 0; i < shapes.size(); ++i) {
    if (same_geometry(shapes[i], geometry)) return i;
  }
  shapes.push_back(to_peer_shape(geometry));
  return static_cast<std::uint32_t>(shapes.size() - 1);
}

PeerBody to_peer_body(const BodyDesc& desc, std::vector<PeerShape>& shapes) {
  require_plain(desc);
  const Shape& shape = desc.shapes[0];
  const Material material = shape.options.material.value_or(
      Material{desc.friction, desc.restitution, desc.rolling_resistance});
  require(material.restitution == 0 && material.rolling_resistance == 0,
          "restitution or rolling resistance");
  PeerBody body = {.shape = find_or_add(shapes, shape.geometry),
                   .fixed = desc.type == BodyType::fixed,
                   .pose = {desc.position, desc.orientation.normalized()},
                   .linear_velocity = desc.linear_velocity,
                   .angular_velocity = desc.angular_velocity,
                   .friction = material.friction};
  const double density = shape.options.density.value_or(desc.density);
  if (!body.fixed) set_mass(body, shapes[body.shape], density);
  return body;
}

}  // namespace

PeerScene make_peer_scene(scenes::SceneDesc source) {
  require(source.joints.empty(), "joints");
  require(source.fields.empty(), "force fields");
  require(source.events.empty(), "events");
  PeerScene scene;
  for (std::size_t i = 0; i < source.bodies.size(); ++i) {
    try {
      scene.bodies.push_back(to_peer_body(source.bodies[i], scene.shapes));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("body " + std::to_string(i) + ": " + error.what());
    }
  }
  scene.source = std::move(source);
  return scene;
}

}  // namespace skerry::peers
