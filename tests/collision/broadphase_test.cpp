// Every kind of broadphase against brute force over the fat boxes, step by step.
#include "collision/broadphase.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <skerry/jobs/executor.h>

#include "collision/geometry_build.h"
#include "tests/collision/broadphase_scene.h"
#include "tests/support/rounds.h"
#include "tests/support/shuffling_executor.h"

namespace skerry::collision {
namespace {

using core::ContactPair;
using core::ShapeType;

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
// 200 steps of everything that may happen to a world.
class Script {
 public:
  Script(BroadphaseScene& scene, unsigned seed)
      : scene_(scene), random_(seed), mesh_(bumpy_mesh()) {
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

  BroadphaseScene& scene_;
  std::mt19937 random_;
  std::shared_ptr<const core::MeshGeometry> mesh_;
};

TEST(BroadphaseKinds, pair_set_equals_brute_force_and_is_the_same_for_all_kinds_and_chunks) {
  BroadphaseScene scene({{BroadphaseKind::tree, 1},
                         {BroadphaseKind::tree, 7},
                         {BroadphaseKind::sweep_and_prune, 3},
                         {BroadphaseKind::fcl, 2}});
  Script script(scene, 31);
  std::size_t most = 0;
  for (int number = 1; number <= 200; ++number) {
    script.step(number);
    scene.step();
    for (const BroadphaseScene::Side& side : scene.sides) {
      scene.expect_sound(side);
      if (HasFatalFailure()) FAIL() << "step " << number;
    }
    for (const BroadphaseScene::Side& side : scene.sides) {
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
  MixingBoxes(BroadphaseScene& scene, unsigned seed, double width)
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
  BroadphaseScene& scene_;
  std::mt19937 random_;
  double half_;
};

// Boxes that mix wear a tree out within some tens of steps.
TEST(BroadphaseKinds, boxes_that_mix_make_the_pairs_of_brute_force_with_one_and_two_workers) {
  BroadphaseScene scene({{BroadphaseKind::tree, 1}, {BroadphaseKind::tree, 2}});
  MixingBoxes boxes(scene, 32, 10);
  boxes.fill(9);
  std::mt19937 random(33);
  for (int number = 0; number < test::rounds(250); ++number) {
    if (number % 3 == 0) scene.remove_body(1 + random() % 600);
    if (number % 3 == 0) boxes.add({5, 5, 5});
    boxes.fly();
    scene.step();
    for (const BroadphaseScene::Side& side : scene.sides) {
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
  BroadphaseScene scene({{BroadphaseKind::tree, 1},
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
    for (const BroadphaseScene::Side& side : scene.sides) {
      ASSERT_EQ(keys_of(side.contacts), keys_of(scene.sides[0].contacts)) << "step " << number;
      ASSERT_EQ(side.broadphase->built_ahead_count(), reference.built_ahead_count());
    }
  }
  EXPECT_GT(reference.built_ahead_count(), 1u);
  EXPECT_GT(checked, 6u);
}

TEST(BroadphaseKinds, many_seeds_agree_stress) {
  for (unsigned seed = 100; seed < 104; ++seed) {
    BroadphaseScene scene({{BroadphaseKind::tree, 2}});
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
  BroadphaseScene scene(
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
    for (const BroadphaseScene::Side& side : scene.sides) scene.expect_sound(side);
  }
}

}  // namespace
}  // namespace skerry::collision
