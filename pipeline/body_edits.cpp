#include "pipeline/body_edits.h"

#include <algorithm>
#include <cmath>

#include "collision/geometry_build.h"
#include "collision/height_field.h"
#include "collision/time_of_impact.h"
#include "core/mass_properties.h"
#include "core/rounding.h"
#include "core/trig.h"
#include "pipeline/edge_checks.h"
#include "pipeline/joint_edits.h"
#include "pipeline/publish.h"
#include "pipeline/world_data.h"
#include "solver/finalise.h"

namespace skerry::pipeline {
namespace {

using core::BodyIndex;
using core::Collider;
using core::ColliderIndex;
using core::kNone;
using core::MassProperties;
using core::ShapeType;

// A shape with its shared geometry built, before anything in the world has changed.
struct BuiltShape {
  Collider collider;
  std::shared_ptr<const void> geometry;
  double radius = 0;    // m, of the shape about its own origin
  MassProperties mass;  // in the shape's frame; zero for planes
};

core::V3f floats(double x, double y, double z) {
  return {core::rounded_to_float(x), core::rounded_to_float(y), core::rounded_to_float(z)};
}

MassProperties hull_mass(const core::HullGeometry& hull, double density) {
  std::vector<Vec3> vertices;
  for (const core::V3f& v : hull.vertices) vertices.push_back(core::to_double(v));
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto& face : hull.faces) {
    const std::uint16_t* corner = &hull.face_vertices[face.first];
    for (std::uint32_t i = 2; i < face.count; ++i) {
      triangles.push_back({corner[0], corner[i - 1], corner[i]});
    }
  }
  return core::closed_mesh(vertices, triangles, density);
}

struct ShapeBuilder {
  WorldData& world;
  const std::string& field;
  double density;
  bool needs_mass;
  BuiltShape& out;

