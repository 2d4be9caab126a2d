// Every kind of broadphase against brute force over the fat boxes, step by step.
#include "collision/broadphase.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <thread>
#include <utility>

#include <gtest/gtest.h>
#include <skerry/jobs/executor.h>

#include "collision/box_tree.h"
#include "collision/geometry_build.h"
#include "tests/support/rounds.h"
#include "tests/support/shuffling_executor.h"

namespace skerry::collision {
namespace {

using core::BodyIndex;
using core::Collider;
using core::ContactPair;
using core::kNone;
using core::ShapeType;

class StubTask final : public Task {
 public:
  explicit StubTask(std::uint32_t worker = 0) : worker_(worker) {}
  std::uint32_t worker() const override { return worker_; }
  void run_phases(jobs::PhaseProgram& program) override {
    for (std::uint32_t phase = 0; phase < program.phase_count(); ++phase)
      for (std::uint32_t block = 0; block < program.block_count(phase); ++block)
        program.run_block(phase, block, worker_);
  }

 private:
  std::uint32_t worker_;
};

constexpr double kDt = 1.0 / 60;

// Bodies, one or more colliders each, and one broadphase of each of the given kinds with its own
// pair table.
class Scene {
 public:
  struct Side {
    std::unique_ptr<Broadphase> broadphase;
    core::ContactTable contacts;
    std::uint32_t workers;
  };

  explicit Scene(std::vector<std::pair<BroadphaseKind, std::uint32_t>> kinds_and_workers) {
    for (const auto& [kind, workers] : kinds_and_workers)
      sides.push_back({make_broadphase(kind), {}, workers});
  }

  BodyIndex add_body(std::uint32_t type, const Vec3& position) {
    const BodyIndex body = core::take_row(bodies);
    bodies.flags[body] |= type | (type != 0 ? core::kAwake : 0u);
    bodies.pose[body].center = position;
    bodies.awake_stale = true;
    return body;
  }

  ColliderIndex add_collider(BodyIndex body, Collider collider) {
    collider.alive = true;
    collider.body = body;
    collider.next_in_body = bodies.first_collider[body];
    ColliderIndex index;
    if (!colliders.free_rows.empty()) {
      index = colliders.free_rows.back();
      colliders.free_rows.pop_back();
      colliders.rows[index] = collider;
    } else {
      index = static_cast<ColliderIndex>(colliders.rows.size());
      colliders.rows.push_back(collider);
    }
    bodies.first_collider[body] = index;
    for (Side& side : sides) side.broadphase->add(bodies, colliders, body);
    return index;
  }

  void remove_body(BodyIndex body) {
    for (ColliderIndex c = bodies.first_collider[body]; c != kNone;) {
      for (Side& side : sides) {
        side.broadphase->remove(c);
        drop_pairs_of(side.contacts, c);
      }
      const ColliderIndex next = colliders.rows[c].next_in_body;
      colliders.rows[c].alive = false;
      colliders.free_rows.push_back(c);
      c = next;
    }
    core::free_row(bodies, body);
    bodies.awake_stale = true;
  }

  void touch_body(BodyIndex body) {
    for (Side& side : sides) side.broadphase->touch(bodies, colliders, body);
  }

  StepContext context(Side& side) {
    StepContext step;
    step.dt = kDt;
    step.worker_count = side.workers;
    step.bodies = &bodies;
    step.colliders = &colliders;
    step.contacts = &side.contacts;
    step.joints = &joints;
    step.broadphase = side.broadphase.get();
    return step;
  }

  void step() {
    core::refresh_awake(bodies);
    for (Side& side : sides) {
      const StepContext context_of_side = context(side);
      const auto chunks = [&](std::uint32_t count, auto&& kernel) {
        // One chunk per worker, last first: order must not matter.
        const std::uint32_t chunk = count / side.workers + 1;
        for (std::uint32_t w = side.workers; w-- > 0;) {
          StubTask task(w);
          const std::uint32_t begin = std::min(count, w * chunk),
                              end = std::min(count, begin + chunk);
          if (begin < end) kernel(context_of_side, IndexRange{begin, end}, task);
        }
      };
      StubTask task;
      chunks(static_cast<std::uint32_t>(bodies.awake.size()), update_bounds);
      refit_broadphase(context_of_side, {0, 1}, task);
      moved = side.broadphase->moved_count();
      chunks(moved, query_pairs);
      merge_pairs(context_of_side, {0, 1}, task);
    }
  }

  bool may_pair(const Collider& a, const Collider& b) const {
    const auto type = [&](const Collider& c) {
      return bodies.flags[c.body] & (core::kDynamic | core::kKinematic);
    };
    if (a.body == b.body) return false;
    if (!core::filters_meet(a.filter, b.filter)) return false;
    if (bodies.is(a.body, core::kQuarantined) || bodies.is(b.body, core::kQuarantined))
      return false;
    const std::uint64_t key =
        (std::uint64_t{std::min(a.body, b.body)} << 32) | std::max(a.body, b.body);
    if (std::ranges::count(joints.no_collide, key)) return false;
    if (type(a) == core::kDynamic || type(b) == core::kDynamic) return true;
    return (a.sensor || b.sensor) && (type(a) == core::kKinematic || type(b) == core::kKinematic);
  }

