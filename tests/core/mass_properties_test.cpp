#include "core/mass_properties.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace skerry::core {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDensity = 750;

void expect_same(const MassProperties& got, const MassProperties& want, double relative) {
  EXPECT_NEAR(got.mass, want.mass, relative * want.mass);
  const double length = std::sqrt(want.inertia.trace() / want.mass);
  EXPECT_LT((got.center - want.center).norm(), relative * length);
  EXPECT_LT((got.inertia - want.inertia).cwiseAbs().maxCoeff(), relative * want.inertia.trace())
      << "got\n"
      << got.inertia << "\nwant\n"
      << want.inertia;
}

// Sums cells of a grid over a box whose midpoints are inside.
MassProperties integrate(const Vec3& half, double density,
                         const std::function<bool(const Vec3&)>& inside) {
  constexpr int kCells = 96;
  const Vec3 cell = half * (2.0 / kCells);
  const double mass = cell.prod() * density;
  std::vector<PointMass> points;
  for (int i = 0; i < kCells; ++i)
    for (int j = 0; j < kCells; ++j)
      for (int k = 0; k < kCells; ++k) {
        const Vec3 p = cell.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5)) - half;
        if (inside(p)) points.push_back({mass, p});
      }
  return point_masses(points);
}

// Slices of a solid of revolution about y whose radius at y is given, by the midpoint rule.
MassProperties revolve(double low, double high, double density,
                       const std::function<double(double)>& radius) {
  constexpr int kSlices = 200000;
  const double step = (high - low) / kSlices;
  double mass = 0, first = 0, along = 0, across = 0;
  for (int i = 0; i < kSlices; ++i) {
    const double y = low + (i + 0.5) * step, r = radius(y);
    const double slice = density * kPi * r * r * step;
    mass += slice;
    first += slice * y;
    along += slice * r * r / 2;
    across += slice * (r * r / 4 + y * y);
  }
  MassProperties sum;
  sum.mass = mass;
  sum.center = {0, first / mass, 0};
  across -= first * first / mass;
  sum.inertia.diagonal() << across, along, across;
  return sum;
}

struct Triangles {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  MassProperties solid(double density) const { return closed_mesh(vertices, triangles, density); }
};

