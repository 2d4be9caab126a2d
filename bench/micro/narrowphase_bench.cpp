// What the narrowphase costs per pair and step: the stage itself on one thread, with gathering,
// matching of features and manifolds written back; FCL on the same poses beside it.
//
//   resting   b lies on a, shaken by micrometres: axes are kept
//   sliding   b has moved on by 20 mm in every step: nothing can be kept
//   on mesh   b lies on hills of 100,352 triangles
//
// `best_ns_per_pair` is the fastest of all steps, which a busy machine disturbs least.
//
//   skerry_bench_micro --benchmark_filter=narrowphase
#include <cmath>
#include <ctime>
#include <memory>
#include <random>

#include <benchmark/benchmark.h>
#include <fcl/fcl.h>

#include "collision/geometry_build.h"
#include "collision/narrowphase.h"

namespace {

using namespace skerry;

class OneWorker final : public core::Task {
 public:
  std::uint32_t worker() const override { return 0; }
  void run_phases(jobs::PhaseProgram&) override {}
};

double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::vector<Vec3> icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2, scale = 0.5 / std::sqrt(1 + g * g);
  std::vector<Vec3> points;
  for (const double s : {-scale, scale})
    for (const double t : {-g * scale, g * scale}) {
      points.emplace_back(0, s, t);
      points.emplace_back(s, t, 0);
      points.emplace_back(t, 0, s);
    }
  return points;
}

MeshData hills() {
  constexpr std::uint32_t kCells = 224;
  constexpr double kCell = 0.25;
  MeshData mesh;
  for (std::uint32_t z = 0; z <= kCells; ++z)
    for (std::uint32_t x = 0; x <= kCells; ++x)
      mesh.vertices.emplace_back(
          kCell * x, 0.3 * std::sin(0.4 * kCell * x) * std::cos(0.3 * kCell * z), kCell * z);
  for (std::uint32_t z = 0; z < kCells; ++z)
    for (std::uint32_t x = 0; x < kCells; ++x) {
      const std::uint32_t v = z * (kCells + 1) + x;
      mesh.triangles.push_back({v, v + kCells + 1, v + 1});
      mesh.triangles.push_back({v + 1, v + kCells + 1, v + kCells + 2});
    }
  return mesh;
}
double hill_height(double x, double z) { return 0.3 * std::sin(0.4 * x) * std::cos(0.3 * z); }

enum class Kind {
  sphere_sphere,
  sphere_box,
  box_box,
  hull_hull,
  box_hull,
  sphere_mesh,
  capsule_mesh,
  box_mesh,
  cylinder_mesh,
  hull_mesh
};

struct PairWorld {
  core::Bodies bodies;
  core::Colliders colliders;
  core::ContactTable contacts;
  WorldSettings settings;
  OneWorker task;
  collision::NarrowphaseScratchPtr scratch = collision::make_narrowphase_scratch(1);
  std::shared_ptr<const core::HullGeometry> hull = collision::build_hull(icosahedron());
  std::shared_ptr<const core::MeshGeometry> mesh;
  std::mt19937 random{1};

  double uniform(double most) {
    return std::uniform_real_distribution<double>(-most, most)(random);
  }

  core::BodyIndex add(core::ShapeType type, const Vec3& center, const Quat& orientation) {
    const core::BodyIndex body = core::take_row(bodies);
    bodies.flags[body] |= core::kDynamic | core::kAwake;
    bodies.pose[body] = {center, orientation};
    bodies.mass[body].radius = type == core::ShapeType::mesh ? 100 : 1;
    core::Collider collider;
    collider.alive = true;
    collider.type = type;
    collider.body = body;
    collider.size = {0.5f, 0.5f, 0.5f};
    collider.turn_radius = 1;
    collider.hull = hull.get();
    collider.mesh = mesh.get();
    colliders.rows.push_back(collider);
    return body;
  }

  void add_pair(core::BodyIndex a, core::BodyIndex b, std::uint32_t capacity) {
    core::ContactPair pair;
    pair.a = pair.body_a = a;
    pair.b = pair.body_b = b;
    pair.manifold_capacity = static_cast<std::uint16_t>(capacity);
    pair.first_manifold = core::take_manifolds(contacts, capacity);
    core::take_memory(contacts, pair.first_manifold);
    contacts.active.push_back(static_cast<std::uint32_t>(contacts.pairs.size()));
    contacts.pairs.push_back(pair);
  }

  double step() {
    core::StepContext context;
    context.dt = 1.0 / 60;
    context.settings = &settings;
    context.bodies = &bodies;
    context.colliders = &colliders;
    context.contacts = &contacts;
    context.narrowphase = scratch.get();
    const double begin = thread_seconds();
    collision::collide_pairs(context, {0, static_cast<std::uint32_t>(contacts.active.size())},
                             task);
    return thread_seconds() - begin;
  }
};

