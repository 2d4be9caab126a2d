// Boxes whose axes are those of their bodies go through the narrowphase sixteen at a time from the rows of
// their bodies to their manifolds; others one by one.
#include "collision/box_rows.h"

#include <gtest/gtest.h>

#include "tests/collision/instruction_sets.h"
#include "tests/collision/narrowphase_fixture.h"

namespace skerry::test {
namespace {

constexpr int kPairs = 43;  // no multiple of a batch

struct Motions {
  Pose pose[2];
  Vec3 linear[2], angular[2];
};

Motions random_motions(Random& random) {
  Motions m;
  m.pose[0] = at(random.in_box(1000), random.resting_rotation());
  const Vec3 up = m.pose[0].orientation * Vec3::UnitY();
  m.pose[1] = at(m.pose[0].position + random.uniform(0.98, 1.02) * up + random.in_box(0.2),
                 m.pose[0].orientation * random.small_turn(0.02));
  for (int k = 0; k < 2; ++k) {
    m.linear[k] = random.in_box(random.uniform(0, 1) < 0.2 ? 4 : 0.01);
    m.angular[k] = random.in_box(0.2);
  }
  return m;
}

void expect_equal(const core::Manifold& a, const core::Manifold& b) {
  ASSERT_EQ(a.point_count, b.point_count);
  EXPECT_EQ(core::to_double(a.normal), core::to_double(b.normal));
  EXPECT_EQ(a.approach_speed, b.approach_speed);
  EXPECT_EQ(a.total_impulse, b.total_impulse);
  for (std::uint32_t i = 0; i < a.point_count; ++i) {
    EXPECT_EQ(core::to_double(a.points[i].position), core::to_double(b.points[i].position));
    EXPECT_EQ(a.points[i].separation, b.points[i].separation);
    EXPECT_EQ(a.feature[i], b.feature[i]);
    EXPECT_EQ(a.normal_impulse[i], b.normal_impulse[i]);
  }
}

void expect_same_together_and_alone() {
  Random random(31);
  PairScene together, alone;
  std::vector<Motions> motions;
  for (int i = 0; i < kPairs; ++i) {
    motions.push_back(random_motions(random));
    for (PairScene* scene : {&together, &alone}) {
      scene->dt = 1.0 / 60;
      for (const Pose& pose : motions.back().pose) scene->add(Box{Vec3(0.5, 0.5, 0.5)}, pose);
      scene->pair(2u * static_cast<unsigned>(i), 2u * static_cast<unsigned>(i) + 1);
    }
  }
  for (core::Collider& collider : alone.colliders.rows) collider.has_local_rotation = true;

  int lasting = 0, parted = 0;
  for (int step = 0; step < 12; ++step) {
    for (int i = 0; i < kPairs; ++i) {
      Motions& m = motions[static_cast<std::size_t>(i)];
      for (unsigned k = 0; k < 2; ++k) {
        const auto body = 2u * static_cast<unsigned>(i) + k;
        m.pose[k].position += m.linear[k] / 60;
        for (PairScene* scene : {&together, &alone}) {
          scene->set_pose(body, m.pose[k]);
          scene->set_motion(body, m.linear[k], m.angular[k]);
        }
      }
    }
    together.collide();
    alone.collide();
    for (std::uint32_t i = 0; i < kPairs; ++i) {
      const core::ContactPair &a = together.contact(i), &b = alone.contact(i);
      ASSERT_EQ(a.manifold_count, b.manifold_count) << "pair " << i << ", step " << step;
      EXPECT_EQ(a.cache, b.cache);
      EXPECT_EQ(a.flags, b.flags);
      parted += a.manifold_count == 0;
      if (a.manifold_count == 0) continue;
      expect_equal(together.manifold(i), alone.manifold(i));
      lasting += step > 0;
      // What a solve would leave there goes on with the points.
      for (PairScene* scene : {&together, &alone}) {
        for (int k = 0; k < 4; ++k)
          scene->manifold(i).normal_impulse[k] = static_cast<float>(k + step);
        scene->manifold(i).total_impulse = 1;
      }
    }
  }
  EXPECT_GT(lasting, 4 * kPairs);
  EXPECT_GT(parted, 0);
}

TEST(BoxRows, pairs_that_go_together_get_the_manifolds_of_those_that_go_alone) {
  on_every_instruction_set([](const std::string& name) {
    SCOPED_TRACE(name);
    expect_same_together_and_alone();
  });
}

}  // namespace
}  // namespace skerry::test