Triangles box_mesh(const Vec3& half) {
  Triangles mesh;
  for (unsigned i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        half.cwiseProduct(Vec3((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1)));
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

// Profile (radius, y) from bottom to top turned about y; both ends on the axis.
Triangles lathe(const std::vector<std::array<double, 2>>& profile, unsigned segments) {
  Triangles mesh;
  for (const auto& [radius, y] : profile)
    for (unsigned s = 0; s < segments; ++s) {
      const double angle = 2 * kPi * s / segments;
      mesh.vertices.push_back({radius * std::cos(angle), y, radius * std::sin(angle)});
    }
  for (std::uint32_t ring = 0; ring + 1 < profile.size(); ++ring)
    for (std::uint32_t s = 0; s < segments; ++s) {
      const std::uint32_t a = ring * segments + s, b = ring * segments + (s + 1) % segments;
      mesh.triangles.push_back({a, a + segments, b});
      mesh.triangles.push_back({b, a + segments, b + segments});
    }
  return mesh;
}

Quat random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Quat{normal(random), normal(random), normal(random), normal(random)}.normalized();
}

TEST(MassProperties, box_matches_a_grid_and_its_closed_form) {
  const Vec3 half(0.4, 0.7, 1.1);
  const MassProperties box = solid_box(half, kDensity);
  expect_same(box, integrate(half, kDensity, [](const Vec3&) { return true; }), 1e-3);
  EXPECT_DOUBLE_EQ(box.mass, kDensity * 0.8 * 1.4 * 2.2);
  EXPECT_NEAR(box.inertia(0, 0), box.mass / 12 * (1.4 * 1.4 + 2.2 * 2.2), 1e-12 * box.mass);
}

TEST(MassProperties, round_solids_match_a_grid) {
  const double r = 0.6, h = 0.9;
  expect_same(solid_sphere(r, kDensity),
              integrate({r, r, r}, kDensity, [&](const Vec3& p) { return p.norm() < r; }), 3e-3);
  const Vec3 axes(0.5, 0.8, 1.3);
  expect_same(
      solid_ellipsoid(axes, kDensity),
      integrate(axes, kDensity, [&](const Vec3& p) { return p.cwiseQuotient(axes).norm() < 1; }),
      3e-3);
  const auto from_axis = [](const Vec3& p) { return std::hypot(p.x(), p.z()); };
  expect_same(solid_cylinder(r, h, kDensity),
              integrate({r, h, r}, kDensity, [&](const Vec3& p) { return from_axis(p) < r; }),
              3e-3);
  expect_same(solid_cone(r, h, kDensity),
              integrate({r, h, r}, kDensity,
                        [&](const Vec3& p) { return from_axis(p) < r * (h - p.y()) / (2 * h); }),
              3e-3);
  expect_same(solid_capsule(r, h, kDensity),
              integrate({r, h + r, r}, kDensity,
                        [&](const Vec3& p) {
                          const double beyond = std::max(0.0, std::abs(p.y()) - h);
                          return std::hypot(from_axis(p), beyond) < r;
                        }),
              3e-3);
}

TEST(MassProperties, solids_of_revolution_match_their_slices) {
  const double r = 0.6, h = 0.9;
  expect_same(solid_sphere(r, kDensity),
              revolve(-r, r, kDensity, [&](double y) { return std::sqrt(r * r - y * y); }), 1e-9);
  expect_same(
      solid_ellipsoid({r, h, r}, kDensity),
      revolve(-h, h, kDensity, [&](double y) { return r * std::sqrt(1 - y * y / (h * h)); }), 1e-9);
  expect_same(solid_cylinder(r, h, kDensity), revolve(-h, h, kDensity, [&](double) { return r; }),
              1e-9);
  expect_same(solid_cone(r, h, kDensity),
              revolve(-h, h, kDensity, [&](double y) { return r * (h - y) / (2 * h); }), 1e-9);
  expect_same(solid_capsule(r, h, kDensity),
              revolve(-h - r, h + r, kDensity,
                      [&](double y) {
                        const double beyond = std::max(0.0, std::abs(y) - h);
                        return std::sqrt(r * r - beyond * beyond);
                      }),
              1e-9);
}

TEST(MassProperties, hollow_sphere_is_the_limit_of_a_thin_shell) {
  const double r = 0.8, thin = 1e-5;
  const MassProperties outer = solid_sphere(r + thin / 2, kDensity);
  MassProperties inner = solid_sphere(r - thin / 2, kDensity);
  inner.mass = -inner.mass;
  inner.inertia = -inner.inertia;
  const MassProperties shell = combined(std::vector{outer, inner});
  expect_same(hollow_sphere(r, kDensity * thin), shell, 1e-8);
}

TEST(MassProperties, capsule_without_a_middle_is_a_sphere) {
  expect_same(solid_capsule(0.5, 0, kDensity), solid_sphere(0.5, kDensity), 1e-14);
}

TEST(MassProperties, box_mesh_is_the_box) {
  const Vec3 half(0.4, 0.7, 1.1);
  expect_same(box_mesh(half).solid(kDensity), solid_box(half, kDensity), 1e-14);
}

TEST(MassProperties, box_mesh_far_from_its_origin_keeps_its_inertia) {
  const Vec3 half(0.4, 0.7, 1.1), far(2000, -1000, 500);
  Triangles mesh = box_mesh(half);
  for (Vec3& vertex : mesh.vertices) vertex += far;
  MassProperties want = solid_box(half, kDensity);
  want.center = far;
  expect_same(mesh.solid(kDensity), want, 1e-10);
}

TEST(MassProperties, tessellated_solids_converge_with_the_square_of_the_segments) {
  const double r = 0.6, h = 0.9;
  const auto cylinder = [&](unsigned n) {
    return lathe({{0, -h}, {r, -h}, {r, h}, {0, h}}, n).solid(kDensity);
  };
  const auto cone = [&](unsigned n) {
    return lathe({{0, -h}, {r, -h}, {0, h}}, n).solid(kDensity);
  };
  const auto sphere = [&](unsigned n) {
    std::vector<std::array<double, 2>> profile;
    for (unsigned i = 0; i <= n; ++i)
      profile.push_back({r * std::sin(kPi * i / n), -r * std::cos(kPi * i / n)});
    return lathe(profile, n).solid(kDensity);
  };
  for (const unsigned n : {50u, 200u}) {
    const double relative = 20.0 / (n * n);
    expect_same(cylinder(n), solid_cylinder(r, h, kDensity), relative);
    expect_same(cone(n), solid_cone(r, h, kDensity), relative);
    expect_same(sphere(n), solid_sphere(r, kDensity), relative);
  }
}

TEST(MassProperties, mesh_wound_inward_has_negative_mass) {
  Triangles mesh = box_mesh({1, 1, 1});
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_NEAR(mesh.solid(1).mass, -8, 1e-12);
}

TEST(MassProperties, flat_or_empty_mesh_has_no_mass_and_no_nan) {
  EXPECT_EQ(closed_mesh({}, {}, 1).mass, 0);
  Triangles flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  flat.triangles = {{0, 1, 2}, {0, 2, 1}};
  const MassProperties none = flat.solid(1);
  EXPECT_EQ(none.mass, 0);
  EXPECT_TRUE(none.inertia.isZero());
  EXPECT_TRUE(none.center.allFinite());
}

TEST(MassProperties, parallel_axis_two_half_boxes_make_the_box) {
  const MassProperties half = solid_box({0.25, 0.7, 1.1}, kDensity);
  const std::vector parts = {placed(half, {{-0.25, 0, 0}, Quat::Identity()}),
                             placed(half, {{0.25, 0, 0}, Quat::Identity()})};
  expect_same(combined(parts), solid_box({0.5, 0.7, 1.1}, kDensity), 1e-14);
}

TEST(MassProperties, dumbbell_obeys_the_parallel_axis_theorem) {
  const MassProperties ball = solid_sphere(0.2, kDensity);
  const std::vector parts = {placed(ball, {{0, 0, -1.5}, Quat::Identity()}),
                             placed(ball, {{0, 0, 1.5}, Quat::Identity()})};
  const MassProperties dumbbell = combined(parts);
  EXPECT_NEAR(dumbbell.inertia(0, 0), 2 * (0.4 * ball.mass * 0.04 + ball.mass * 2.25), 1e-10);
  EXPECT_NEAR(dumbbell.inertia(2, 2), 2 * 0.4 * ball.mass * 0.04, 1e-10);
}

TEST(MassProperties, placing_moves_and_turns_like_the_mesh_it_stands_for) {
  std::mt19937 random(7);
  const Vec3 half(0.4, 0.7, 1.1);
  for (int i = 0; i < 50; ++i) {
    const Pose pose{Vec3::Random() * 3, random_rotation(random)};
    Triangles mesh = box_mesh(half);
    for (Vec3& vertex : mesh.vertices) vertex = pose.orientation * vertex + pose.position;
    expect_same(placed(solid_box(half, kDensity), pose), mesh.solid(kDensity), 1e-12);
  }
}

TEST(MassProperties, placed_inertia_is_exactly_symmetric) {
  std::mt19937 random(8);
  for (int i = 0; i < 50; ++i) {
    const Mat3 inertia =
        placed(solid_box({0.3, 0.5, 0.9}, kDensity), {{1, 2, 3}, random_rotation(random)}).inertia;
    EXPECT_EQ(inertia, inertia.transpose());
  }
}

TEST(MassProperties, combining_is_the_same_in_any_grouping) {
  std::mt19937 random(9);
  std::vector<MassProperties> parts;
  for (int i = 0; i < 6; ++i)
    parts.push_back(placed(solid_cone(0.3, 0.4, 100 + 50 * i),
                           {Vec3(i, -0.5 * i, 1), random_rotation(random)}));
  const std::span<const MassProperties> all(parts);
  const std::vector halves = {combined(all.first(2)), combined(all.subspan(2))};
  expect_same(combined(halves), combined(parts), 1e-13);
}

TEST(MassProperties, point_masses_of_a_cube_corner_grid) {
  std::vector<PointMass> corners;
  for (const Vec3& vertex : box_mesh({1, 1, 1}).vertices) corners.push_back({2, vertex});
  const MassProperties sum = point_masses(corners);
  EXPECT_DOUBLE_EQ(sum.mass, 16);
  EXPECT_TRUE(sum.inertia.isApprox(32 * Mat3::Identity(), 1e-14));
  EXPECT_EQ(point_masses({}).mass, 0);
}

TEST(MassProperties, scaled_to_keeps_shape_and_refuses_a_part_without_mass) {
  const MassProperties scaled = scaled_to(solid_cone(0.3, 0.4, 100), 5);
  expect_same(scaled, solid_cone(0.3, 0.4, 100 * 5 / solid_cone(0.3, 0.4, 100).mass), 1e-14);
  EXPECT_THROW(scaled_to(MassProperties{}, 5), std::invalid_argument);
  EXPECT_THROW(scaled_to(MassProperties{-1, Vec3::Zero(), Mat3::Identity()}, 5),
               std::invalid_argument);
}

TEST(MassProperties, every_solid_turned_anyhow_is_physical) {
  std::mt19937 random(10);
  for (const MassProperties& part :
       {solid_sphere(0.5, 1), hollow_sphere(0.5, 1), solid_ellipsoid({1, 2, 3}, 1),
        solid_box({1, 1e-3, 1}, 1), solid_capsule(0.1, 5, 1), solid_cylinder(1, 1e-4, 1),
        solid_cone(1, 3, 1)})
    for (int i = 0; i < 20; ++i)
      EXPECT_TRUE(
          is_physical_inertia(placed(part, {Vec3::Zero(), random_rotation(random)}).inertia));
}

TEST(MassProperties, unphysical_inertia_is_recognised) {
  const auto diagonal = [](double x, double y, double z) {
    return Mat3(Vec3(x, y, z).asDiagonal());
  };
  EXPECT_TRUE(is_physical_inertia(diagonal(1, 1, 2)));  // a flat plate: the limit
  EXPECT_FALSE(is_physical_inertia(diagonal(1, 1, 2.001)));
  EXPECT_FALSE(is_physical_inertia(diagonal(0, 1, 1)));
  EXPECT_FALSE(is_physical_inertia(diagonal(-1, 1, 1)));
  EXPECT_FALSE(is_physical_inertia(Mat3::Zero()));
  EXPECT_FALSE(is_physical_inertia(diagonal(1, 1, std::nan(""))));
  EXPECT_FALSE(is_physical_inertia(diagonal(1, 1, HUGE_VAL)));
  Mat3 skew = Mat3::Identity();
  skew(0, 1) = 0.1;
  EXPECT_FALSE(is_physical_inertia(skew));
  Mat3 singular = Mat3::Ones();  // eigenvalues 0, 0, 3
  EXPECT_FALSE(is_physical_inertia(singular));
}

}  // namespace
}  // namespace skerry::core
