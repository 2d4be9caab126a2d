// Overlaps and distances.
#include <gtest/gtest.h>

#include <fcl/narrowphase/distance.h>

#include <cmath>

#include "tests/collision/query_oracle.h"
#include "tests/collision/query_random.h"

namespace skerry::test {
namespace {

Shape shape_of(const ShapeGeometry& geometry) {
  return std::visit([](const auto& g) { return Shape(g); }, geometry);
}

World world_with(const Solid& solid) {
  World world;
  world.add_body({.type = BodyType::fixed,
                  .shapes = {shape_of(solid.geometry)},
                  .position = solid.pose.position,
                  .orientation = solid.pose.orientation});
  return world;
}

// The nearest points belong to the shapes (no distance is larger), and planes across the normal part
// the shapes by as much (none is smaller).
TEST(Closest, OfEveryPairOfConvexShapesIsProvedByPointsAndPlanes) {
  QueryRandom random(11);
  int apart = 0, overlapping = 0;
  for (int i = 0; i < 49 * 40; ++i) {
    const Solid a{random_convex(random, i / kConvexKinds % kConvexKinds), random.pose(1.5)};
    const Solid b{random_convex(random, i % kConvexKinds), random.pose(1.5)};
    const World world = world_with(b);
    const QueryShape shape(shape_of(a.geometry));
    const auto hit = world.closest(shape, a.pose, 10);
    ASSERT_TRUE(hit);
    const bool overlap = !world.overlap(shape, a.pose).empty();
    EXPECT_EQ(overlap, hit->distance == 0) << i;
    EXPECT_TRUE(a.contains(hit->on_query, 1e-5)) << i;
    EXPECT_TRUE(b.contains(hit->on_body, 1e-5)) << i;
    if (hit->distance == 0) {  // a point in common
      ++overlapping;
      EXPECT_EQ(hit->on_query, hit->on_body);
      continue;
    }
    ++apart;
    EXPECT_NEAR(hit->normal.norm(), 1, 1e-12);
    EXPECT_NEAR((hit->on_query - hit->on_body).dot(hit->normal), hit->distance, 1e-6) << i;
    EXPECT_NEAR(plane_gap(a, Vec3::Zero(), b, -hit->normal), hit->distance, 5e-6) << i;
    EXPECT_FALSE(world.closest(shape, a.pose, hit->distance * 0.999));
  }
  EXPECT_GT(apart, 500);
  EXPECT_GT(overlapping, 300);
}

TEST(Closest, BetweenBoxesAgreesWithFcl) {
  QueryRandom random(12);
  for (int i = 0; i < 500; ++i) {
    const Box box_a{random.vector(0.4).cwiseAbs() + Vec3(0.2, 0.2, 0.2)};
    const Box box_b{random.vector(0.4).cwiseAbs() + Vec3(0.2, 0.2, 0.2)};
    const Pose a = random.pose(1.5), b = random.pose(1.5);
    const auto object = [](const Box& box, const Pose& pose) {
      const Vec3 size = 2 * box.half_extents;
      Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
      place.linear() = pose.orientation.toRotationMatrix();
      place.translation() = pose.position;
      return fcl::CollisionObjectd(std::make_shared<fcl::Boxd>(size.x(), size.y(), size.z()),
                                   place);
    };
    const fcl::CollisionObjectd fa = object(box_a, a), fb = object(box_b, b);
    fcl::DistanceRequestd request;
    request.distance_tolerance = 1e-9;
    fcl::DistanceResultd result;
    const double expected = std::max(0.0, fcl::distance(&fa, &fb, request, result));
    const auto hit = world_with({box_b, b}).closest(QueryShape(box_a), a, 100);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, expected, 1e-5) << i;
  }
}

TEST(Closest, OfAPointAndASurfaceIsTheNearestOfAllTriangles) {
  QueryRandom random(13);
  const auto mesh = wavy_mesh(16, 8);
  const Pose pose = random.pose(3);
  World mesh_world, field_world;
  mesh_world.add_body({.type = BodyType::fixed,
                       .shapes = {TriangleMesh{mesh}},
                       .position = pose.position,
                       .orientation = pose.orientation});
  field_world.add_body({.type = BodyType::fixed,
                        .shapes = {wavy_field(16, 8)},
                        .position = pose.position,
                        .orientation = pose.orientation});
  std::vector<Vec3> placed;
  for (const Vec3& v : mesh->vertices) placed.push_back(pose.orientation * v + pose.position);
  for (int i = 0; i < 500; ++i) {
    const Vec3 point = pose.position + random.vector(8);
    double best = 1e300;
    for (const auto& t : mesh->triangles)
      best = std::min(
          best,
          (nearest_on_triangle(placed[t[0]], placed[t[1]], placed[t[2]], point) - point).norm());
    for (const World* world : {&mesh_world, &field_world}) {
      const auto hit = world->closest(point, 1e3);
      ASSERT_TRUE(hit);
      EXPECT_NEAR(hit->distance, best, 1e-9 * (1 + best)) << i;
      EXPECT_NEAR((hit->on_body - point).norm(), best, 1e-9 * (1 + best));
      EXPECT_FALSE(world->closest(point, 0.999 * best));
      // A ball of that radius touches, a smaller one does not.
      EXPECT_EQ(world->overlap(Sphere{1.001 * best}, {point, Quat::Identity()}).size(), 1u);
      EXPECT_TRUE(world->overlap(Sphere{0.999 * best}, {point, Quat::Identity()}).empty());
    }
  }
}

TEST(Closest, ToAPlaneIsTheHeight) {
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {Plane{.normal = {0, 1, 0}, .offset = 1}}});
  const auto point = world.closest({5, 4, -2}, 10);
  ASSERT_TRUE(point);
  EXPECT_DOUBLE_EQ(point->distance, 3);
  EXPECT_EQ(point->on_body, Vec3(5, 1, -2));
  EXPECT_EQ(point->normal, Vec3(0, 1, 0));
  EXPECT_FALSE(world.closest({5, 4, -2}, 2.9));
  const auto box = world.closest(Box{{1, 1, 1}}, {{0, 4, 0}, Quat::Identity()}, 10);
  ASSERT_TRUE(box);
  EXPECT_DOUBLE_EQ(box->distance, 2);
  const auto inside = world.closest({0, 0, 0}, 10);
  ASSERT_TRUE(inside);
  EXPECT_EQ(inside->distance, 0);
  EXPECT_EQ(inside->normal, Vec3::Zero());
}