core::ShapeType first_type(Kind kind) {
  switch (kind) {
    case Kind::box_box:
    case Kind::box_hull:
      return core::ShapeType::box;
    case Kind::hull_hull:
      return core::ShapeType::hull;
    case Kind::sphere_mesh:
    case Kind::capsule_mesh:
    case Kind::box_mesh:
    case Kind::cylinder_mesh:
    case Kind::hull_mesh:
      return core::ShapeType::mesh;
    default:
      return core::ShapeType::sphere;
  }
}
core::ShapeType second_type(Kind kind) {
  switch (kind) {
    case Kind::sphere_sphere:
    case Kind::sphere_mesh:
      return core::ShapeType::sphere;
    case Kind::sphere_box:
    case Kind::box_box:
    case Kind::box_mesh:
      return core::ShapeType::box;
    case Kind::capsule_mesh:
      return core::ShapeType::capsule;
    case Kind::cylinder_mesh:
      return core::ShapeType::cylinder;
    default:
      return core::ShapeType::hull;
  }
}

// How high b's centre lies above a's when the two just touch.
double touching_height(Kind kind) {
  constexpr double kHullInner = 0.3973;  // of an icosahedron of circumradius 0.5
  switch (kind) {
    case Kind::hull_mesh:
      return kHullInner;
    case Kind::hull_hull:
      return 2 * kHullInner;
    case Kind::box_hull:
      return 0.5 + kHullInner;
    case Kind::sphere_mesh:
    case Kind::capsule_mesh:
    case Kind::box_mesh:
    case Kind::cylinder_mesh:
      return 0.5;
    default:
      return 1;
  }
}

// The turn that lays a face of the hull level.
Quat level(const core::HullGeometry& hull, const Vec3& up) {
  return Quat::FromTwoVectors(core::to_double(hull.faces[0].normal), up);
}
// How b lies on the hills: hulls on a face, capsules (radius and half length 0.5) on their side.
Quat lying(const PairWorld& world, core::ShapeType type) {
  if (type == core::ShapeType::hull) return level(*world.hull, -Vec3::UnitY());
  if (type == core::ShapeType::capsule) return Quat::FromTwoVectors(Vec3::UnitY(), Vec3::UnitX());
  return Quat::Identity();
}

void build(PairWorld& world, Kind kind, int count) {
  const bool on_mesh = first_type(kind) == core::ShapeType::mesh;
  if (on_mesh) {
    world.mesh = collision::build_mesh(hills(), Vec3::Ones());
    world.add(core::ShapeType::mesh, Vec3::Zero(), Quat::Identity());
  }
  for (int i = 0; i < count; ++i) {
    const Quat yaw(Eigen::AngleAxisd(world.uniform(3), Vec3::UnitY()));
    if (on_mesh) {
      const double x = 28 + world.uniform(26), z = 28 + world.uniform(26);
      const double height = hill_height(x, z) + touching_height(kind) - 0.01;
      const core::BodyIndex b =
          world.add(second_type(kind), {x, height, z}, Quat(yaw * lying(world, second_type(kind))));
      world.add_pair(0, b, core::kMeshManifolds);
      continue;
    }
    const Vec3 at(3.0 * (i % 64), 0, 3.0 * (i / 64));
    const bool a_is_hull = first_type(kind) == core::ShapeType::hull;
    const bool b_is_hull = second_type(kind) == core::ShapeType::hull;
    const core::BodyIndex a =
        world.add(first_type(kind), at,
                  a_is_hull ? level(*world.hull, Vec3::UnitY()) : Quat(Quat::Identity()));
    const Vec3 above{world.uniform(0.1), touching_height(kind) - 0.001, world.uniform(0.1)};
    const core::BodyIndex b =
        world.add(second_type(kind), at + above,
                  b_is_hull ? Quat(yaw * level(*world.hull, -Vec3::UnitY())) : yaw);
    world.add_pair(a, b, 1);
  }
}

// Moves every b sideways and back, by at most so much.
void shake(PairWorld& world, std::uint64_t step, double by) {
  for (const core::ContactPair& pair : world.contacts.pairs) {
    Vec3& center = world.bodies.pose[pair.body_b].center;
    center.x() += step % 2 == 0 ? by : -by;
    center.z() += step / 2 % 2 == 0 ? by : -by;
  }
}

void run(benchmark::State& state, Kind kind, int count, double by) {
  PairWorld world;
  build(world, kind, count);
  std::uint64_t steps = 0;
  for (; steps < 8; ++steps) {
    shake(world, steps, by);
    world.step();
  }
  double best = 1e9;
  for (auto _ : state) {
    shake(world, steps++, by);
    const double took = world.step();
    state.SetIterationTime(took);
    best = std::min(best, took);
  }
  double points = 0;
  for (const core::ContactPair& pair : world.contacts.pairs)
    for (std::uint32_t i = 0; i < pair.manifold_count; ++i)
      points += world.contacts.manifolds[pair.first_manifold + i].point_count;
  state.counters["best_ns_per_pair"] = 1e9 * best / count;
  state.counters["points_per_pair"] = points / count;
}

// -- FCL on the same poses.

using FclGeometry = std::shared_ptr<fcl::CollisionGeometryd>;

