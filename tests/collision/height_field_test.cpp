// Height fields: built from data, collided with.
#include "collision/height_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "collision/geometry_build.h"
#include "collision/mesh_tree.h"
#include "tests/collision/query_random.h"

namespace skerry::test {
namespace {

using core::HeightFieldGeometry;

std::shared_ptr<const HeightFieldGeometry> build(const HeightField& field) {
  return collision::build_height_field(*field.data, field.scale);
}

HeightField with_holes(int cells, double size, QueryRandom& random) {
  HeightField field = wavy_field(cells, size);
  auto data = std::make_shared<HeightFieldData>(*field.data);
  data->holes.assign(static_cast<std::size_t>(cells * cells), 0);
  for (auto& hole : data->holes) hole = random.below(4) == 0;
  field.data = data;
  return field;
}

TEST(HeightField, HasTheTrianglesAndConvexEdgesOfTheSameMesh) {
  const auto field = build(wavy_field(13, 7));
  const auto mesh = collision::build_mesh(*wavy_mesh(13, 7), {1, 1, 1});
  ASSERT_EQ(mesh->triangles.size(), 2 * field->cells.size());
  for (std::uint32_t t = 0; t < mesh->triangles.size(); ++t) {
    const collision::SurfaceTriangle triangle = collision::field_triangle(*field, t);
    for (unsigned i = 0; i < 3; ++i) {
      const core::V3f expected = mesh->vertices[mesh->triangles[t][i]];
      EXPECT_EQ(core::length(triangle.corner[i] - expected), 0) << t;
      const bool border = mesh->neighbours[t][i] == core::kNone;
      EXPECT_EQ((triangle.touchable >> i & 1) != 0, border || (mesh->convex_edges[t] >> i & 1) != 0)
          << t << " " << i;
      EXPECT_EQ((triangle.border >> i & 1) != 0, border) << t << " " << i;
    }
  }
}

TEST(HeightField, FindsTheTrianglesWhoseBoundsMeetABox) {
  QueryRandom random(31);
  for (const bool holes : {false, true}) {
    const auto field = build(holes ? with_holes(11, 6, random) : wavy_field(11, 6));
    for (int i = 0; i < 500; ++i) {
      const Vec3 at = Vec3(3, 0, 3) + random.vector(4), half = random.vector(1).cwiseAbs();
      float min[3], max[3];
      for (int k = 0; k < 3; ++k) {
        min[k] = static_cast<float>(at[k] - half[k]);
        max[k] = static_cast<float>(at[k] + half[k]);
      }
      std::vector<std::uint32_t> found, expected;
      collision::find_field_triangles(*field, min, max, found);
      for (std::uint32_t t = 0; t < 2 * field->cells.size(); ++t) {
        if (field->cells[t / 2] == HeightFieldGeometry::kHole) continue;
        bool meets = true;
        for (int k = 0; k < 3; ++k) {
          float low = 1e9f, high = -1e9f;
          for (unsigned c = 0; c < 3; ++c) {
            const core::V3f v = collision::field_corner(*field, t, c);
            const float x = k == 0 ? v.x : k == 1 ? v.y : v.z;
            low = std::min(low, x);
            high = std::max(high, x);
          }
          meets = meets && low <= max[k] && high >= min[k];
        }
        if (meets) expected.push_back(t);
      }
      EXPECT_EQ(found, expected);
    }
  }
}

TEST(HeightField, WithBadDataIsRefused) {
  HeightFieldData data{.columns = 2, .rows = 2, .heights = {0, 0, 0, 0}};
  const auto refused = [](const HeightFieldData& d) {
    World world;
    try {
      world.add_body(
          {.type = BodyType::fixed, .shapes = {HeightField{std::make_shared<HeightFieldData>(d)}}});
    } catch (const InputError& error) {
      EXPECT_EQ(world.body_count(), 0u);
      return error.field() == "shapes[0].data";
    }
    return false;
  };
  EXPECT_FALSE(refused(data));
  HeightFieldData bad = data;
  bad.columns = 1;
  EXPECT_TRUE(refused(bad));
  bad = data;
  bad.heights.pop_back();
  EXPECT_TRUE(refused(bad));
  bad = data;
  bad.holes = {0, 0};
  EXPECT_TRUE(refused(bad));
  bad.holes = {1};
  EXPECT_TRUE(refused(bad));  // nothing but holes
  bad = data;
  bad.heights[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(refused(bad));
  World world;
  const HeightField field{std::make_shared<HeightFieldData>(data)};
  EXPECT_THROW(world.add_body({.shapes = {field}}), InputError);  // dynamic
  EXPECT_THROW(world.add_body({.type = BodyType::fixed, .shapes = {HeightField{}}}), InputError);
  EXPECT_THROW(
      world.add_body({.type = BodyType::fixed, .shapes = {HeightField{field.data, {1, 0, 1}}}}),
      InputError);
}

// Bodies of all convex kinds that fall on it, some steps.
std::uint64_t hash_after_falling(const Shape& ground, int steps) {
  World world({.continuous = false});  // fast bodies are swept against meshes only
  world.add_body({.type = BodyType::fixed, .shapes = {ground}, .position = {-6, 0, -6}});
  QueryRandom random(32);
  for (int i = 0; i < 42; ++i)
    world.add_body(
        {.shapes = {std::visit([](const auto& g) { return Shape(g); },
                               random_convex(random, i % kConvexKinds))},
         .position = {-4.5 + 1.5 * (i % 7), 2.5 + random.uniform(0, 1), -4.5 + 1.5 * (i / 7)},
         .orientation = random.rotation()});
  for (int i = 0; i < steps; ++i) world.step(1.0 / 60);
  return world.state_hash();
}

TEST(HeightField, CarriesBodiesAsTheSameMeshDoesToTheLastBit) {
  EXPECT_EQ(hash_after_falling(wavy_field(16, 12), 120),
            hash_after_falling(TriangleMesh{wavy_mesh(16, 12)}, 120));
}

TEST(HeightField, LetsBodiesFallThroughItsHolesOnly) {
  auto data = std::make_shared<HeightFieldData>();
  data->columns = data->rows = 9;
  data->heights.assign(81, 0);
  data->holes.assign(64, 0);
  for (const int cell : {27, 28, 35, 36}) data->holes[static_cast<std::size_t>(cell)] = 1;
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {HeightField{data}}, .position = {-4, 0, -4}});
  const BodyId over_hole =
      world.add_body({.shapes = {Sphere{0.5}}, .position = {0, 1, 0}});  // 2 x 2 m, its centre
  const BodyId beside =
      world.add_body({.shapes = {Box{{0.4, 0.4, 0.4}}}, .position = {2.5, 1, 2.5}});
  EXPECT_FALSE(world.ray_cast({{0, 5, 0}, {0, -10, 0}}, {.ignore = {over_hole}}));
  EXPECT_TRUE(world.ray_cast({{1.5, 5, 0}, {0, -10, 0}}, {.ignore = {over_hole}}));
  for (int i = 0; i < 120; ++i) world.step(1.0 / 60);
  EXPECT_LT(world.pose(over_hole).position.y(), -3);
  EXPECT_NEAR(world.pose(beside).position.y(), 0.4, 0.01);
}

// A box that slides over the seams of a flat field keeps its height and its heading.
TEST(HeightField, HasNoSeams) {
  auto data = std::make_shared<HeightFieldData>();
  data->columns = data->rows = 65;
  data->heights.assign(65 * 65, 0);
  World world;
  world.add_body({.type = BodyType::fixed,
                  .shapes = {HeightField{data, {0.5, 1, 0.5}}},
                  .position = {-16, 0, -16},
                  .friction = 0});
  const BodyId box = world.add_body({.shapes = {Box{{0.5, 0.3, 0.5}}},
                                     .position = {-12, 0.3, 0.3},
                                     .linear_velocity = {8, 0, 1},
                                     .friction = 0,
                                     .allow_sleep = false});
  for (int i = 0; i < 150; ++i) {
    world.step(1.0 / 60);
    EXPECT_NEAR(world.pose(box).position.y(), 0.3, 0.006) << i;
  }
  EXPECT_NEAR(world.linear_velocity(box).x(), 8, 1e-3);
  EXPECT_NEAR(world.angular_velocity(box).norm(), 0, 1e-3);
}

}  // namespace
}  // namespace skerry::test
