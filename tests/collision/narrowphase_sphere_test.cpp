// Spheres about the centres of their bodies, which have a way of their own through the narrowphase.
#include <gtest/gtest.h>

#include "tests/collision/narrowphase_fixture.h"

namespace skerry::test {
namespace {

using core::to_double;

// A sphere this far (m) from its body's centre counts as any other shape does.
constexpr float kBeside = 1e-9f;

TEST(NarrowphaseSphere, about_its_bodys_centre_touches_as_one_beside_it) {
  Random random(31);
  int touching = 0, foreseen = 0, apart = 0;
  for (int i = 0; i < 2000; ++i) {
    const double radius_a = random.uniform(0.1, 1), radius_b = random.uniform(0.1, 1);
    const Vec3 n = random.unit();
    const double reach = radius_a + radius_b, gap = random.uniform(-0.2, 0.1) * reach;
    PairScene centered, beside;
    for (PairScene* scene : {&centered, &beside}) {
      scene->dt = 1.0 / 60;
      scene->add(Sphere{radius_a}, at(Vec3(5, 1, 2)));
      scene->add(Sphere{radius_b}, at(Vec3(5, 1, 2) + (reach + gap) * n));
      scene->pair(0, 1);
    }
    beside.colliders.rows[0].local_position = {kBeside, 0, 0};
    for (int step = 0; step < 3; ++step) {
      const Vec3 linear = random.in_box(4), spin = random.in_box(3);
      const Vec3 other = random.in_box(4), other_spin = random.in_box(3);
      for (PairScene* scene : {&centered, &beside}) {
        scene->set_motion(0, linear, spin);
        scene->set_motion(1, other, other_spin);
        scene->collide();
      }
      ASSERT_EQ(centered.contact().manifold_count, beside.contact().manifold_count) << "pair " << i;
      ASSERT_EQ(centered.contact().flags, beside.contact().flags);
      if (centered.contact().manifold_count == 0) {
        ++apart;
        continue;
      }
      ++(gap > 0 ? foreseen : touching);
      const core::Manifold &a = centered.manifold(), &b = beside.manifold();
      ASSERT_EQ(a.point_count, 1u);
      EXPECT_EQ(a.feature[0], b.feature[0]);
      EXPECT_LT((to_double(a.normal) - to_double(b.normal)).norm(), 1e-5);
      EXPECT_LT((to_double(a.points[0].position) - to_double(b.points[0].position)).norm(), 1e-5);
      EXPECT_NEAR(double(a.points[0].separation), gap, 1e-5);
      EXPECT_NEAR(double(a.approach_speed), double(b.approach_speed), 1e-4);
      EXPECT_NEAR(double(a.approach_speed), std::max(0.0, n.dot(linear - other)), 1e-4);
    }
  }
  EXPECT_GT(touching, 1000);
  EXPECT_GT(foreseen, 100);
  EXPECT_GT(apart, 100);
}

TEST(NarrowphaseSphere, keeps_its_impulse_while_it_rolls_and_loses_it_when_it_turns_away) {
  PairScene scene;
  scene.add(Sphere{0.5}, at(Vec3::Zero()));
  scene.add(Sphere{0.5}, at(Vec3(0, 0.999, 0)));
  scene.pair(0, 1);
  scene.collide();
  scene.manifold().normal_impulse[0] = 7;
  scene.set_pose(1, at(0.999 * Vec3(0.1, 1, 0).normalized()));
  scene.collide();
  EXPECT_EQ(scene.manifold().normal_impulse[0], 7);
  scene.set_pose(1, at(Vec3(0.999, 0, 0)));
  scene.collide();
  EXPECT_EQ(scene.manifold().normal_impulse[0], 0);
}

}  // namespace
}  // namespace skerry::test
