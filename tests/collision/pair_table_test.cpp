// What a broadphase does to the table of pairs, and what it costs.
#include "collision/broadphase.h"

#include <algorithm>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/collision/broadphase_scene.h"

namespace skerry::collision {
namespace {

using core::ContactPair;
using core::ShapeType;

class PairTable : public testing::TestWithParam<BroadphaseKind> {
 protected:
  BroadphaseScene scene{{{GetParam(), 2}}};
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
  BroadphaseScene scene({{BroadphaseKind::tree, 1}});
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
  BroadphaseScene scene{{{kind, 2}}};
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
    BroadphaseScene scene({{kind, 2}});
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

}  // namespace
}  // namespace skerry::collision