  void basic(ShapeType type, core::V3f size, double radius, const MassProperties& mass) const {
    out.collider.type = type;
    out.collider.size = size;
    out.radius = radius;
    out.mass = mass;
  }
  void operator()(const Sphere& s) const {
    basic(
        ShapeType::sphere, floats(s.radius, 0, 0), s.radius,
        s.hollow ? core::hollow_sphere(s.radius, density) : core::solid_sphere(s.radius, density));
  }
  void operator()(const Capsule& s) const {
    basic(ShapeType::capsule, floats(s.radius, s.half_height, 0), s.radius + s.half_height,
          core::solid_capsule(s.radius, s.half_height, density));
  }
  void operator()(const Box& s) const {
    const Vec3& h = s.half_extents;
    basic(ShapeType::box, floats(h.x(), h.y(), h.z()), h.norm(), core::solid_box(h, density));
  }
  void operator()(const Cylinder& s) const {
    basic(ShapeType::cylinder, floats(s.radius, s.half_height, 0),
          std::sqrt(s.radius * s.radius + s.half_height * s.half_height),
          core::solid_cylinder(s.radius, s.half_height, density));
  }
  void operator()(const Cone& s) const {
    basic(ShapeType::cone, floats(s.radius, s.half_height, 0),
          std::sqrt(s.radius * s.radius + s.half_height * s.half_height),
          core::solid_cone(s.radius, s.half_height, density));
  }
  void operator()(const Ellipsoid& s) const {
    const Vec3& a = s.semi_axes;
    basic(ShapeType::ellipsoid, floats(a.x(), a.y(), a.z()), a.maxCoeff(),
          core::solid_ellipsoid(a, density));
  }
  void operator()(const ConvexHull& s) const {
    std::shared_ptr<const core::HullGeometry> hull;
    try {
      hull = world.geometry.hull(s.points, s.scale);
    } catch (const std::invalid_argument& error) {
      throw InputError(field + ".points", field + ".points: " + error.what());
    }
    double radius = 0;
    for (const Vec3& point : s.points)
      radius = std::max(radius, point.cwiseProduct(s.scale).norm());
    basic(ShapeType::hull, floats(0, 0, 0), radius, hull_mass(*hull, density));
    out.collider.hull = hull.get();
    out.geometry = std::move(hull);
  }
  void operator()(const Plane& s) const {
    const Vec3 n = s.normal.normalized();
    basic(ShapeType::plane, floats(n.x(), n.y(), n.z()), 0, {});
    out.collider.plane_offset = s.offset;
  }
  void operator()(const TriangleMesh& s) const {
    std::shared_ptr<const core::MeshGeometry> mesh;
    try {
      mesh = world.geometry.mesh(s.data, s.scale);
    } catch (const std::invalid_argument& error) {
      throw InputError(field + ".data", field + ".data: " + error.what());
    }
    double radius = 0;
    for (const core::V3f& v : mesh->vertices) radius = std::max(radius, double(core::length(v)));
    basic(ShapeType::mesh, floats(0, 0, 0), radius, needs_mass ? solid_mass(s) : MassProperties{});
    out.collider.mesh = mesh.get();
    out.geometry = std::move(mesh);
  }
  void operator()(const HeightField& s) const {
    std::shared_ptr<const core::HeightFieldGeometry> height_field;
    try {
      height_field = world.geometry.height_field(s.data, s.scale);
    } catch (const std::invalid_argument& error) {
      throw InputError(field + ".data", field + ".data: " + error.what());
    }
    basic(ShapeType::height_field, floats(0, 0, 0), double(collision::field_radius(*height_field)),
          {});
    out.collider.field = height_field.get();
    out.geometry = std::move(height_field);
  }
  MassProperties solid_mass(const TriangleMesh& s) const {
    if (const std::string defect = collision::solid_defect(*s.data); !defect.empty()) {
      throw InputError(field + ".data", field +
                                            ".data: the mesh of a dynamic body must be closed, "
                                            "but " +
                                            defect);
    }
    std::vector<Vec3> vertices = s.data->vertices;
    for (Vec3& v : vertices) v = v.cwiseProduct(s.scale);
    const MassProperties mass = core::closed_mesh(vertices, s.data->triangles, density);
    if (!(mass.mass > 0)) {
      throw InputError(field + ".data",
                       field + ".data: the mesh is wound inside out or has no volume");
    }
    return mass;
  }
};

BuiltShape build_shape(WorldData& world, const BodyDesc& body, std::size_t index) {
  const Shape& shape = body.shapes[index];
  const ShapeOptions& options = shape.options;
  const std::string field = "shapes[" + std::to_string(index) + "]";
  BuiltShape built;
  const bool needs_mass =
      body.type == BodyType::dynamic && !options.sensor && !(body.mass && body.mass->inertia);
  std::visit(ShapeBuilder{world, field, options.density.value_or(body.density), needs_mass, built},
             shape.geometry);
  Collider& c = built.collider;
  c.sensor = options.sensor;
  c.filter = options.filter;
  c.shape_in_body = static_cast<std::uint32_t>(index);
  const Material material =
      options.material.value_or(Material{body.friction, body.restitution, body.rolling_resistance});
  c.friction = core::rounded_to_float(material.friction);
  c.restitution = core::rounded_to_float(material.restitution);
  c.rolling_resistance = core::rounded_to_float(material.rolling_resistance);
  return built;
}

// Mass, centre and inertia from the shapes, then the user's override.
MassProperties body_mass(const BodyDesc& body, const std::vector<BuiltShape>& shapes) {
  std::vector<MassProperties> parts;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (!shapes[i].collider.sensor && shapes[i].mass.mass > 0) {
      parts.push_back(core::placed(shapes[i].mass, body.shapes[i].options.local_pose));
    }
  }
  MassProperties mass = core::combined(parts);
  if (body.mass) {
    const MassOverride& given = *body.mass;
    if (mass.mass > 0) mass = core::scaled_to(mass, given.mass);
    mass.mass = given.mass;
    if (given.center) mass.center = *given.center;
    if (given.inertia) mass.inertia = *given.inertia;
  }
  if (body.type == BodyType::dynamic) check_dynamic_mass(mass, body.mass.has_value());
  return mass;
}

bool isotropic(const Mat3& inertia) {
  const double mean = inertia.trace() / 3;
  return (inertia - mean * Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-9 * mean;
}

core::DynamicTraits dynamic_traits(const WorldSettings& settings, const BodyDesc& body,
                                   const MassProperties& mass) {
  core::DynamicTraits traits;
  traits.mass = mass.mass;
  traits.inertia = mass.inertia;
  if (settings.continuous && body.continuous == ContinuousCollision::automatic)
    traits.flags |= core::kContinuous;
  if (isotropic(mass.inertia)) traits.flags |= core::kIsotropic;
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (body.locks.translation[i]) traits.flags |= core::kLockX << i;
    if (body.locks.rotation[i]) traits.flags |= core::kLockRx << i;
  }
  return traits;
}

