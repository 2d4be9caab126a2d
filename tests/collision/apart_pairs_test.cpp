// Pairs that were found apart are not looked at: nothing may be missed by it.
#include <cstring>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "collision/apart_pairs.h"
#include "collision/broadphase.h"
#include "tests/collision/narrowphase_fixture.h"

namespace skerry::test {
namespace {

using collision::ApartPairs;
using core::BodyIndex;
using core::ContactPair;

// Bodies whose pairs a broadphase finds and whose ways it watches.
class WatchedScene : public PairScene {
 public:
  WatchedScene() { dt = 1.0 / 60; }

  BodyIndex put(const ShapeGeometry& geometry, const Pose& pose, bool dynamic = true) {
    const BodyIndex body = add(geometry, pose, dynamic);
    bodies.first_collider[body] = body;
    bodies.awake_stale = true;
    broadphase_->add(bodies, colliders, body);
    return body;
  }
  void touch(BodyIndex body) { broadphase_->touch(bodies, colliders, body); }
  void set_awake(BodyIndex body, bool awake) {
    bodies.flags[body] &= ~std::uint32_t{core::kAwake};
    if (awake) bodies.flags[body] |= core::kAwake;
    bodies.awake_stale = true;
  }

  core::StepContext context(core::ContactTable& table) {
    core::StepContext step;
    step.dt = dt;
    step.settings = &settings;
    step.bodies = &bodies;
    step.colliders = &colliders;
    step.contacts = &table;
    step.joints = &joints_;
    step.narrowphase = scratch_.get();
    step.broadphase = broadphase_.get();
    return step;
  }

  void find_pairs() {
    core::refresh_awake(bodies);
    const core::StepContext step = context(contacts);
    collision::update_bounds(step, {0, static_cast<std::uint32_t>(bodies.awake.size())}, task_);
    collision::refit_broadphase(step, {0, 1}, task_);
    collision::query_pairs(step, {0, broadphase_->moved_count()}, task_);
    collision::merge_pairs(step, {0, 1}, task_);
  }
  void collide() { collide(contacts, true); }
  // Up to where the pairs of this step are known: bodies are watched once a pair of theirs was looked
  // at, and the pair must be looked at once more.
  void settle() {
    for (int n = 0; n < 2; ++n) {
      find_pairs();
      collide();
    }
    find_pairs();
  }
  // The same pairs with the same memories, each of them looked at.
  core::ContactTable collide_all() {
    core::ContactTable table = contacts;
    collide(table, false);
    return table;
  }
  std::uint32_t known_apart() {
    const ApartPairs known(context(contacts));
    std::uint32_t count = 0;
    for (const ContactPair& pair : contacts.pairs) count += known.holds(pair);
    return count;
  }

 private:
  void collide(core::ContactTable& table, bool watched) {
    core::StepContext step = context(table);
    if (!watched) step.broadphase = nullptr;
    collision::collide_pairs(step, {0, static_cast<std::uint32_t>(table.active.size())}, task_);
  }