  std::vector<std::uint64_t> brute_force(const Side& side) const {
    std::vector<std::uint64_t> keys;
    std::vector<Aabb> fat;
    for (ColliderIndex c = 0; c < colliders.rows.size(); ++c)
      fat.push_back(colliders.rows[c].alive ? side.broadphase->fat_bounds(c) : Aabb{});
    for (ColliderIndex a = 0; a < colliders.rows.size(); ++a)
      for (ColliderIndex b = a + 1; b < colliders.rows.size(); ++b) {
        if (!colliders.rows[a].alive || !colliders.rows[b].alive) continue;
        if (!overlap(fat[a], fat[b])) continue;
        if (may_pair(colliders.rows[a], colliders.rows[b]))
          keys.push_back((std::uint64_t{a} << 32) | b);
      }
    return keys;
  }

  void expect_sound(const Side& side) const {
    const core::ContactTable& table = side.contacts;
    std::vector<std::uint64_t> keys;
    std::set<std::uint32_t> manifolds;
    std::vector<std::uint32_t> awake, active_awake;
    for (std::uint32_t row = 0; row < table.pairs.size(); ++row) {
      const ContactPair& pair = table.pairs[row];
      keys.push_back(pair.key());
      const Collider &a = colliders.rows[pair.a], &b = colliders.rows[pair.b];
      ASSERT_EQ(pair.body_a, a.body);
      ASSERT_EQ(pair.body_b, b.body);
      const bool mesh = a.type == ShapeType::mesh || b.type == ShapeType::mesh;
      ASSERT_EQ(pair.manifold_capacity, mesh ? core::kMeshManifolds : 1u);
      ASSERT_EQ((pair.flags & core::kSensorPair) != 0, a.sensor || b.sensor);
      for (std::uint32_t m = 0; m < pair.manifold_capacity; ++m)
        ASSERT_TRUE(manifolds.insert(pair.first_manifold + m).second) << "a manifold of two pairs";
      if (bodies.is(pair.body_a, core::kAwake) || bodies.is(pair.body_b, core::kAwake))
        awake.push_back(row);
    }
    ASSERT_EQ(keys, brute_force(side));
    // Of sleepers, only what was touched or is new may be looked at.
    for (const std::uint32_t row : table.active)
      if (std::ranges::binary_search(awake, row)) active_awake.push_back(row);
    ASSERT_TRUE(std::ranges::is_sorted(table.active));
    ASSERT_EQ(active_awake, awake);
    expect_covered(side);
  }

  // Fat boxes hold what the contract says: tight box, speculative distance, a step's motion.
  void expect_covered(const Side& side) const {
    for (const BodyIndex body : bodies.awake)
      for (ColliderIndex c = bodies.first_collider[body]; c != kNone;
           c = colliders.rows[c].next_in_body) {
        const Aabb tight = tight_bounds(colliders.rows[c], bodies.pose[body]);
        const Aabb& fat = side.broadphase->fat_bounds(c);
        for (int axis = 0; axis < 3; ++axis) {
          // Far out the tight box moves in jumps of float's resolution; the shape does not.
          const double need =
              0.999 * double(kSpeculativeDistance) - std::abs(double(tight.min[axis])) * 0x1p-22;
          const double way = bodies.motion[body].linear[axis] * kDt;
          ASSERT_LE(double(fat.min[axis]), double(tight.min[axis]) - need + std::min(0.0, way));
          ASSERT_GE(double(fat.max[axis]), double(tight.max[axis]) + need + std::max(0.0, way));
        }
      }
  }

  core::Bodies bodies;
  core::Colliders colliders;
  core::Joints joints;
  std::vector<Side> sides;
  std::uint32_t moved = 0;
};

std::shared_ptr<const core::MeshGeometry> bumpy_mesh() {
  MeshData data;
  for (int i = 0; i < 5; ++i)
    for (int k = 0; k < 5; ++k)
      data.vertices.push_back({double(i), 0.3 * ((i + k) % 2), double(k)});
  for (unsigned i = 0; i < 4; ++i)
    for (unsigned k = 0; k < 4; ++k) {
      const unsigned a = 5 * i + k, b = a + 5;
      data.triangles.push_back({a, a + 1, b});
      data.triangles.push_back({b, a + 1, b + 1});
    }
  return build_mesh(data, {1, 1, 1});
}

Collider box_collider(float x, float y, float z) {
  Collider collider;
  collider.type = ShapeType::box;
  collider.size = {x, y, z};
  return collider;
}

// 200 steps of everything that may happen to a world.
class Script {
 public:
  Script(Scene& scene, unsigned seed) : scene_(scene), random_(seed), mesh_(bumpy_mesh()) {
    Collider plane;
    plane.type = ShapeType::plane;
    plane.size = {0, 1, 0};
    plane.plane_offset = -4;
    scene_.add_collider(scene_.add_body(0, {0, 0, 0}), plane);
    for (int i = 0; i < 60; ++i) add_random();
  }