TEST(Closest, InAFullWorldFindsWhatEachBodyGivesAlone) {
  for (const Vec3& middle : {Vec3(0, 0, 0), Vec3(-3e6, 1e6, 2e6)}) {
    QueryRandom random(14);
    World world = random_world(random, 80, 6, middle);
    for (int i = 0; i < 60; ++i) {
      const QueryShape shape(shape_of(random_convex(random, i % kConvexKinds)));
      Pose pose = random.pose(8);
      pose.position += middle;
      const auto all = world.closest_all(shape, pose, 3);
      const auto overlaps = world.overlap(shape, pose);
      std::size_t singles = 0, touching = 0;
      for (const BodyId body : world.bodies()) {
        const QueryFilter only = {.accept = [&](BodyId b, std::uint32_t) { return b == body; }};
        singles += world.closest_all(shape, pose, 3, only).size();
        touching += world.overlap(shape, pose, only).size();
      }
      EXPECT_EQ(all.size(), singles);
      EXPECT_EQ(overlaps.size(), touching);
      std::size_t zero = 0;
      for (std::size_t k = 0; k < all.size(); ++k) {
        zero += all[k].distance == 0;
        EXPECT_LE(all[k > 0 ? k - 1 : 0].distance, all[k].distance);
      }
      EXPECT_EQ(zero, overlaps.size());
      for (std::size_t k = 1; k < overlaps.size(); ++k)
        EXPECT_LE(overlaps[k - 1].body.index, overlaps[k].body.index);
      const auto first = world.closest(shape, pose, 3);
      ASSERT_EQ(first.has_value(), !all.empty());
      if (!first) continue;
      EXPECT_EQ(first->body, all[0].body);
      EXPECT_EQ(first->distance, all[0].distance);
    }
  }
}

TEST(Distance, BetweenTwoBodiesIsTheLeastOverTheirShapesFromEitherSide) {
  QueryRandom random(15);
  for (int i = 0; i < 60; ++i) {
    World world;
    std::vector<BodyId> bodies;
    const auto add = [&](std::vector<Shape> shapes, double size) {
      const Pose pose = random.pose(size);
      bodies.push_back(world.add_body({.type = BodyType::fixed,
                                       .shapes = std::move(shapes),
                                       .position = pose.position,
                                       .orientation = pose.orientation}));
    };
    std::vector<Shape> parts;
    for (int k = 0; k < 4; ++k)
      parts.emplace_back(random_convex(random, (i + k) % kConvexKinds),
                         ShapeOptions{.local_pose = random.pose(1)});
    add(parts, 4);
    add({shape_of(random_convex(random, i % kConvexKinds))}, 4);
    add({TriangleMesh{wavy_mesh(6, 3)}}, 6);
    add({wavy_field(6, 3)}, 6);
    add({Plane{}}, 1);
    for (std::size_t a = 0; a < bodies.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        const auto forth = world.distance(bodies[a], bodies[b]);
        const auto back = world.distance(bodies[b], bodies[a]);
        ASSERT_TRUE(forth && back);
        EXPECT_NEAR(forth->distance, back->distance, 1e-7);
        if (forth->distance == 0) continue;
        EXPECT_NEAR((forth->on_b - forth->on_a).norm(), forth->distance, 1e-6);
        EXPECT_LT((forth->on_a + forth->normal * forth->distance - forth->on_b).norm(), 1e-5);
        EXPECT_FALSE(world.distance(bodies[a], bodies[b], 0.99 * forth->distance));
        // The nearest points lie on the two bodies.
        const auto on = [&](BodyId body, const Vec3& point) {
          return world
              .closest(point, 10,
                       {.accept = [&](BodyId other, std::uint32_t) { return other == body; }})
              ->distance;
        };
        EXPECT_LT(on(bodies[a], forth->on_a), 1e-5);
        EXPECT_LT(on(bodies[b], forth->on_b), 1e-5);
      }
    // The compound against the single shape, from the query's side.
    const auto direct =
        world.closest(QueryShape(parts[0]), *world.queries().pose(bodies[0]), 100,
                      {.accept = [&](BodyId body, std::uint32_t) { return body == bodies[1]; }});
    ASSERT_TRUE(direct);
    EXPECT_LE(world.distance(bodies[0], bodies[1])->distance, direct->distance + 1e-6);
  }
}

}  // namespace
}  // namespace skerry::test
