// How the contacts of many triangles become patches of four points.
#include "collision/mesh_points.h"

#include <gtest/gtest.h>

#include <cmath>

#include "collision/narrowphase_mesh.h"
#include "tests/collision/instruction_sets.h"
#include "tests/collision/narrowphase_fixture.h"

namespace skerry::test {
namespace {

using collision::MeshPoints;
using collision::PatchSet;
using collision::PointChoice;
using core::V3f;

float drawn(Random& random, double low, double high) {
  return static_cast<float>(random.uniform(low, high));
}

// Points about the plane y = 0 in a square of two metres, some of them twice.
void fill(Random& random, MeshPoints& points) {
  points.clear();
  const int contacts = 1 + static_cast<int>(random.uniform(0, 12));
  std::uint32_t feature = 0;
  for (int i = 0; i < contacts; ++i) {
    const Vec3 tilted = Vec3::UnitY() + random.uniform(0, 0.1) * random.unit();
    const std::uint32_t contact = points.begin_contact(core::to_float(Vec3(tilted.normalized())));
    const int count = static_cast<int>(random.uniform(1, 9));
    for (int k = 0; k < count; ++k) {
      const float x = drawn(random, -1, 1), z = drawn(random, -1, 1);
      const float separation = drawn(random, -0.01, 0.006);
      const int copies = random.uniform(0, 1) < 0.3 ? 2 : 1;
      for (int copy = 0; copy < copies; ++copy)
        points.add(contact, {x, 0, z}, separation, feature++);
    }
  }
}

PointChoice ask(MeshPoints& points, float near) {
  PointChoice choice;
  const MeshPoints::Taken taken = points.take({0, 1, 0}, 0.9f, 0);
  choice.normal = taken.normal;
  choice.patch = 0;
  choice.deep = taken.separation + near;
  choice.near = near;
  return choice;
}

TEST(MeshPoints, every_width_chooses_the_same_points) {
  Random random(31);
  for (int i = 0; i < 2000; ++i) {
    MeshPoints points;
    fill(random, points);
    const PointChoice asked = ask(points, 1e-3f);
    PointChoice reference = asked;
    auto blocks = points.blocks();
    choose_spread_reference(blocks, reference);
    ASSERT_GE(reference.count, 1u);
    on_every_instruction_set([&](const std::string& name) {
      PointChoice wide = asked;
      auto wide_blocks = points.blocks();
      choose_spread(wide_blocks, wide);
      ASSERT_EQ(wide.count, reference.count) << name;
      for (std::uint32_t k = 0; k < wide.count; ++k)
        ASSERT_EQ(wide.index[k], reference.index[k]) << name;
    });
    if (HasFatalFailure()) return;
  }
}

TEST(MeshPoints, chosen_are_apart_and_the_deepest_is_among_them) {
  constexpr float kNear = 1e-3f;
  Random random(32);
  for (int i = 0; i < 2000; ++i) {
    MeshPoints points;
    fill(random, points);
    float deepest = 1;
    for (std::uint32_t k = 0; k < points.size(); ++k)
      deepest = std::min(deepest, points.at(k).separation);
    PatchSet patches;
    gather_patches(points, kNear, patches);
    ASSERT_GE(patches.count, 1u);
    const collision::ContactPatch& patch = patches.patch[0];
    float chosen = 1;
    for (std::uint32_t a = 0; a < patch.count; ++a) {
      chosen = std::min(chosen, patch.points[a].separation);
      for (std::uint32_t b = 0; b < a; ++b)
        ASSERT_GT(core::length(patch.points[a].position - patch.points[b].position), kNear);
    }
    ASSERT_LE(chosen, deepest + kNear);
  }
}

// Of a face that lies on the rims of a grid of vertices, the corners.
TEST(MeshPoints, the_corners_of_a_flat_patch_are_chosen) {
  MeshPoints points;
  const std::uint32_t contact = points.begin_contact({0, 1, 0});
  std::uint32_t feature = 0;
  for (int x = 0; x <= 6; ++x)
    for (int z = 0; z <= 6; ++z)
      for (int copy = 0; copy < 3; ++copy)
        points.add(contact, {static_cast<float>(x), 0, static_cast<float>(z)}, -1e-3f, feature++);
  PatchSet patches;
  gather_patches(points, 1e-3f, patches);
  ASSERT_EQ(patches.count, 1u);
  ASSERT_EQ(patches.patch[0].count, 4u);
  for (const collision::ContactPoint& point : patches.patch[0].points) {
    EXPECT_EQ(std::fabs(point.position.x - 3), 3);
    EXPECT_EQ(std::fabs(point.position.z - 3), 3);
  }
}

// What is about to touch comes before what is farther out but still some way off.
TEST(MeshPoints, what_touches_first_is_preferred) {
  MeshPoints points;
  const std::uint32_t contact = points.begin_contact({0, 1, 0});
  points.add(contact, {-1, 0, 1}, -1e-4f, 0);
  points.add(contact, {1, 0, -1}, -1e-4f, 1);
  points.add(contact, {1.2f, 0, 1.2f}, 8e-3f, 2);
  points.add(contact, {1.1f, 0, 1.1f}, 8e-3f, 3);
  points.add(contact, {-1.2f, 0, -1.2f}, 8e-3f, 4);
  points.add(contact, {0.8f, 0, 0.8f}, 2e-4f, 5);
  PatchSet patches;
  gather_patches(points, 1e-3f, patches);
  bool found = false;
  for (std::uint32_t i = 0; i < patches.patch[0].count; ++i)
    found |= patches.patch[0].points[i].feature == 5;
  EXPECT_TRUE(found);
}

// Which of two contacts is deeper must not turn the normal of the patch by leaps.
TEST(MeshPoints, the_normal_turns_smoothly_where_the_deepest_contact_changes) {
  const auto normal_of = [](float second) {
    MeshPoints points;
    points.add(points.begin_contact({0.0998f, 0.995f, 0}), {-1, 0, 0}, -1e-3f, 0);
    points.add(points.begin_contact({-0.0998f, 0.995f, 0}), {1, 0, 0}, second, 1);
    PatchSet patches;
    gather_patches(points, 1e-3f, patches);
    return patches.patch[0].normal;
  };
  V3f last = normal_of(-3e-3f);
  for (float second = -3e-3f; second < 1e-3f; second += 1e-4f) {
    const V3f normal = normal_of(second);
    EXPECT_LT(core::length(normal - last), 0.005f);
    last = normal;
  }
}

}  // namespace
}  // namespace skerry::test