  void step(int number) {
    for (int i = 0; i < 2; ++i) add_random();
    if (number % 2) remove_random();
    if (number % 3 == 0) teleport_random();
    if (number % 5 == 0) change_random_filter();
    if (number % 7 == 0) change_random_type();
    if (number % 11 == 0) join_random();
    if (number % 13 == 0) sleep_random();
    if (number % 17 == 0) quarantine_random();
    if (number == 100)
      for (int i = 0; i < 150; ++i) add_random();
    if (number == 150)
      while (alive().size() > 80) scene_.remove_body(alive().back());
    fly();
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vec3 somewhere() { return {uniform(-6, 6), uniform(-4, 4), uniform(-6, 6)}; }
  Quat turned() {
    std::normal_distribution<double> normal;
    return Quat{normal(random_), normal(random_), normal(random_), normal(random_)}.normalized();
  }
  std::vector<BodyIndex> alive() const {
    std::vector<BodyIndex> rows;
    for (BodyIndex body = 1; body < scene_.bodies.rows(); ++body)
      if (scene_.bodies.is(body, core::kAlive)) rows.push_back(body);
    return rows;
  }
  BodyIndex any() {
    const std::vector<BodyIndex> rows = alive();
    return rows[random_() % rows.size()];
  }

  Collider random_collider() {
    Collider collider;
    collider.type = ShapeType::box;
    collider.size = {float(uniform(0.05, 0.8)), float(uniform(0.05, 0.8)),
                     float(uniform(0.05, 0.8))};
    const auto pick = random_() % 20;
    if (pick < 6) collider.type = ShapeType::sphere;
    if (pick == 6) collider.type = ShapeType::cone;
    if (pick == 7) collider.size = {8, 0.1f, 0.1f};
    if (pick == 8) {
      collider.type = ShapeType::mesh;
      collider.mesh = mesh_.get();
    }
    collider.sensor = random_() % 10 == 0;
    collider.filter.category = 1u << (random_() % 3);
    if (random_() % 4 == 0) collider.filter.mask = 1u << (random_() % 3);
    if (random_() % 6 == 0) collider.filter.group = int(random_() % 5) - 2;
    return collider;
  }

  void add_random() {
    const auto pick = random_() % 10;
    const std::uint32_t type = pick < 6 ? core::kDynamic : pick < 8 ? core::kKinematic : 0u;
    const BodyIndex body = scene_.add_body(type, somewhere());
    if (type) {
      scene_.bodies.motion[body].linear = {uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)};
      scene_.bodies.motion[body].angular = {uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)};
      if (random_() % 10 == 0) scene_.bodies.motion[body].linear *= 20;
      if (random_() % 10 == 0) scene_.bodies.motion[body].angular *= 20;
    }
    const unsigned count = random_() % 5 == 0 ? 3 : 1;
    for (unsigned i = 0; i < count; ++i) {
      Collider collider = random_collider();
      if (i > 0) collider.local_position = {float(uniform(-1, 1)), 0, float(uniform(-1, 1))};
      scene_.add_collider(body, collider);
    }
  }
  void remove_random() { scene_.remove_body(any()); }
  void teleport_random() {
    const BodyIndex body = any();
    scene_.bodies.pose[body] = {somewhere(), turned()};
    scene_.touch_body(body);
  }
  void change_random_filter() {
    const BodyIndex body = any();
    scene_.colliders.rows[scene_.bodies.first_collider[body]].filter.mask = random_() % 8;
    scene_.touch_body(body);
  }
  void change_random_type() {
    const BodyIndex body = any();
    std::uint32_t& flags = scene_.bodies.flags[body];
    const std::uint32_t types[3] = {0, core::kDynamic | core::kAwake,
                                    core::kKinematic | core::kAwake};
    flags = (flags & ~std::uint32_t{core::kDynamic | core::kKinematic | core::kAwake}) |
            types[random_() % 3];
    if (!(flags & core::kAwake)) scene_.bodies.motion[body] = {};
    scene_.bodies.awake_stale = true;
    scene_.touch_body(body);
  }
  void join_random() {
    auto& keys = scene_.joints.no_collide;
    if (keys.size() > 5) keys.erase(keys.begin() + long(random_() % keys.size()));
    for (int i = 0; i < 3; ++i) {
      const auto& pairs = scene_.sides[0].contacts.pairs;
      if (pairs.empty()) continue;
      const ContactPair& pair = pairs[random_() % pairs.size()];
      keys.push_back((std::uint64_t{std::min(pair.body_a, pair.body_b)} << 32) |
                     std::max(pair.body_a, pair.body_b));
    }
    std::ranges::sort(keys);
  }
  void sleep_random() {
    for (int i = 0; i < 20; ++i) scene_.bodies.flags[any()] &= ~std::uint32_t{core::kAwake};
    scene_.bodies.awake_stale = true;
  }
  void quarantine_random() {
    const auto& awake = scene_.bodies.awake;  // only what was simulated can go wrong
    const BodyIndex body = awake[random_() % awake.size()];
    if (scene_.bodies.is(body, core::kAlive)) scene_.bodies.flags[body] |= core::kQuarantined;
    scene_.bodies.awake_stale = true;
  }