FclGeometry fcl_hull(const core::HullGeometry& hull) {
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  for (const core::V3f& v : hull.vertices) vertices->push_back(core::to_double(v));
  auto faces = std::make_shared<std::vector<int>>();
  for (const core::HullGeometry::Face& face : hull.faces) {
    faces->push_back(face.count);
    for (int i = 0; i < face.count; ++i) faces->push_back(hull.face_vertices[face.first + i]);
  }
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(hull.faces.size()), faces);
}

FclGeometry fcl_mesh(const core::MeshGeometry& mesh) {
  auto model = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  std::vector<fcl::Vector3d> vertices;
  std::vector<fcl::Triangle> triangles;
  for (const core::V3f& v : mesh.vertices) vertices.push_back(core::to_double(v));
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  model->beginModel();
  model->addSubModel(vertices, triangles);
  model->endModel();
  return model;
}

FclGeometry fcl_geometry(const core::Collider& collider) {
  switch (collider.type) {
    case core::ShapeType::sphere:
      return std::make_shared<fcl::Sphered>(0.5);
    case core::ShapeType::capsule:
      return std::make_shared<fcl::Capsuled>(0.5, 1);
    case core::ShapeType::cylinder:
      return std::make_shared<fcl::Cylinderd>(0.5, 1);
    case core::ShapeType::box:
      return std::make_shared<fcl::Boxd>(1, 1, 1);
    case core::ShapeType::hull:
      return fcl_hull(*collider.hull);
    default:
      return fcl_mesh(*collider.mesh);
  }
}

// FCL's capsules and cylinders lie along z.
fcl::Transform3d fcl_pose(const core::BodyPose& pose, core::ShapeType type) {
  fcl::Transform3d transform = fcl::Transform3d::Identity();
  transform.linear() = pose.orientation.toRotationMatrix();
  if (type == core::ShapeType::capsule || type == core::ShapeType::cylinder)
    transform.linear() *= Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY()).toRotationMatrix();
  transform.translation() = pose.center;
  return transform;
}

void run_fcl(benchmark::State& state, Kind kind, int count) {
  PairWorld world;
  build(world, kind, count);
  const core::ContactPair& first = world.contacts.pairs[0];
  const FclGeometry a = fcl_geometry(world.colliders.rows[first.a]);
  const FclGeometry b = fcl_geometry(world.colliders.rows[first.b]);
  const auto pose = [&](core::BodyIndex body, core::ColliderIndex collider) {
    return fcl_pose(world.bodies.pose[body], world.colliders.rows[collider].type);
  };
  double best = 1e9, points = 0;
  for (auto _ : state) {
    points = 0;
    const double begin = thread_seconds();
    for (const core::ContactPair& pair : world.contacts.pairs) {
      const fcl::CollisionRequestd request(64, true);
      fcl::CollisionResultd result;
      points += static_cast<double>(fcl::collide(a.get(), pose(pair.body_a, pair.a), b.get(),
                                                 pose(pair.body_b, pair.b), request, result));
    }
    const double took = thread_seconds() - begin;
    state.SetIterationTime(took);
    best = std::min(best, took);
  }
  state.counters["best_ns_per_pair"] = 1e9 * best / count;
  state.counters["points_per_pair"] = points / count;
}

constexpr int kPairs = 4096, kOnMesh = 512, kOfFcl = 256;
constexpr double kShaken = 2e-6, kSlid = 0.02;  // m

#define SKERRY_NARROWPHASE_BENCH(name, ...) \
  BENCHMARK_CAPTURE(__VA_ARGS__)            \
      ->Name("narrowphase/" name)           \
      ->UseManualTime()                     \
      ->Unit(benchmark::kMicrosecond)       \
      ->MinTime(0.2)
#define SKERRY_NARROWPHASE_ROWS(kind, count)                                                   \
  SKERRY_NARROWPHASE_BENCH(#kind "/resting", run, kind##_resting, Kind::kind, count, kShaken); \
  SKERRY_NARROWPHASE_BENCH(#kind "/sliding", run, kind##_sliding, Kind::kind, count, kSlid);   \
  SKERRY_NARROWPHASE_BENCH(#kind "/fcl", run_fcl, kind##_fcl, Kind::kind, kOfFcl)
SKERRY_NARROWPHASE_ROWS(sphere_sphere, kPairs);
SKERRY_NARROWPHASE_ROWS(sphere_box, kPairs);
SKERRY_NARROWPHASE_ROWS(box_box, kPairs);
SKERRY_NARROWPHASE_ROWS(box_hull, kPairs);
SKERRY_NARROWPHASE_ROWS(hull_hull, kPairs);
SKERRY_NARROWPHASE_ROWS(sphere_mesh, kOnMesh);
SKERRY_NARROWPHASE_ROWS(capsule_mesh, kOnMesh);
SKERRY_NARROWPHASE_ROWS(box_mesh, kOnMesh);
SKERRY_NARROWPHASE_ROWS(cylinder_mesh, kOnMesh);
SKERRY_NARROWPHASE_ROWS(hull_mesh, kOnMesh);

}  // namespace