core::BodyMass mass_row(const BodyDesc& body, const MassProperties& mass,
                        const std::vector<BuiltShape>& shapes) {
  core::BodyMass row;
  row.local_center = mass.center;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const double offset = (body.shapes[i].options.local_pose.position - mass.center).norm();
    row.radius = std::max(row.radius, offset + shapes[i].radius);
  }
  row.gravity_scale = body.gravity_scale;
  row.linear_damping = body.linear_damping;
  row.angular_damping = body.angular_damping;
  return row;
}

ColliderIndex take_collider(core::Colliders& colliders) {
  if (!colliders.free_rows.empty()) {
    const ColliderIndex row = colliders.free_rows.back();
    colliders.free_rows.pop_back();
    return row;
  }
  colliders.rows.emplace_back();
  colliders.geometry.emplace_back();
  return static_cast<ColliderIndex>(colliders.rows.size() - 1);
}

void insert_descending(std::vector<std::uint32_t>& rows, std::uint32_t row) {
  rows.insert(std::lower_bound(rows.begin(), rows.end(), row, std::greater<>()), row);
}

// Of a shape at this distance (m) from the centre of mass. Balls, and the ends of capsules, turn into
// themselves; planes reach as far as anything.
float turn_radius(const BuiltShape& shape, double offset) {
  const Collider& c = shape.collider;
  if (c.type == ShapeType::plane) return 1e9f;
  const double turning = c.type == ShapeType::sphere    ? 0
                         : c.type == ShapeType::capsule ? double(c.size.y)
                                                        : shape.radius;
  return core::rounded_to_float(1.000001 * (offset + turning));
}

void place_shapes(WorldData& world, BodyIndex body, const BodyDesc& desc,
                  std::vector<BuiltShape>& shapes) {
  // Backwards, so that the chain runs in the order of BodyDesc::shapes.
  std::vector<ColliderIndex> rows(shapes.size());
  for (ColliderIndex& row : rows) row = take_collider(world.colliders);
  ColliderIndex next = kNone;
  for (std::size_t i = shapes.size(); i-- > 0;) {
    Collider& c = shapes[i].collider;
    const Pose& local = desc.shapes[i].options.local_pose;
    const Quat rotation = local.orientation.normalized();
    c.alive = true;
    c.body = body;
    c.next_in_body = next;
    const Vec3 offset = local.position - world.bodies.mass[body].local_center;
    c.local_position = core::to_float(offset);
    c.turn_radius = turn_radius(shapes[i], offset.norm());
    c.local_rotation = core::to_float(rotation);
    c.has_local_rotation = rotation.x() != 0 || rotation.y() != 0 || rotation.z() != 0;
    world.colliders.rows[rows[i]] = c;
    world.colliders.geometry[rows[i]] = std::move(shapes[i].geometry);
    next = rows[i];
  }
  world.bodies.first_collider[body] = next;
  set_radii(world, body);
  world.broadphase->add(world.bodies, world.colliders, body);
}

template <class Visit>
void for_each_collider(const WorldData& world, BodyIndex body, Visit visit) {
  for (ColliderIndex c = world.bodies.first_collider[body]; c != kNone;) {
    const ColliderIndex next = world.colliders.rows[c].next_in_body;
    visit(c);
    c = next;
  }
}

// The turn from one orientation to another by the shorter way: unit axis times angle, world axes.
Vec3 rotation_vector(const Quat& from, const Quat& to) {
  Quat turn = to * from.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  if (sine == 0) return Vec3::Zero();
  return turn.vec() * (2 * core::trig::atan2(sine, turn.w()) / sine);
}

// What it bears or rests on has changed by hand.
void reload(WorldData& world, BodyIndex body) {
  if (world.bodies.is(body, core::kDynamic)) world.bodies.flags[body] |= core::kReloaded;
}

}  // namespace

void require(const WorldData& world, BodyId body) {
  if (!world.bodies.alive(body)) {
    throw UsageError("body " + std::to_string(body.index) + " (generation " +
                     std::to_string(body.generation) + ") is not in this world; was it removed?");
  }
}

void wake(WorldData& world, BodyIndex body) {
  if (!world.bodies.is(body, core::kDynamic)) return;
  solver::wake_island(world.bodies, world.sleepers, body);
}