  void fly() {
    core::refresh_awake(scene_.bodies);
    for (const BodyIndex body : scene_.bodies.awake) {
      core::BodyPose& pose = scene_.bodies.pose[body];
      core::BodyMotion& motion = scene_.bodies.motion[body];
      pose.center += motion.linear * kDt;
      const Vec3 half = motion.angular * kDt / 2;
      pose.orientation = Quat(1, half.x(), half.y(), half.z()) * pose.orientation;
      pose.orientation.normalize();
      for (int axis = 0; axis < 3; ++axis)  // stay in the arena
        if (std::abs(pose.center[axis]) > 7) motion.linear[axis] = -pose.center[axis];
    }
  }

  Scene& scene_;
  std::mt19937 random_;
  std::shared_ptr<const core::MeshGeometry> mesh_;
};

TEST(BroadphaseKinds, pair_set_equals_brute_force_and_is_the_same_for_all_kinds_and_chunks) {
  Scene scene({{BroadphaseKind::tree, 1},
               {BroadphaseKind::tree, 7},
               {BroadphaseKind::sweep_and_prune, 3},
               {BroadphaseKind::fcl, 2}});
  Script script(scene, 31);
  std::size_t most = 0;
  for (int number = 1; number <= 200; ++number) {
    script.step(number);
    scene.step();
    for (const Scene::Side& side : scene.sides) {
      scene.expect_sound(side);
      if (HasFatalFailure()) FAIL() << "step " << number;
    }
    for (const Scene::Side& side : scene.sides) {
      const auto& reference = scene.sides[0].contacts;
      ASSERT_EQ(side.contacts.pairs.size(), reference.pairs.size());
      for (std::size_t i = 0; i < reference.pairs.size(); ++i) {
        ASSERT_EQ(side.contacts.pairs[i].key(), reference.pairs[i].key());
        ASSERT_EQ(side.contacts.pairs[i].first_manifold, reference.pairs[i].first_manifold);
      }
      ASSERT_EQ(side.contacts.manifolds.size(), reference.manifolds.size());
    }
    most = std::max(most, scene.sides[0].contacts.pairs.size());
  }
  EXPECT_GT(most, 500u);
}

// Boxes of 1 m that cross a cube of `width` (m), each on its own way, and turn back at its sides.
class MixingBoxes {
 public:
  MixingBoxes(Scene& scene, unsigned seed, double width)
      : scene_(scene), random_(seed), half_(width / 2) {}

  BodyIndex add(const Vec3& position) {
    std::uniform_real_distribution<double> speed(-8, 8);
    const BodyIndex body = scene_.add_body(core::kDynamic, position);
    for (int axis = 0; axis < 3; ++axis) scene_.bodies.motion[body].linear[axis] = speed(random_);
    scene_.add_collider(body, box_collider(0.5f, 0.5f, 0.5f));
    return body;
  }
  void fill(int side) {
    for (int i = 0; i < side * side * side; ++i)
      add({1.2 * (i % side), 1.2 * (i / side % side), 1.2 * (i / (side * side))});
  }
  void fly() {
    core::refresh_awake(scene_.bodies);
    for (const BodyIndex body : scene_.bodies.awake) {
      core::BodyMotion& motion = scene_.bodies.motion[body];
      Vec3& center = scene_.bodies.pose[body].center;
      center += motion.linear * kDt;
      for (int axis = 0; axis < 3; ++axis)
        if (std::abs(center[axis] - half_) > half_ + 1)
          motion.linear[axis] = std::copysign(motion.linear[axis], half_ - center[axis]);
    }
  }

