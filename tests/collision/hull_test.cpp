#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "collision/geometry_build.h"
#include "collision/quickhull.h"

namespace skerry::collision {
namespace {

using core::HullGeometry;
using Points = std::vector<Vec3>;

// What every hull must be: closed, convex, consistent, and around all its points.
void expect_sound(const HullGeometry& hull, const Points& points, double tolerance) {
  const auto v = static_cast<long>(hull.vertices.size()), e = static_cast<long>(hull.edges.size()),
             f = static_cast<long>(hull.faces.size());
  EXPECT_EQ(v - e + f, 2) << "Euler: " << v << " vertices, " << e << " edges, " << f << " faces";
  for (const HullGeometry::Face& face : hull.faces) {
    ASSERT_GE(face.count, 3);
    EXPECT_NEAR(core::length(face.normal), 1, 1e-6);
    const Vec3 normal = core::to_double(face.normal);
    for (const Vec3& point : points) EXPECT_LE(normal.dot(point) - double(face.offset), tolerance);
    for (unsigned i = 0; i < face.count; ++i) {
      const auto corner = hull.vertices[hull.face_vertices[face.first + i]];
      EXPECT_NEAR(core::dot(face.normal, corner), face.offset, tolerance);
    }
  }
  std::set<std::pair<unsigned, unsigned>> directed;
  for (const HullGeometry::Face& face : hull.faces)
    for (unsigned i = 0; i < face.count; ++i)
      EXPECT_TRUE(directed
                      .insert({hull.face_vertices[face.first + i],
                               hull.face_vertices[face.first + (i + 1u) % face.count]})
                      .second);
  EXPECT_EQ(directed.size(), 2 * hull.edges.size());
  for (const HullGeometry::Edge& edge : hull.edges) {
    EXPECT_LT(edge.tail, edge.head);
    EXPECT_NE(edge.left_face, edge.right_face);
    EXPECT_TRUE(directed.contains({edge.tail, edge.head}));
    EXPECT_TRUE(directed.contains({edge.head, edge.tail}));
    const HullGeometry::Face& left = hull.faces[edge.left_face];
    bool found = false;
    for (unsigned i = 0; i < left.count; ++i)
      found |= hull.face_vertices[left.first + i] == edge.tail &&
               hull.face_vertices[left.first + (i + 1u) % left.count] == edge.head;
    EXPECT_TRUE(found) << "the left face runs along its edge from tail to head";
  }
  EXPECT_GT(hull.inner_radius, 0);
}

Points cube(double half) {
  Points points;
  for (int i = 0; i < 8; ++i)
    points.push_back({(i & 1) ? half : -half, (i & 2) ? half : -half, (i & 4) ? half : -half});
  return points;
}

Points icosahedron() {
  const double g = std::numbers::phi;
  Points points;
  for (const double a : {-1.0, 1.0})
    for (const double b : {-g, g}) {
      points.push_back({0, a, b});
      points.push_back({a, b, 0});
      points.push_back({b, 0, a});
    }
  return points;
}

Points dodecahedron() {
  const double g = std::numbers::phi;
  Points points = cube(1);
  for (const double a : {-1 / g, 1 / g})
    for (const double b : {-g, g}) {
      points.push_back({0, a, b});
      points.push_back({a, b, 0});
      points.push_back({b, 0, a});
    }
  return points;
}

Quat random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Quat{normal(random), normal(random), normal(random), normal(random)}.normalized();
}

void turn_and_move(Points& points, std::mt19937& random) {
  const Quat q = random_rotation(random);
  const Vec3 offset = Vec3(0.3, -0.2, 0.1);
  for (Vec3& point : points) point = q * point + offset;
}

TEST(Hull, cube_has_six_quads_and_its_centre) {
  Points points = cube(0.5);
  points.push_back({0, 0, 0});
  points.push_back({0.5, 0, 0});       // inside a face
  points.push_back({0.5, 0.5, 0.25});  // on an edge
  points.push_back(points[3]);         // twice
  const auto hull = build_hull(points);
  expect_sound(*hull, points, 1e-6);
  EXPECT_EQ(hull->vertices.size(), 8u);
  EXPECT_EQ(hull->faces.size(), 6u);
  EXPECT_EQ(hull->edges.size(), 12u);
  for (const auto& face : hull->faces) EXPECT_EQ(face.count, 4);
  EXPECT_LT(core::length(hull->center), 1e-7f);
  EXPECT_NEAR(hull->inner_radius, 0.5, 1e-6);
}

TEST(Hull, platonic_solids_keep_their_faces_however_turned) {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    Points ico = icosahedron(), dodeca = dodecahedron(), box = cube(2);
    for (Points* points : {&ico, &dodeca, &box}) turn_and_move(*points, random);
    const auto a = build_hull(ico), b = build_hull(dodeca), c = build_hull(box);
    expect_sound(*a, ico, 1e-5);
    expect_sound(*b, dodeca, 1e-5);
    expect_sound(*c, box, 1e-5);
    EXPECT_EQ(a->faces.size(), 20u);
    EXPECT_EQ(b->faces.size(), 12u);
    EXPECT_EQ(b->vertices.size(), 20u);
    EXPECT_EQ(c->faces.size(), 6u);
    EXPECT_NEAR(core::length(b->center - core::V3f{0.3f, -0.2f, 0.1f}), 0, 1e-5);
  }
}