void wake_all(WorldData& world) {
  for (BodyIndex body = 0; body < world.bodies.rows(); ++body) {
    wake(world, body);
    reload(world, body);
  }
}

void disturb(WorldData& world, BodyIndex body) {
  wake(world, body);
  core::disturb(world.bodies, body);
  for (const core::ContactPair& pair : world.contacts.pairs) {
    if ((pair.flags & (core::kTouching | core::kSensorPair)) != core::kTouching) continue;
    if (pair.body_a != body && pair.body_b != body) continue;
    const BodyIndex other = pair.body_a == body ? pair.body_b : pair.body_a;
    wake(world, other);
    reload(world, other);
  }
}

void refresh_kinematic_awake(WorldData& world, BodyIndex body) {
  core::Bodies& bodies = world.bodies;
  if (!bodies.is(body, core::kKinematic)) return;
  const core::BodyMotion& motion = bodies.motion[body];
  const bool moves = motion.linear != Vec3::Zero() || motion.angular != Vec3::Zero();
  const std::uint32_t before = bodies.flags[body];
  bodies.flags[body] = moves ? before | core::kAwake : before & ~std::uint32_t{core::kAwake};
  if (bodies.flags[body] != before) bodies.awake_stale = true;
}

void set_radii(WorldData& world, BodyIndex body) {
  core::BodyMass& row = world.bodies.mass[body];
  row.inner_radius = row.turn_radius = 0;
  for (ColliderIndex i = world.bodies.first_collider[body]; i != kNone;
       i = world.colliders.rows[i].next_in_body) {
    const Collider& c = world.colliders.rows[i];
    if (c.sensor || c.type == ShapeType::plane) continue;
    const auto inner = core::rounded_to_float(collision::inner_radius(c));
    row.inner_radius = row.inner_radius > 0 ? std::min(row.inner_radius, inner) : inner;
    row.turn_radius = std::max(row.turn_radius, c.turn_radius);
  }
}

void make_type(WorldData& world, BodyIndex body, BodyType type) {
  core::Bodies& bodies = world.bodies;
  const core::DynamicTraits& traits = bodies.as_dynamic[body];
  core::BodyMass& row = bodies.mass[body];
  constexpr std::uint32_t kOfDynamic = core::kDynamic | core::kContinuous | core::kIsotropic |
                                       core::kLockMask | core::kFast | core::kAwake;
  std::uint32_t flags = bodies.flags[body] & ~(kOfDynamic | core::kKinematic);
  row.mass = row.inv_mass = 0;
  row.inertia_b.setZero();
  row.inv_inertia_b.setZero();
  if (type == BodyType::kinematic) flags |= core::kKinematic;
  if (type == BodyType::dynamic) {
    flags |= core::kDynamic | core::kAwake | traits.flags;
    row.mass = traits.mass;
    row.inv_mass = 1 / traits.mass;
    row.inertia_b = traits.inertia;
    row.inv_inertia_b = traits.inertia.inverse();
  }
  bodies.flags[body] = flags;
  bodies.awake_stale = true;
}

BodyId add_body(WorldData& world, const BodyDesc& body) {
  check_body(body);
  std::vector<BuiltShape> shapes;
  for (std::size_t i = 0; i < body.shapes.size(); ++i) {
    shapes.push_back(build_shape(world, body, i));
  }
  const MassProperties mass = body_mass(body, shapes);

  core::Bodies& bodies = world.bodies;
  const BodyIndex row = core::take_row(bodies);
  if (body.allow_sleep) bodies.flags[row] |= core::kAllowSleep;
  if (mass.center.isZero(0)) bodies.flags[row] |= core::kCentred;
  bodies.mass[row] = mass_row(body, mass, shapes);
  bodies.as_dynamic[row] = dynamic_traits(world.settings, body, mass);
  make_type(world, row, body.type);
  bodies.pose[row] =
      core::center_frame({body.position, body.orientation.normalized()}, mass.center);
  bodies.user_data[row] = body.user_data;
  core::set_motion(bodies, row, body.linear_velocity, body.angular_velocity);
  refresh_kinematic_awake(world, row);
  place_shapes(world, row, body, shapes);
  world.rows_stale = true;
  if (body.type == BodyType::dynamic && !body.awake && body.allow_sleep) {
    solver::put_to_sleep(bodies, world.sleepers, {&row, 1});
  }
  world.queries.note(row, QueryPictures::Edit::shapes);
  return bodies.id(row);
}