 private:
  Scene& scene_;
  std::mt19937 random_;
  double half_;
};

// Boxes that mix wear a tree out within some tens of steps.
TEST(BroadphaseKinds, boxes_that_mix_make_the_pairs_of_brute_force_with_one_and_two_workers) {
  Scene scene({{BroadphaseKind::tree, 1}, {BroadphaseKind::tree, 2}});
  MixingBoxes boxes(scene, 32, 10);
  boxes.fill(9);
  std::mt19937 random(33);
  for (int number = 0; number < test::rounds(250); ++number) {
    if (number % 3 == 0) scene.remove_body(1 + random() % 600);
    if (number % 3 == 0) boxes.add({5, 5, 5});
    boxes.fly();
    scene.step();
    for (const Scene::Side& side : scene.sides) {
      scene.expect_sound(side);
      if (HasFatalFailure()) FAIL() << "step " << number;
    }
    ASSERT_EQ(scene.sides[0].contacts.pairs.size(), scene.sides[1].contacts.pairs.size());
  }
}

template <void (*kernel)(const StepContext&, IndexRange, Task&)>
void of_step(void* context, IndexRange items, Task& task) {
  kernel(*static_cast<const StepContext*>(context), items, task);
}

// The stages of the pair search, as in a step.
jobs::TaskGraph pair_search() {
  const auto awake = [](void* context) {
    const core::Bodies& bodies = *static_cast<const StepContext*>(context)->bodies;
    return static_cast<std::uint32_t>(bodies.awake.size());
  };
  const auto moved = [](void* context) {
    return static_cast<const StepContext*>(context)->broadphase->moved_count();
  };
  jobs::TaskGraph graph;
  graph.stage({"update_bounds", 1, of_step<update_bounds>, awake, 512, 0, 1});
  graph.stage({"refit", jobs::kOnce, of_step<refit_broadphase>, nullptr, 1, 0, 1});
  graph.stage({"query", 2, of_step<query_pairs>, moved, 128, 0, 1});
  graph.stage({"merge", jobs::kOnce, of_step<merge_pairs>, nullptr, 1, 0, 1});
  return graph;
}

std::vector<std::uint64_t> keys_of(const core::ContactTable& table) {
  std::vector<std::uint64_t> keys;
  for (const ContactPair& pair : table.pairs) keys.push_back(pair.key());
  return keys;
}

// One worker, two and three threads, and seven in whatever order: all build the tree anew beside the
// queries of the same step, and take it in the next one.
TEST(BroadphaseKinds, trees_built_ahead_by_any_workers_give_the_pairs_of_brute_force_std_thread) {
  Scene scene({{BroadphaseKind::tree, 1},
               {BroadphaseKind::tree, 2},
               {BroadphaseKind::tree, 3},
               {BroadphaseKind::tree, 7}});
  std::vector<std::unique_ptr<jobs::Executor>> executors;
  executors.push_back(jobs::make_executor(jobs::ExecutorKind::serial));
  for (const int workers : {2, 3})
    executors.push_back(jobs::make_executor(jobs::ExecutorKind::threads, {.workers = workers}));
  executors.push_back(std::make_unique<test::ShufflingExecutor>(test::Shuffle{.workers = 7}));
  MixingBoxes boxes(scene, 34, 20);
  boxes.fill(17);  // more than one block of a build
  const jobs::TaskGraph graph = pair_search();
  const Broadphase& reference = *scene.sides[0].broadphase;
  std::uint32_t checked = 0, built = 0;
  for (int number = 0; number < 90; ++number) {
    boxes.fly();
    const bool just_built = built != reference.built_ahead_count();
    built = reference.built_ahead_count();
    for (std::size_t i = 0; i < scene.sides.size(); ++i) {
      StepContext context = scene.context(scene.sides[i]);
      executors[i]->run(graph, &context);
    }
    // In the step of the build, in the one that takes the new tree, and now and then.
    if (just_built || built != reference.built_ahead_count() || number % 30 == 0) {
      ASSERT_EQ(keys_of(scene.sides[0].contacts), scene.brute_force(scene.sides[0]));
      ++checked;
    }
    for (const Scene::Side& side : scene.sides) {
      ASSERT_EQ(keys_of(side.contacts), keys_of(scene.sides[0].contacts)) << "step " << number;
      ASSERT_EQ(side.broadphase->built_ahead_count(), reference.built_ahead_count());
    }
  }
  EXPECT_GT(reference.built_ahead_count(), 1u);
  EXPECT_GT(checked, 6u);
}

TEST(BroadphaseKinds, many_seeds_agree_stress) {
  for (unsigned seed = 100; seed < 104; ++seed) {
    Scene scene({{BroadphaseKind::tree, 2}});
    Script script(scene, seed);
    for (int number = 1; number <= 200; ++number) {
      script.step(number);
      scene.step();
      scene.expect_sound(scene.sides[0]);
      if (HasFatalFailure()) FAIL() << "seed " << seed << ", step " << number;
    }
  }
}

TEST(BroadphaseKinds, same_far_from_the_origin) {
  Scene scene(
      {{BroadphaseKind::tree, 1}, {BroadphaseKind::sweep_and_prune, 1}, {BroadphaseKind::fcl, 1}});
  for (int i = 0; i < 200; ++i) {
    const BodyIndex body = scene.add_body(
        core::kDynamic, {1e6 + 0.9 * (i % 6), -1e6 + 0.9 * (i / 6 % 6), 0.9 * (i / 36)});
    scene.add_collider(body, box_collider(0.4f, 0.4f, 0.4f));
  }
  for (int number = 0; number < 20; ++number) {
    for (const BodyIndex body : scene.bodies.awake)
      scene.bodies.pose[body].center.y() -= 0.05 * (body % 7);
    scene.step();
    for (const Scene::Side& side : scene.sides) scene.expect_sound(side);
  }
}

class PairTable : public testing::TestWithParam<BroadphaseKind> {
 protected:
  Scene scene{{{GetParam(), 2}}};
  core::ContactTable& table() { return scene.sides[0].contacts; }
  BodyIndex ball(const Vec3& position, std::uint32_t type = core::kDynamic) {
    const BodyIndex body = scene.add_body(type, position);
    Collider collider;
    collider.size = {0.5f, 0, 0};
    scene.add_collider(body, collider);
    return body;
  }
  void put(BodyIndex body, const Vec3& position) {
    scene.bodies.pose[body].center = position;
    scene.touch_body(body);
  }
};

TEST_P(PairTable, persisting_pairs_keep_manifold_and_cache) {
  ball({0, 0, 0});
  ball({0.9, 0, 0});
  const BodyIndex third = ball({20, 0, 0});
  scene.step();
  ASSERT_EQ(table().pairs.size(), 1u);
  table().pairs[0].cache = 77;
  table().manifolds[table().pairs[0].first_manifold].point_count = 3;
  put(third, {0.5, 0.5, 0});
  scene.step();
  ASSERT_EQ(table().pairs.size(), 3u);
  EXPECT_EQ(table().pairs[0].cache, 77u);
  EXPECT_EQ(table().manifolds[table().pairs[0].first_manifold].point_count, 3u);
  EXPECT_EQ(table().manifolds[table().pairs[1].first_manifold].point_count, 0u);
}

TEST_P(PairTable, only_touching_pairs_that_vanish_are_reported_ended_in_order) {
  const BodyIndex a = ball({0, 0, 0}), b = ball({0.9, 0, 0}), c = ball({0.45, 0.6, 0});
  scene.step();
  ASSERT_EQ(table().pairs.size(), 3u);
  for (ContactPair& pair : table().pairs) pair.flags |= core::kTouching;
  table().pairs[1].flags = 0;  // (a, c) does not touch
  scene.remove_body(b);        // drops (a, b) and (b, c)
  EXPECT_TRUE(table().active.empty());
  ASSERT_EQ(table().ended.size(), 2u);
  const BodyIndex d = ball({0.2, 0.2, 0});
  scene.step();
  ASSERT_EQ(table().pairs.size(), 3u);
  for (ContactPair& pair : table().pairs) pair.flags |= core::kTouching;
  put(a, {50, 0, 0});
  scene.step();
  ASSERT_EQ(table().pairs.size(), 1u);
  EXPECT_EQ(table().ended.size(), 4u);
  EXPECT_TRUE(std::ranges::is_sorted(table().ended, {}, &ContactPair::key));
  EXPECT_EQ(table().manifolds.size(), 3u) << "freed manifolds are used again";
  (void)c;
  (void)d;
}

TEST_P(PairTable, nothing_moved_changes_nothing) {
  for (int i = 0; i < 50; ++i) ball({0.9 * (i % 7), 0.9 * (i / 7), 0});
  scene.step();
  const auto active = table().active;
  EXPECT_EQ(scene.moved, 50u);
  for (int i = 0; i < 10; ++i) {
    scene.step();
    EXPECT_EQ(scene.moved, 0u);
    EXPECT_EQ(table().active, active);
  }
}

TEST_P(PairTable, sleeping_pairs_are_kept_but_not_active) {
  const BodyIndex a = ball({0, 0, 0}), b = ball({0.9, 0, 0});
  scene.step();
  EXPECT_EQ(table().active.size(), 1u);
  for (const BodyIndex body : {a, b}) scene.bodies.flags[body] &= ~std::uint32_t{core::kAwake};
  scene.bodies.awake_stale = true;
  scene.step();
  EXPECT_EQ(table().pairs.size(), 1u);
  EXPECT_TRUE(table().active.empty());
  scene.bodies.flags[b] |= core::kAwake;
  scene.bodies.awake_stale = true;
  scene.step();
  EXPECT_EQ(table().active.size(), 1u);
}

// Nobody in them is awake, but something about them is new.
TEST_P(PairTable, sleeping_pairs_that_are_new_or_touched_are_active_for_one_step) {
  const BodyIndex a = ball({0, 0, 0}), wall = ball({0.9, 0, 0}, 0);
  scene.bodies.flags[a] &= ~std::uint32_t{core::kAwake};
  scene.bodies.awake_stale = true;
  for (int i = 0; i < 2; ++i) {
    scene.step();
    EXPECT_EQ(table().active.size(), 1u);
    scene.step();
    EXPECT_TRUE(table().active.empty());
    scene.touch_body(i == 0 ? wall : a);
  }
}

TEST(Broadphase, a_hundred_thousand_single_adds_in_a_row_lose_no_hit) {
  Scene scene({{BroadphaseKind::tree, 1}});
  std::mt19937 random(4);
  for (int i = 0; i < 100000; ++i) {
    const BodyIndex body = scene.add_body(0, {0.01 * i, 0.3 * (i % 7), double(random() % 100)});
    scene.add_collider(body, box_collider(0.2f, 0.2f, 0.2f));
    if (i % 10000 == 0) scene.step();
  }
  scene.step();
  const Broadphase& broadphase = *scene.sides[0].broadphase;
  std::size_t hits = 0;
  for (int query = 0; query < 100; ++query) {
    const auto at = [&](unsigned range) { return float(random() % range); };
    const float x = at(1000), z = at(100);
    const Aabb box{{x, 0, z}, {x + at(40), 1, z + at(10)}};
    std::vector<ColliderIndex> found, expected;
    broadphase.collect(box, found);
    for (ColliderIndex c = 0; c < scene.colliders.rows.size(); ++c)
      if (overlap(broadphase.fat_bounds(c), box)) expected.push_back(c);
    ASSERT_EQ(found, expected) << "query " << query;
    hits += found.size();
  }
  EXPECT_GT(hits, 5000u);
}

// Proxies touched in each step while a hundred balls roll over a field of fixed ones.
std::vector<std::uint64_t> touched_among(int fixed, BroadphaseKind kind) {
  Scene scene{{{kind, 2}}};
  Collider ball;
  ball.size = {0.5f, 0, 0};
  for (int i = 0; i < fixed; ++i)
    scene.add_collider(scene.add_body(0, {1.5 * (i % 300), 0, 1.5 * (i / 300)}), ball);
  std::vector<BodyIndex> movers;
  for (int i = 0; i < 100; ++i) {
    movers.push_back(scene.add_body(core::kDynamic, {3.0 * (i % 50), 1, 2.0 * (i / 50)}));
    scene.add_collider(movers.back(), ball);
  }
  scene.step();
  std::vector<std::uint64_t> touched;
  for (int step = 0; step < 20; ++step) {
    for (const BodyIndex mover : movers) scene.bodies.pose[mover].center.x() += 0.3;
    scene.step();
    EXPECT_GT(scene.sides[0].contacts.pairs.size(), 100u);
    touched.push_back(scene.sides[0].broadphase->proxies_touched());
  }
  return touched;
}

TEST_P(PairTable, a_hundred_movers_touch_no_more_proxies_among_a_hundred_thousand_statics) {
  const int many = GetParam() == BroadphaseKind::tree ? 100000 : 4000;
  const std::vector<std::uint64_t> few = touched_among(1200, GetParam());
  EXPECT_GT(few[0], 100u);
  EXPECT_EQ(touched_among(many, GetParam()), few);
}

TEST_P(PairTable, collect_gives_what_meets_the_box) {
  for (int i = 0; i < 20; ++i) ball({2.0 * i, 0, 0}, i % 2 ? core::kDynamic : 0u);
  Collider plane;
  plane.type = ShapeType::plane;
  plane.size = {0, 1, 0};
  scene.add_collider(scene.add_body(0, {0, 0, 0}), plane);
  scene.step();
  std::vector<ColliderIndex> found;
  scene.sides[0].broadphase->collect({{5.8f, -0.1f, -0.1f}, {8.2f, 0.1f, 0.1f}}, found);
  EXPECT_EQ(found, (std::vector<ColliderIndex>{3, 4, 20}));
}

std::string kind_name(const testing::TestParamInfo<BroadphaseKind>& kind) {
  const char* const names[] = {"tree", "sweep_and_prune", "fcl"};
  return names[static_cast<int>(kind.param)];
}

INSTANTIATE_TEST_SUITE_P(Kinds, PairTable,
                         testing::Values(BroadphaseKind::tree, BroadphaseKind::sweep_and_prune,
                                         BroadphaseKind::fcl),
                         kind_name);

TEST(Broadphase, queries_may_run_on_two_workers_at_once_std_thread) {
  for (const BroadphaseKind kind :
       {BroadphaseKind::tree, BroadphaseKind::sweep_and_prune, BroadphaseKind::fcl}) {
    Scene scene({{kind, 2}});
    for (int i = 0; i < 400; ++i)
      scene.add_collider(scene.add_body(core::kDynamic, {0.8 * (i % 20), 0.8 * (i / 20), 0}),
                         box_collider(0.4f, 0.4f, 0.4f));
    core::refresh_awake(scene.bodies);
    const StepContext step = scene.context(scene.sides[0]);
    StubTask first(0), second(1);
    std::thread other([&] { update_bounds(step, {200, 400}, second); });
    update_bounds(step, {0, 200}, first);
    other.join();
    refit_broadphase(step, {0, 1}, first);
    const std::uint32_t half = scene.sides[0].broadphase->moved_count() / 2;
    std::thread query([&] { query_pairs(step, {half, 2 * half}, second); });
    query_pairs(step, {0, half}, first);
    query.join();
    merge_pairs(step, {0, 1}, first);
    scene.expect_sound(scene.sides[0]);
  }
}

// The tree holds these items and no others; the first query is for all of them.
template <class RandomBox>
void expect_items(const BoxTree& tree, const std::map<std::uint32_t, Aabb>& boxes, int queries,
                  const RandomBox& random_box) {
  ASSERT_EQ(tree.size(), boxes.size());
  for (int q = 0; q < queries; ++q) {
    Aabb box = random_box();
    if (q == 0) box = {{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}};
    std::set<std::uint32_t> found;
    tree.query(box, [&](std::uint32_t item) { ASSERT_TRUE(found.insert(item).second); });
    for (const auto& [item, item_box] : boxes)
      ASSERT_EQ(found.contains(item), overlap(item_box, box)) << "item " << item;
  }
}

TEST(BoxTree, keeps_its_items_through_random_changes) {
  std::mt19937 random(41);
  std::uniform_real_distribution<float> place(-50, 50), size(0, 2), small(-0.5f, 0.5f);
  BoxTree tree;
  std::map<std::uint32_t, Aabb> boxes;
  const auto random_box = [&] {
    Aabb box;
    for (int axis = 0; axis < 3; ++axis) {
      box.min[axis] = place(random);
      box.max[axis] = box.min[axis] + size(random);
    }
    return box;
  };
  for (int round = 0; round < 400; ++round) {
    for (unsigned i = 0; i < random() % 12; ++i) {
      const std::uint32_t item = random() % 700;
      if (!boxes.contains(item)) tree.insert(item, boxes[item] = random_box());
    }
    for (auto it = boxes.begin(); it != boxes.end();) {
      const auto dice = random() % 100;
      if (dice == 0) {
        tree.remove(it->first);
        it = boxes.erase(it);
        continue;
      }
      if (dice < 20) {
        const float by = small(random);
        for (int axis = 0; axis < 3; ++axis) {
          it->second.min[axis] += by;
          it->second.max[axis] += by;
        }
        tree.update(it->first, it->second);
      } else if (dice == 20) {
        tree.update(it->first, it->second = random_box());
      }
      ++it;
    }
    tree.refit();
    ASSERT_NO_FATAL_FAILURE(expect_items(tree, boxes, 10, random_box)) << "round " << round;
  }
  EXPECT_LT(tree.rebuild_count(), 150u);  // of 400 refits with a sixth of the items changed in each
}

// Items come, go, jump and drift between a build and the refit that takes the new tree; some steps ask
// nothing, so that no tree is built in them.
void live_with_trees_built_ahead(std::uint32_t items, int rounds, std::uint32_t least_rebuilds) {
  std::mt19937 random(43 + items);
  std::uniform_real_distribution<float> place(-50, 50), small(-1, 1);
  BoxTree tree;
  StubTask task;
  std::map<std::uint32_t, Aabb> boxes;
  const auto random_box = [&] {
    Aabb box;
    for (int axis = 0; axis < 3; ++axis) {
      box.min[axis] = place(random);
      box.max[axis] = box.min[axis] + 2;
    }
    return box;
  };
  const auto add = [&](std::uint32_t item) {
    if (!boxes.contains(item)) tree.insert(item, boxes[item] = random_box());
  };
  for (std::uint32_t item = 0; item < items; ++item) add(item);
  for (int round = 0; round < rounds; ++round) {
    for (std::uint32_t i = 0; i < 2 + items / 128; ++i) add(random() % (items + items / 4));
    for (auto it = boxes.begin(); it != boxes.end();) {
      const auto [item, old] = *it;
      const auto dice = random() % 256;
      if (dice < 2) {
        tree.remove(item);
        it = boxes.erase(it);
        if (dice == 0) add(item);  // the same item, elsewhere
        continue;
      }
      Aabb& box = it++->second;
      if (dice == 2) tree.update(item, box = random_box());
      if (dice < 3 || dice >= 64) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const float by = small(random);
        box.min[axis] += by;
        box.max[axis] += by;
      }
      if (!tree.update_in_place(item, box)) tree.update(item, box);
    }
    if (round == rounds / 2)  // all go, and as many come
      for (const auto& [item, box] : std::exchange(boxes, {})) {
        tree.remove(item);
        if (item % 2 == 0) add(item);
      }
    tree.refit(&task);
    ASSERT_NO_FATAL_FAILURE(expect_items(tree, boxes, 3, random_box)) << "round " << round;
    if (random() % 4 != 0) tree.build_ahead(task);
  }
  EXPECT_GT(tree.rebuild_count(), least_rebuilds);
}