TEST(Hull, prism_with_round_base_has_two_polygons) {
  std::mt19937 random(4);
  for (const int sides : {3, 8, 64}) {
    Points points;
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      for (const double y : {-1.0, 1.0}) points.push_back({std::cos(angle), y, std::sin(angle)});
    }
    turn_and_move(points, random);
    const auto hull = build_hull(points);
    expect_sound(*hull, points, 1e-5);
    EXPECT_EQ(hull->faces.size(), unsigned(sides + 2));
  }
}

TEST(Hull, a_thousand_random_hulls_are_sound) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const int count = 4 + int(random() % 80);
    const double stretch = i % 3 == 0 ? 0.05 : 1, scale = std::pow(10.0, uniform(random) * 3);
    Points points;
    for (int k = 0; k < count; ++k) {
      Vec3 p{uniform(random), uniform(random), uniform(random)};
      if (i % 4 == 1) p = Vec3{normal(random), normal(random), normal(random)}.normalized();
      if (i % 4 == 2) p = (p * 3).array().round() / 3;  // many coplanar and equal points
      points.push_back(Vec3(p.x(), p.y() * stretch, p.z()) * scale);
    }
    turn_and_move(points, random);
    try {
      expect_sound(*build_hull(points), points, 1e-5 * std::max(1.0, scale));
    } catch (const std::invalid_argument&) {
      EXPECT_TRUE(i % 4 == 2 && count < 12) << "hull " << i;  // the grid may be flat by chance
    }
  }
}

TEST(Hull, noise_on_a_cube_as_large_as_float_rounding_still_gives_six_faces) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> noise(-1e-7, 1e-7);
  for (int i = 0; i < 200; ++i) {
    Points points;
    for (int x = -2; x <= 2; ++x)
      for (int y = -2; y <= 2; ++y)
        for (int z = -2; z <= 2; ++z)
          points.push_back(Vec3(x, y, z) / 4 + Vec3{noise(random), noise(random), noise(random)});
    const auto hull = build_hull(points);
    expect_sound(*hull, points, 1e-5);
    EXPECT_EQ(hull->faces.size(), 6u);
    EXPECT_EQ(hull->vertices.size(), 8u);
  }
}

TEST(Hull, ten_thousand_points_on_a_sphere) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Points points;
  for (int i = 0; i < 10000; ++i)
    points.push_back(Vec3{normal(random), normal(random), normal(random)}.normalized());
  const auto triangles = quickhull(points);
  EXPECT_EQ(triangles.size(), 2 * points.size() - 4);
}

TEST(Hull, same_input_gives_the_same_hull_bit_by_bit) {
  std::mt19937 random(8);
  Points points = icosahedron();
  turn_and_move(points, random);
  const auto a = build_hull(points), b = build_hull(points);
  EXPECT_EQ(a->face_vertices, b->face_vertices);
  for (std::size_t i = 0; i < a->faces.size(); ++i)
    EXPECT_EQ(a->faces[i].offset, b->faces[i].offset);
}

void expect_refused(const Points& points, const std::string& part) {
  try {
    build_hull(points);
    FAIL() << "taken: " << part;
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(Hull, degenerate_input_is_refused_with_its_reason) {
  expect_refused({}, "at least 4");
  expect_refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, "at least 4 points, not 3");
  expect_refused(Points(5, Vec3(1, 2, 3)), "coincide");
  expect_refused({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3.00001}}, "line");
  expect_refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1e-6}}, "plane");
  expect_refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nan("")}}, "point 3");
  expect_refused({{0, 0, 0}, {1, 0, 0}, {0, 1e300, 0}, {0, 0, 1}}, "point 2");
}

TEST(Hull, thin_plate_is_taken) {
  Points points = cube(1);
  for (Vec3& point : points) point.y() *= 1e-3;
  const auto hull = build_hull(points);
  expect_sound(*hull, points, 1e-6);
  EXPECT_EQ(hull->faces.size(), 6u);
}

}  // namespace
}  // namespace skerry::collision
