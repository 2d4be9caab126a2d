#include "tests/collision/narrowphase_fixture.h"

#include <algorithm>
#include <numbers>

#include "collision/geometry_build.h"

namespace skerry::test {

using core::Collider;
using core::ShapeType;

void SerialTask::run_phases(jobs::PhaseProgram& program) {
  for (std::uint32_t phase = 0; phase < program.phase_count(); ++phase)
    for (std::uint32_t block = 0; block < program.block_count(phase); ++block)
      program.run_block(phase, block, 0);
}

PairScene::PairScene() : scratch_(collision::make_narrowphase_scratch(1)) {}

namespace {

struct Build {
  Collider& c;
  std::shared_ptr<const void>& keep;

  void set(ShapeType type, double x, double y = 0, double z = 0) {
    c.type = type;
    c.size = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  void operator()(const Sphere& s) { set(ShapeType::sphere, s.radius); }
  void operator()(const Capsule& s) { set(ShapeType::capsule, s.radius, s.half_height); }
  void operator()(const Box& s) {
    set(ShapeType::box, s.half_extents.x(), s.half_extents.y(), s.half_extents.z());
  }
  void operator()(const Cylinder& s) { set(ShapeType::cylinder, s.radius, s.half_height); }
  void operator()(const Cone& s) { set(ShapeType::cone, s.radius, s.half_height); }
  void operator()(const Ellipsoid& s) {
    set(ShapeType::ellipsoid, s.semi_axes.x(), s.semi_axes.y(), s.semi_axes.z());
  }
  void operator()(const ConvexHull& s) {
    auto hull = collision::build_hull(s.points);
    set(ShapeType::hull, 0);
    c.hull = hull.get();
    keep = std::move(hull);
  }
  void operator()(const Plane& s) {
    set(ShapeType::plane, s.normal.x(), s.normal.y(), s.normal.z());
    c.plane_offset = s.offset;
  }
  void operator()(const TriangleMesh& s) {
    auto mesh = collision::build_mesh(*s.data, s.scale);
    set(ShapeType::mesh, 0);
    c.mesh = mesh.get();
    keep = std::move(mesh);
  }
  void operator()(const HeightField& s) {
    auto field = collision::build_height_field(*s.data, s.scale);
    set(ShapeType::height_field, 0);
    c.field = field.get();
    keep = std::move(field);
  }
};

}  // namespace

core::ColliderIndex PairScene::add(const ShapeGeometry& geometry, const Pose& pose, bool dynamic) {
  const core::BodyIndex body = core::take_row(bodies);
  bodies.flags[body] |= dynamic ? core::kDynamic | core::kAwake : 0u;
  bodies.mass[body].radius = 10;
  colliders.rows.emplace_back();
  colliders.geometry.emplace_back();
  Collider& collider = colliders.rows.back();
  collider.turn_radius = 10;
  collider.alive = true;
  collider.body = body;
  Build build{collider, colliders.geometry.back()};
  std::visit(build, geometry);
  set_pose(body, pose);
  return body;
}

std::uint32_t PairScene::pair(core::ColliderIndex a, core::ColliderIndex b, bool sensor) {
  const bool mesh =
      core::is_surface(colliders.rows[a].type) || core::is_surface(colliders.rows[b].type);
  core::ContactPair pair;
  pair.a = a;
  pair.b = b;
  pair.body_a = colliders.rows[a].body;
  pair.body_b = colliders.rows[b].body;
  pair.manifold_capacity = static_cast<std::uint16_t>(mesh ? core::kMeshManifolds : 1);
  pair.first_manifold = core::take_manifolds(contacts, pair.manifold_capacity);
  core::take_memory(contacts, pair.first_manifold);
  pair.flags = sensor ? core::kSensorPair : 0u;
  const auto row = static_cast<std::uint32_t>(contacts.pairs.size());
  contacts.active.push_back(row);
  contacts.pairs.push_back(pair);
  return row;
}

void PairScene::set_pose(core::ColliderIndex body, const Pose& pose) {
  bodies.pose[body].center = pose.position;
  bodies.pose[body].orientation = pose.orientation;
}

void PairScene::set_motion(core::ColliderIndex body, const Vec3& linear, const Vec3& angular) {
  bodies.motion[body].linear = linear;
  bodies.motion[body].angular = angular;
}

core::StepContext PairScene::context(core::ContactTable& table) {
  core::StepContext step;
  step.dt = dt;
  step.settings = &settings;
  step.bodies = &bodies;
  step.colliders = &colliders;
  step.contacts = &table;
  step.narrowphase = scratch_.get();
  return step;
}

void PairScene::collide(const core::StepContext& step) {
  SerialTask task;
  const auto active = static_cast<std::uint32_t>(step.contacts->active.size());
  collision::collide_pairs(step, {0, active}, task);
}

void PairScene::collide() { collide(context(contacts)); }

Vec3 PairScene::world(std::uint32_t pair, const core::ManifoldPoint& point) const {
  return bodies.pose[contacts.pairs[pair].body_a].center + core::to_double(point.position);
}

float PairScene::deepest(std::uint32_t pair) {
  float deepest = 1e30f;
  for (std::uint32_t i = 0; i < contact(pair).manifold_count; ++i)
    for (std::uint32_t k = 0; k < manifold(pair, i).point_count; ++k)
      deepest = std::min(deepest, manifold(pair, i).points[k].separation);
  return deepest;
}

double Random::uniform(double low, double high) {
  return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
}
Vec3 Random::in_box(double half) {
  const double x = uniform(-half, half), y = uniform(-half, half), z = uniform(-half, half);
  return {x, y, z};
}
Vec3 Random::unit() {
  Vec3 v = in_box(1);
  while (v.norm() > 1 || v.norm() < 1e-3) v = in_box(1);
  return v.normalized();
}
Quat Random::rotation() {
  Eigen::Vector4d q{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
  while (q.norm() > 1 || q.norm() < 1e-2)
    q = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
  q.normalize();
  return Quat(q[3], q[0], q[1], q[2]);
}
Pose Random::pose(double half) { return {in_box(half), rotation()}; }
Quat Random::small_turn(double most) {
  const double angle = uniform(-most, most);
  return turned(angle, unit());
}
Quat Random::resting_rotation() {
  const double pi = std::numbers::pi;
  switch (static_cast<int>(uniform(0, 4))) {
    case 0:
      return turned(pi / 2 * static_cast<int>(uniform(0, 4)), {0, 1, 0});
    case 1:
      return turned(uniform(-pi, pi), {0, 1, 0});
    case 2: {
      const Quat tilt = small_turn(0.05);
      return tilt * turned(uniform(-pi, pi), {0, 1, 0});
    }
    default:
      return rotation();
  }
}

Pose at(const Vec3& position, const Quat& orientation) { return {position, orientation}; }
Quat turned(double angle, const Vec3& axis) {
  return Quat(Eigen::AngleAxisd(angle, axis.normalized()));
}
Pose moved(const Pose& motion, const Pose& pose) {
  return {motion.orientation * pose.position + motion.position,
          (motion.orientation * pose.orientation).normalized()};
}

}  // namespace skerry::test