  SerialTask task_;
  core::Joints joints_;
  collision::NarrowphaseScratchPtr scratch_ = collision::make_narrowphase_scratch(1);
  std::unique_ptr<collision::Broadphase> broadphase_ =
      collision::make_broadphase(BroadphaseKind::tree);
};

void expect_same_contacts(const core::ContactTable& got, const core::ContactTable& want) {
  ASSERT_EQ(got.pairs.size(), want.pairs.size());
  for (std::size_t i = 0; i < got.pairs.size(); ++i) {
    const ContactPair &a = got.pairs[i], &b = want.pairs[i];
    ASSERT_EQ(a.manifold_count, b.manifold_count) << "pair " << a.a << ' ' << a.b;
    ASSERT_EQ(a.flags, b.flags) << "pair " << a.a << ' ' << a.b;
    for (std::uint32_t k = 0; k < a.manifold_count; ++k) {
      const core::Manifold& m = got.manifolds[a.first_manifold + k];
      const core::Manifold& n = want.manifolds[b.first_manifold + k];
      ASSERT_EQ(m.point_count, n.point_count);
      ASSERT_EQ(std::memcmp(&m.normal, &n.normal, sizeof m.normal), 0);
      ASSERT_EQ(std::memcmp(m.points, n.points, sizeof(core::ManifoldPoint) * m.point_count), 0);
    }
  }
}

ShapeGeometry any_shape(int kind) {
  switch (kind % 5) {
    case 0:
      return Box{{0.5, 0.3, 0.4}};
    case 1:
      return Sphere{0.4};
    case 2:
      return Capsule{0.2, 0.3};
    case 3:
      return Cylinder{0.3, 0.4};
    default:
      return ConvexHull{{{0.5, 0, 0}, {-0.4, 0.1, 0}, {0, 0.5, 0}, {0, -0.4, 0.2}, {0, 0, 0.5}}};
  }
}

TEST(ApartPairs, MissNoContactOfBodiesThatMoveInAnyWay) {
  WatchedScene scene;
  Random random(7);
  constexpr BodyIndex kBodies = 60;
  for (BodyIndex i = 0; i < kBodies; ++i)
    scene.put(any_shape(static_cast<int>(i)), random.pose(2), i % 6 != 0);
  std::uint32_t spared = 0, touched = 0;
  for (int n = 0; n < 400; ++n) {
    // Some rest, some go another way than they said, some fall asleep right after moving, some are
    // put elsewhere or change their size.
    for (BodyIndex body = 0; body < kBodies; ++body) {
      const bool dynamic = scene.bodies.flags[body] & core::kDynamic;
      const double die = random.uniform(0, 1);
      if (dynamic && (scene.bodies.flags[body] & core::kAwake)) {
        if (die < 0.3) {
          core::BodyPose& pose = scene.bodies.pose[body];
          const double speed = random.uniform(0, die < 0.05 ? 2 : 0.2);
          const Vec3 velocity = random.unit() * speed, spin = random.unit() * speed;
          pose.center += velocity * (scene.dt * random.uniform(-1, 2));
          const Quat turn = random.small_turn(speed * scene.dt);
          pose.orientation = (turn * pose.orientation).normalized();
          scene.set_motion(body, velocity, spin);
        } else {
          scene.set_motion(body, Vec3::Zero());
        }
      }
      if (dynamic && die > 0.995) {
        scene.set_motion(body, Vec3::Zero());
        scene.set_awake(body, !(scene.bodies.flags[body] & core::kAwake));
      }
      if (die > 0.5 && die < 0.502) {
        scene.set_pose(body, random.pose(2));
        scene.touch(body);
      }
      if (die > 0.6 && die < 0.602 && body % 5 == 1) {
        scene.colliders.rows[body].size.x = die < 0.601 ? 0.5f : 0.3f;
        scene.touch(body);
      }
    }
    scene.find_pairs();
    spared += scene.known_apart();
    const core::ContactTable all = scene.collide_all();
    scene.collide();
    expect_same_contacts(scene.contacts, all);
    if (HasFatalFailure()) FAIL() << "in step " << n;
    for (const ContactPair& pair : scene.contacts.pairs) touched += pair.manifold_count;
  }
  EXPECT_GT(spared, 1000u);
  EXPECT_GT(touched, 1000u);
}

TEST(ApartPairs, AreLookedAtAgainWhenTheirBodiesHaveComeAsFar) {
  const double half_heights[] = {0.3, 0.4, 0.5, 0.4, 0.4};
  for (int kind = 0; kind < 5; ++kind) {
    const double start = 1.009 + half_heights[kind];
    WatchedScene scene;
    scene.put(Box{{1, 1, 1}}, at({0, 0, 0}), false);
    const BodyIndex body = scene.put(any_shape(kind), at({0, start, 0}));
    const auto step_at = [&](double y) {
      scene.set_pose(body, at({0, y, 0}));
      scene.find_pairs();
      const bool known = scene.known_apart() == 1;
      scene.collide();
      return known;
    };
    scene.settle();
    EXPECT_TRUE(step_at(start)) << kind;
    EXPECT_TRUE(step_at(start - 0.003)) << kind;
    EXPECT_FALSE(step_at(start - 0.0045)) << kind;  // 5 mm away a contact is foreseen
  }
}

TEST(ApartPairs, AreLookedAtWhenTheyApproachFastEnough) {
  WatchedScene scene;
  scene.put(Box{{1, 1, 1}}, at({0, 0, 0}), false);
  const BodyIndex ball = scene.put(Sphere{0.5}, at({0, 1.509, 0}));
  scene.settle();
  ASSERT_EQ(scene.known_apart(), 1u);
  scene.set_motion(ball, {0, -5, 0});  // 8 cm in a step
  scene.find_pairs();
  EXPECT_EQ(scene.known_apart(), 0u);
}

// Where a body that fell asleep lies is not where the broadphase last saw it.
TEST(ApartPairs, WithASleeperAreLookedAt) {
  WatchedScene scene;
  scene.put(Sphere{0.5}, at({0, 0, 0}));
  const BodyIndex sleeper = scene.put(Sphere{0.5}, at({0, 1.02, 0}));
  scene.settle();
  ASSERT_EQ(scene.known_apart(), 1u);
  scene.set_awake(sleeper, false);
  scene.find_pairs();
  EXPECT_EQ(scene.known_apart(), 0u);
}

}  // namespace
}  // namespace skerry::test