void remove_body(WorldData& world, BodyId body) {
  require(world, body);
  const BodyIndex row = body.index;
  disturb(world, row);
  for (std::uint32_t j = 0; j < world.joints.rows.size(); ++j) {
    const core::Joint& joint = world.joints.rows[j];
    if (joint.alive && (joint.a == row || joint.b == row)) {
      remove_joint(world, {j, joint.generation});
    }
  }
  collision::drop_pairs_of_body(world.contacts, row);
  collect_end_events(world, world.pending_end_events);
  for_each_collider(world, row, [&](ColliderIndex c) {
    world.broadphase->remove(c);
    world.colliders.rows[c] = {};
    world.colliders.geometry[c].reset();
    insert_descending(world.colliders.free_rows, c);
  });
  core::free_row(world.bodies, row);
  world.queries.note(row, QueryPictures::Edit::shapes);
  world.bodies.awake_stale = true;
  world.rows_stale = true;
}

void set_pose(WorldData& world, BodyId body, const Pose& pose) {
  require(world, body);
  check_pose("pose", pose);
  core::Bodies& bodies = world.bodies;
  disturb(world, body.index);
  bodies.flags[body.index] &= ~std::uint32_t{core::kQuarantined};
  bodies.pose[body.index] = core::center_frame({pose.position, pose.orientation.normalized()},
                                               bodies.mass[body.index].local_center);
  // Angular momentum follows from the velocity in the new orientation.
  core::set_motion(bodies, body.index, bodies.motion[body.index].linear,
                   bodies.motion[body.index].angular);
  wake(world, body.index);
  world.broadphase->touch(bodies, world.colliders, body.index);
  world.queries.note(body.index, QueryPictures::Edit::pose);
  if (!world.rows_stale) world.transforms[world.row_of[body.index]] = pose;
}

void set_velocity(WorldData& world, BodyId body, const Vec3& linear, const Vec3& angular) {
  require(world, body);
  check_rate("linear", linear);
  check_rate("angular", angular);
  if (!world.bodies.is(body.index, core::kDynamic) &&
      !world.bodies.is(body.index, core::kKinematic)) {
    throw UsageError("body " + std::to_string(body.index) + " is fixed: it cannot have a velocity");
  }
  wake(world, body.index);
  core::set_motion(world.bodies, body.index, linear, angular);
  refresh_kinematic_awake(world, body.index);
}

void move_kinematic(WorldData& world, BodyId body, const Pose& target, double dt) {
  require(world, body);
  check_pose("target", target);
  if (!world.bodies.is(body.index, core::kKinematic)) {
    throw UsageError("body " + std::to_string(body.index) + " is not kinematic");
  }
  const core::BodyPose& now = world.bodies.pose[body.index];
  const core::BodyPose goal = core::center_frame({target.position, target.orientation.normalized()},
                                                 world.bodies.mass[body.index].local_center);
  set_velocity(world, body, (goal.center - now.center) / dt,
               rotation_vector(now.orientation, goal.orientation) / dt);
}

void apply_force(WorldData& world, BodyId body, const Vec3& force, const Vec3& torque) {
  require(world, body);
  check_finite("force", force);
  check_finite("torque", torque);
  if (!world.bodies.is(body.index, core::kDynamic)) return;
  wake(world, body.index);
  core::add_force(world.bodies, body.index, force, torque);
}

void apply_impulse(WorldData& world, BodyId body, const Vec3& impulse, const Vec3& offset) {
  require(world, body);
  check_finite("impulse", impulse);
  check_finite("point", offset);
  core::Bodies& bodies = world.bodies;
  if (!bodies.is(body.index, core::kDynamic)) return;
  const core::BodyMass& mass = bodies.mass[body.index];
  const Mat3 inv_inertia =
      core::inv_inertia_w(mass, bodies.pose[body.index].orientation, bodies.flags[body.index]);
  const core::BodyMotion& motion = bodies.motion[body.index];
  const Vec3 linear = motion.linear + mass.inv_mass * impulse;
  const Vec3 angular = motion.angular + inv_inertia * offset.cross(impulse);
  check_impulse(impulse, linear, angular);
  wake(world, body.index);
  core::set_motion(bodies, body.index, linear, angular);
}

}  // namespace skerry::pipeline
