#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "collision/bounds.h"
#include "collision/geometry_build.h"
#include "collision/mesh_tree.h"

namespace skerry::collision {
namespace {

using core::kNone;
using core::MeshGeometry;
using Triangle = std::array<std::uint32_t, 3>;

MeshData box(const Vec3& half) {
  MeshData mesh;
  for (unsigned i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        half.cwiseProduct(Vec3((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1)));
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

// n x n squares of a height field, up is +y.
MeshData terrain(unsigned n, double (*height)(double, double)) {
  MeshData mesh;
  for (unsigned i = 0; i <= n; ++i)
    for (unsigned k = 0; k <= n; ++k) mesh.vertices.push_back({double(i), height(i, k), double(k)});
  for (unsigned i = 0; i < n; ++i)
    for (unsigned k = 0; k < n; ++k) {
      const unsigned a = i * (n + 1) + k, b = a + n + 1;
      mesh.triangles.push_back({a, a + 1, b});
      mesh.triangles.push_back({b, a + 1, b + 1});
    }
  return mesh;
}

MeshData soup(const MeshData& mesh) {
  MeshData out;
  for (const Triangle& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (const std::uint32_t vertex : t) out.vertices.push_back(mesh.vertices[vertex]);
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

int convex_edges(const MeshGeometry& mesh) {
  int count = 0;
  for (const std::uint8_t edges : mesh.convex_edges) count += __builtin_popcount(edges);
  return count;
}

TEST(Mesh, neighbours_of_a_box_share_the_edge_and_point_back) {
  for (const MeshData& data : {box({1, 2, 3}), soup(box({1, 2, 3}))}) {
    const auto mesh = build_mesh(data, {1, 1, 1});
    ASSERT_EQ(mesh->triangles.size(), 12u);
    for (std::uint32_t t = 0; t < 12; ++t)
      for (const std::uint32_t other : mesh->neighbours[t]) {
        ASSERT_NE(other, kNone);
        EXPECT_TRUE(std::ranges::count(mesh->neighbours[other], t) == 1);
      }
    EXPECT_EQ(convex_edges(*mesh), 24);  // 12 edges, each seen from two sides; diagonals are flat
  }
}

TEST(Mesh, box_turned_inside_out_has_no_convex_edge) {
  MeshData data = box({1, 2, 3});
  for (Triangle& t : data.triangles) std::swap(t[1], t[2]);
  EXPECT_EQ(convex_edges(*build_mesh(data, {1, 1, 1})), 0);
}

TEST(Mesh, mirrored_scale_keeps_the_outside_outside) {
  const auto mesh = build_mesh(box({1, 2, 3}), {-1, 1, 1});
  EXPECT_EQ(convex_edges(*mesh), 24);
}

TEST(Mesh, flat_ground_has_convex_edges_at_its_border_only) {
  const unsigned n = 6;
  const auto flat = build_mesh(terrain(n, [](double, double) { return 0.0; }), {1, 1, 1});
  EXPECT_EQ(convex_edges(*flat), int(4 * n));
  int borders = 0;
  for (const auto& neighbours : flat->neighbours)
    for (const std::uint32_t other : neighbours) borders += other == kNone;
  EXPECT_EQ(borders, int(4 * n));
}

TEST(Mesh, ridge_is_convex_and_valley_is_not) {
  const auto ridge =
      build_mesh(terrain(2, [](double x, double) { return -std::abs(x - 1); }), {1, 1, 1});
  const auto valley =
      build_mesh(terrain(2, [](double x, double) { return std::abs(x - 1); }), {1, 1, 1});
  EXPECT_EQ(convex_edges(*ridge), 8 + 4);  // the ridge is two edges long
  EXPECT_EQ(convex_edges(*valley), 8);
}

TEST(Mesh, degenerate_triangles_are_left_out) {
  MeshData data = box({1, 1, 1});
  data.triangles.push_back({0, 0, 1});
  data.vertices.push_back({0, -1, -1});  // middle of edge 0-1
  data.triangles.push_back({0, 8, 1});
  EXPECT_EQ(build_mesh(data, {1, 1, 1})->triangles.size(), 12u);
}

void expect_refused(const MeshData& data, const Vec3& scale, const std::string& part) {
  try {
    build_mesh(data, scale);
    FAIL() << "taken: " << part;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(Mesh, bad_input_is_refused_by_name) {
  expect_refused({}, {1, 1, 1}, "no triangles");
  MeshData data = box({1, 1, 1});
  expect_refused(data, {1, 0, 1}, "scale");
  expect_refused(data, {1, HUGE_VAL, 1}, "scale");
  data.triangles[4][1] = 8;
  expect_refused(data, {1, 1, 1}, "triangle 4 of the mesh names vertex 8 of 8");
  data = box({1, 1, 1});
  data.vertices[5].y() = std::nan("");
  expect_refused(data, {1, 1, 1}, "vertex 5");
  data = box({1, 1, 1});
  data.triangles = {{0, 1, 1}};
  expect_refused(data, {1, 1, 1}, "degenerate");
}

TEST(Mesh, solid_defects_are_named) {
  EXPECT_EQ(solid_defect(box({1, 2, 3})), "");
  EXPECT_EQ(solid_defect(soup(box({1, 2, 3}))), "");
  MeshData data = box({1, 1, 1});
  data.triangles.pop_back();
  EXPECT_EQ(solid_defect(data), "edge 1-5 belongs to one triangle only (4)");
  data = box({1, 1, 1});
  std::swap(data.triangles[3][1], data.triangles[3][2]);
  EXPECT_NE(solid_defect(data).find("wind against each other"), std::string::npos);
  data = box({1, 1, 1});
  data.triangles.push_back({0, 3, 7});
  EXPECT_NE(solid_defect(data).find("belongs to"), std::string::npos);
  data = box({1, 1, 1});
  for (Triangle& t : data.triangles) std::swap(t[1], t[2]);
  EXPECT_NE(solid_defect(data).find("inward"), std::string::npos);
  EXPECT_NE(solid_defect(terrain(3, [](double, double) { return 0.0; })), "");
}

Aabb triangle_box(const MeshGeometry& mesh, std::uint32_t t) {
  Aabb box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = HUGE_VALF;
    box.max[axis] = -HUGE_VALF;
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      const core::V3f& v = mesh.vertices[vertex];
      const float x = axis == 0 ? v.x : axis == 1 ? v.y : v.z;
      box.min[axis] = std::min(box.min[axis], x);
      box.max[axis] = std::max(box.max[axis], x);
    }
  }
  return box;
}

TEST(MeshTree, box_query_equals_brute_force_in_order) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(-2, 34), size(0, 3);
  for (const unsigned n : {1u, 2u, 3u, 5u, 32u}) {
    const auto mesh = build_mesh(
        terrain(n, [](double x, double z) { return std::sin(x) * std::cos(0.7 * z); }), {1, 1, 1});
    std::vector<std::uint32_t> found, expected;
    for (int i = 0; i < 300; ++i) {
      Aabb box;
      for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] = axis == 1 ? -1.5f : uniform(random) * float(n) / 32;
        box.max[axis] = box.min[axis] + size(random);
      }
      found.clear();
      expected.clear();
      mesh->tree->query(box.min, box.max, found);
      for (std::uint32_t t = 0; t < mesh->triangles.size(); ++t)
        if (overlap(triangle_box(*mesh, t), box)) expected.push_back(t);
      ASSERT_EQ(found, expected);
    }
  }
}

TEST(MeshTree, ray_query_finds_every_triangle_that_is_hit) {
  std::mt19937 random(12);
  std::uniform_real_distribution<float> uniform(0, 32), tilt(-1, 1);
  const auto mesh = build_mesh(
      terrain(32, [](double x, double z) { return std::sin(x) * std::cos(0.7 * z); }), {1, 1, 1});
  std::vector<std::uint32_t> found;
  std::size_t candidates = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto target = static_cast<std::uint32_t>(random() % mesh->triangles.size());
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t vertex : mesh->triangles[target])
      middle += core::to_double(mesh->vertices[vertex]) / 3;
    const core::V3f m = core::to_float(middle);
    const float down[3] = {i % 2 ? 0.0f : tilt(random), -10, i % 2 ? -0.0f : tilt(random)};
    const float origin[3] = {m.x - down[0], m.y - down[1], m.z - down[2]};
    found.clear();
    mesh->tree->query_ray(origin, down, 1.001f, found);
    EXPECT_TRUE(std::ranges::is_sorted(found));
    EXPECT_TRUE(std::ranges::binary_search(found, target)) << "ray " << i;
    candidates += found.size();
    found.clear();
    mesh->tree->query_ray(origin, down, 0.5f, found);
    EXPECT_TRUE(found.empty());
  }
  EXPECT_LT(candidates, 1000u * 12);
}

TEST(MeshTree, hundred_thousand_triangles_need_few_nodes) {
  const auto mesh = build_mesh(terrain(224, [](double, double) { return 0.0; }), {1, 1, 1});
  const std::size_t triangles = mesh->triangles.size();
  EXPECT_GT(triangles, 100000u);
  EXPECT_LT(mesh->tree->nodes.size(), triangles / 6);
}

}  // namespace
}  // namespace skerry::collision