TEST(BoxTree, keeps_its_items_while_it_is_built_ahead) {
  live_with_trees_built_ahead(40, 600, 5);
  live_with_trees_built_ahead(400, 400, 10);
  live_with_trees_built_ahead(5000, test::rounds(200), 1);
}

// Equal centres, one far item, a line, infinite extents: what buckets are no help for.
TEST(BoxTree, is_built_of_items_however_they_lie) {
  std::mt19937 random(44);
  std::uniform_real_distribution<float> place(-50, 50);
  constexpr float kMost = 3e38f;
  for (int kind = 0; kind < 5; ++kind) {
    BoxTree tree;
    std::vector<Aabb> boxes;
    for (std::uint32_t item = 0; item < 3000; ++item) {
      float center[3] = {place(random), place(random), place(random)};
      if (kind == 0) std::fill_n(center, 3, 7.0f);
      if (kind == 1 && item == 5) center[0] = 1e30f;
      if (kind == 2) center[1] = center[2] = 0;
      if (kind == 3 && item < 2) center[2] = item == 0 ? kMost : -kMost;
      if (kind == 4) center[0] *= 1e-43f;
      Aabb box;
      for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] = center[axis] - 1;
        box.max[axis] = center[axis] + 1;
      }
      boxes.push_back(box);
      tree.insert(item, box);
    }
    tree.refit();
    EXPECT_EQ(tree.rebuild_count(), 1u);
    for (int q = 0; q < 20; ++q) {
      const Aabb& box = boxes[random() % boxes.size()];
      std::set<std::uint32_t> found;
      tree.query(box, [&](std::uint32_t item) { ASSERT_TRUE(found.insert(item).second); });
      for (std::uint32_t item = 0; item < boxes.size(); ++item)
        ASSERT_EQ(found.contains(item), overlap(boxes[item], box)) << "kind " << kind;
    }
  }
}

TEST(BoxTree, equal_boxes_added_one_by_one_stay_within_the_depth_of_a_query) {
  BoxTree tree;
  const Aabb box{{0, 0, 0}, {1, 1, 1}};
  for (std::uint32_t item = 0; item < 3000; ++item) {
    tree.insert(item, box);
    tree.refit();
  }
  std::uint32_t found = 0;
  tree.query(box, [&](std::uint32_t) { ++found; });
  EXPECT_EQ(found, 3000u);
}

}  // namespace
}  // namespace skerry::collision
