#include "scenes/mesh_file.h"

#include <gtest/gtest.h>

#include <set>

#include "scenes/geometry.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

std::filesystem::path mesh_path(const char* name) {
  return source_dir() / "tests/scenes/meshes" / name;
}

// Six times the volume enclosed by a closed mesh.
double signed_volume(const MeshData& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    sum += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c]));
  }
  return sum / 6;
}

bool closed(const MeshData& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& [a, b, c] : mesh.triangles) {
    edges.insert({{a, b}, {b, c}, {c, a}});
  }
  for (const auto& [a, b] : edges) {
    if (!edges.contains({b, a})) return false;
  }
  return true;
}

class MeshFormat : public testing::TestWithParam<const char*> {};

TEST_P(MeshFormat, gives_the_same_closed_block) {
  const MeshData block = scenes::load_mesh(mesh_path(GetParam()));
  EXPECT_EQ(block.vertices.size(), 8u);  // STL has 36
  EXPECT_EQ(block.triangles.size(), 12u);
  EXPECT_TRUE(closed(block));
  EXPECT_NEAR(signed_volume(block), 1, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Files, MeshFormat,
                         testing::Values("block.obj", "block.stl", "block_binary.stl", "block.ply"),
                         [](const auto& row) {
                           std::string name = row.param;
                           for (char& c : name) c = c == '.' ? '_' : c;
                           return name;
                         });

TEST(MeshFile, scale_is_applied_per_axis) {
  const MeshData block = scenes::load_mesh(mesh_path("block.obj"), {.scale = {2, 3, 4}});
  EXPECT_NEAR(signed_volume(block), 24, 1e-12);
}

TEST(MeshFile, defects_may_be_let_through) {
  EXPECT_THROW(scenes::load_mesh(mesh_path("twisted.obj")), std::runtime_error);
  EXPECT_EQ(scenes::load_mesh(mesh_path("twisted.obj"), {.manifold = false}).triangles.size(), 2u);
}

TEST(MeshFile, welding_merges_near_vertices_across_cell_borders) {
  MeshData mesh;
  // Two triangles that share an edge but for a thousandth, on both sides of multiples of 0.01.
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0.9995, 0}, {1, -0.0005, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_EQ(scenes::welded(mesh, 0).vertices.size(), 6u);
  EXPECT_EQ(scenes::welded(mesh, 0.01).vertices.size(), 4u);
}

TEST(MeshFile, welding_drops_triangles_that_become_lines_and_joins_both_zeros) {
  MeshData mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0, 0, 0}, {1e-5, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 2, 1}, {0, 4, 1}};
  EXPECT_EQ(scenes::welded(mesh, 0).vertices.size(), 4u);
  EXPECT_EQ(scenes::welded(mesh, 1e-3).triangles.size(), 2u);
}

TEST(Geometry, made_meshes_are_surfaces) {
  const MeshData ball = scenes::ball_mesh(2, 3);
  EXPECT_EQ(ball.triangles.size(), 20u * 64);
  EXPECT_TRUE(closed(ball));
  EXPECT_EQ(scenes::manifold_defect(ball), "");
  EXPECT_NEAR(signed_volume(ball), 4.0 / 3 * 3.14159265 * 8, 0.3);

  const MeshData ground = scenes::wavy_ground(80, 40, 0.8, 5);
  EXPECT_EQ(ground.triangles.size(), 12'800u);
  EXPECT_EQ(scenes::manifold_defect(ground), "");
  for (const auto& [a, b, c] : ground.triangles) {
    const Vec3 normal =
        (ground.vertices[b] - ground.vertices[a]).cross(ground.vertices[c] - ground.vertices[a]);
    ASSERT_GT(normal.y(), 0) << "seen from above";
  }
}

}  // namespace
}  // namespace skerry::test
