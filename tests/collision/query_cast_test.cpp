// Rays and moving shapes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/collision/query_oracle.h"
#include "tests/collision/query_random.h"
#include "tests/support/rounds.h"

namespace skerry::test {
namespace {

bool same(const CastHit& a, const CastHit& b) {
  return a.body == b.body && a.shape == b.shape && a.triangle == b.triangle &&
         a.fraction == b.fraction && a.position == b.position && a.normal == b.normal &&
         a.initial_overlap == b.initial_overlap;
}

World world_with(const Solid& solid) {
  World world;
  world.add_body({.type = BodyType::fixed,
                  .shapes = {std::visit([](const auto& g) { return Shape(g); }, solid.geometry)},
                  .position = solid.pose.position,
                  .orientation = solid.pose.orientation});
  return world;
}

// Shapes keep their sizes in float.
constexpr double kFloat = 3e-6;

// The hit lies on the surface and is the first: what is before it is outside.
void expect_entry(const Solid& solid, const RayCast& ray, const CastHit& hit, double tolerance) {
  EXPECT_NEAR(hit.normal.norm(), 1, 1e-12);
  EXPECT_LT((hit.position - (ray.origin + hit.fraction * ray.translation)).norm(), 1e-9);
  EXPECT_TRUE(solid.contains(hit.position, tolerance));
  if (hit.initial_overlap) {
    EXPECT_EQ(hit.fraction, 0);
    return;
  }
  EXPECT_LE(hit.normal.dot(ray.translation), 0);
  // The plane at the hit has the whole shape behind it.
  EXPECT_LE(hit.normal.dot(solid.support(hit.normal) - hit.position), tolerance);
}

TEST(RayCast, OfEveryConvexShapeHitsWhereSamplingDoes) {
  QueryRandom random(1);
  int hits = 0;
  const int rays = rounds(1400);
  for (int i = 0; i < rays; ++i) {
    const Solid solid{random_convex(random, i % kConvexKinds), random.pose(1)};
    const World world = world_with(solid);
    RayCast ray{random.vector(3), Vec3::Zero()};
    ray.translation = solid.pose.position + random.vector(0.7) - ray.origin;
    ray.translation *= random.uniform(0.5, 3);
    const double expected = first_inside(solid, ray.origin, ray.translation);
    const auto hit = world.ray_cast(ray);
    if (expected >= 0) {
      ASSERT_TRUE(hit) << "ray " << i;
      EXPECT_NEAR(hit->fraction, expected, 2e-5) << "ray " << i;
      EXPECT_EQ(hit->initial_overlap, expected == 0) << "ray " << i;
    }
    if (hit) {
      ++hits;
      expect_entry(solid, ray, *hit, kFloat * (1 + 2 * hit->initial_overlap));
    }
    EXPECT_EQ(world.ray_hits(ray), hit.has_value());
  }
  EXPECT_GT(hits, rays / 3);
}

TEST(RayCast, AgainstAPlaneHitsAtItsSurfaceAndStartsInsideBelowIt) {
  World world;
  const BodyId ground = world.add_body(
      {.type = BodyType::fixed, .shapes = {Plane{.normal = {0, 1, 0}, .offset = 2}}});
  const auto hit = world.ray_cast({{1, 6, 3}, {8, -8, 0}});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body, ground);
  EXPECT_DOUBLE_EQ(hit->fraction, 0.5);
  EXPECT_EQ(hit->normal, Vec3(0, 1, 0));
  EXPECT_FALSE(world.ray_cast({{0, 6, 0}, {0, 5, 0}}));
  EXPECT_FALSE(world.ray_cast({{0, 6, 0}, {5, 0, 0}}));  // parallel
  const auto inside = world.ray_cast({{0, 1, 0}, {0, 3, 4}});
  ASSERT_TRUE(inside);
  EXPECT_TRUE(inside->initial_overlap);
  EXPECT_LT((inside->normal - Vec3(0, -0.6, -0.8)).norm(), 1e-12);
}

// On the surface: in is a hit, out is none.
TEST(RayCast, FromTheSurfaceHitsGoingInAndMissesGoingOut) {
  for (const ShapeGeometry& shape :
       {ShapeGeometry(Sphere{1}), ShapeGeometry(Box{{1, 1, 1}}), ShapeGeometry(Cylinder{1, 1}),
        ShapeGeometry(Ellipsoid{{1, 1, 1}}), ShapeGeometry(Capsule{1, 0.5})}) {
    const World world = world_with({shape, {}});
    EXPECT_FALSE(world.ray_cast({{1, 0, 0}, {5, 0, 0}})) << shape.index();
    const auto in = world.ray_cast({{1, 0, 0}, {-5, 0, 0}});
    ASSERT_TRUE(in) << shape.index();
    EXPECT_EQ(in->fraction, 0);
    EXPECT_LT((in->normal - Vec3(1, 0, 0)).norm(), 1e-12);
  }
}

TEST(RayCast, AlongAnAxisPastABoxHitsOnlyIfItTouches) {
  const World world = world_with({Box{{1, 2, 3}}, {}});
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) {
      Vec3 along = Vec3::Zero(), aside = Vec3::Zero();
      along[axis] = 20 * sign;
      const double edge = axis == 0 ? 2 : 1;
      aside[axis == 0 ? 1 : 0] = edge;
      const Vec3 start = -along / 2;
      EXPECT_TRUE(world.ray_hits({start, along}));
      EXPECT_TRUE(world.ray_hits({start + aside, along})) << "in the face's plane";
      EXPECT_TRUE(world.ray_hits({start + aside * (1 - 1e-9), along}));
      EXPECT_FALSE(world.ray_hits({start + aside * (1 + 1e-9), along}));
    }
}

TEST(RayCast, ThroughSharedEdgesAndCornersOfASurfaceNeverSlipsThrough) {
  QueryRandom random(2);
  World mesh_world, field_world;
  const auto mesh = wavy_mesh(16, 8);
  mesh_world.add_body({.type = BodyType::fixed, .shapes = {TriangleMesh{mesh}}});
  field_world.add_body({.type = BodyType::fixed, .shapes = {wavy_field(16, 8)}});
  for (int i = 0; i < 3000; ++i) {
    const auto& t = mesh->triangles[random.below(512)];
    const double u = i % 3 == 0 ? 0 : random.uniform(0, 1);
    Vec3 target = mesh->vertices[t[0]] * (1 - u) + mesh->vertices[t[1]] * u;
    if (target.x() < 0.1 || target.x() > 7.9 || target.z() < 0.1 || target.z() > 7.9) continue;
    const Vec3 from = target + Vec3{random.uniform(-2, 2), 5, random.uniform(-2, 2)};
    EXPECT_TRUE(mesh_world.ray_hits({from, 2 * (target - from)})) << i;
    EXPECT_TRUE(field_world.ray_hits({from, 2 * (target - from)})) << i;
  }
}

TEST(RayCast, OfAMeshIsTheNearestOfAllTriangles) {
  QueryRandom random(3);
  const auto mesh = wavy_mesh(20, 8);
  const Pose pose = random.pose(2);
  World world, field_world;
  world.add_body({.type = BodyType::fixed,
                  .shapes = {TriangleMesh{mesh}},
                  .position = pose.position,
                  .orientation = pose.orientation});
  field_world.add_body({.type = BodyType::fixed,
                        .shapes = {wavy_field(20, 8)},
                        .position = pose.position,
                        .orientation = pose.orientation});
  std::vector<Vec3> placed;
  for (const Vec3& v : mesh->vertices) placed.push_back(pose.orientation * v + pose.position);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const RayCast ray{random.vector(9), random.vector(16)};
    double best = 2;
    for (const auto& t : mesh->triangles) {
      const double at =
          ray_triangle(placed[t[0]], placed[t[1]], placed[t[2]], ray.origin, ray.translation);
      if (at >= 0) best = std::min(best, at);
    }
    for (const World* w : {&world, &field_world}) {
      const auto hit = w->ray_cast(ray);
      ASSERT_EQ(hit.has_value(), best <= 1) << i;
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->fraction, best, 1e-9);
      ASSERT_LT(hit->triangle, mesh->triangles.size());
      const auto& t = mesh->triangles[hit->triangle];
      EXPECT_LT((nearest_on_triangle(placed[t[0]], placed[t[1]], placed[t[2]], hit->position) -
                 hit->position)
                    .norm(),
                1e-9);
      EXPECT_LE(hit->normal.dot(ray.translation), 0);
    }
  }
  EXPECT_GT(hits, 100);
}

TEST(RayCast, NamesTrianglesAsTheUserCountsThemAndSeesBacksOnlyIfAsked) {
  auto mesh = std::make_shared<MeshData>();
  mesh->vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 0, 1}};
  mesh->triangles = {{0, 0, 1}, {0, 1, 2}, {1, 1, 1}, {2, 1, 3}};  // two without area
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {TriangleMesh{mesh}}});
  const RayCast down{{0.9, 1, 0.9}, {0, -2, 0}}, up{{0.2, -1, 0.2}, {0, 2, 0}};
  ASSERT_TRUE(world.ray_cast(down));
  EXPECT_EQ(world.ray_cast(down)->triangle, 3u);
  ASSERT_TRUE(world.ray_cast(up));
  EXPECT_EQ(world.ray_cast(up)->triangle, 1u);
  EXPECT_EQ(world.ray_cast(up)->normal, Vec3(0, -1, 0));
  EXPECT_FALSE(world.ray_cast(up, {.back_faces = false}));
  EXPECT_TRUE(world.ray_cast(down, {.back_faces = false}));
}

// Every body alone in a world of its own gives what the tree must find.
TEST(RayCast, InAFullWorldFindsWhatEachBodyGivesAlone) {
  constexpr double kSize = 8;
  for (const Vec3& middle : {Vec3(0, 0, 0), Vec3(1e6, -2e6, 3e6)}) {
    QueryRandom random(4);
    World world = random_world(random, 120, kSize, middle);
    std::size_t hits = 0;
    for (int i = 0; i < 300; ++i) {
      const RayCast ray{middle + random.vector(1.3 * kSize), random.vector(2 * kSize)};
      const std::vector<CastHit> all = world.ray_cast_all(ray);
      std::vector<CastHit> single;
      for (const BodyId body : world.bodies())
        for (const CastHit& hit : world.ray_cast_all(
                 ray, {.accept = [&](BodyId b, std::uint32_t) { return b == body; }}))
          single.push_back(hit);
      ASSERT_EQ(all.size(), single.size());
      hits += all.size();
      for (std::size_t k = 1; k < all.size(); ++k) EXPECT_LE(all[k - 1].fraction, all[k].fraction);
      const auto first = world.ray_cast(ray);
      ASSERT_EQ(first.has_value(), !all.empty());
      EXPECT_TRUE(!first || same(*first, all[0]));
      EXPECT_EQ(world.ray_hits(ray), !all.empty());
    }
    EXPECT_GT(hits, 100u);
  }
}

TEST(RayCast, FarFromTheOriginIsAsExactAsAtIt) {
  QueryRandom random(5);
  const Vec3 far(1e6, 1e6, -1e6);
  for (int i = 0; i < 350; ++i) {
    Solid solid{random_convex(random, i % kConvexKinds), random.pose(1)};
    const World near_world = world_with(solid);
    RayCast ray{random.vector(3), Vec3::Zero()};
    ray.translation = 2 * (solid.pose.position + random.vector(0.7) - ray.origin);
    const auto near_hit = near_world.ray_cast(ray);
    solid.pose.position += far;
    ray.origin += far;
    const auto far_hit = world_with(solid).ray_cast(ray);
    if (!near_hit || near_hit->initial_overlap) continue;
    if (near_hit->normal.dot(ray.translation.normalized()) > -0.01) continue;  // grazing
    ASSERT_TRUE(far_hit) << i;
    EXPECT_NEAR(far_hit->fraction, near_hit->fraction, 1e-7);
    EXPECT_LT((far_hit->normal - near_hit->normal).norm(), 1e-4);
  }
}

TEST(RayCast, HonoursFiltersSensorsIgnoredBodiesAndThePredicate) {
  World world;
  const auto add = [&](double x, ShapeOptions options) {
    return world.add_body({.type = BodyType::fixed,
                           .shapes = {Shape(Sphere{0.5}, std::move(options))},
                           .position = {x, 0, 0}});
  };
  const BodyId sensor = add(2, {.sensor = true});
  const BodyId grouped = add(4, {.filter = {.category = 2, .mask = 4, .group = -3}});
  const BodyId plain = add(6, {});
  const RayCast ray{{0, 0, 0}, {10, 0, 0}};
  const auto first = [&](const QueryFilter& filter) {
    const auto hit = world.ray_cast(ray, filter);
    return hit ? hit->body : BodyId{};
  };
  EXPECT_EQ(first({}), grouped);
  EXPECT_EQ(first({.sensors = true}), sensor);
  EXPECT_EQ(first({.filter = {.category = 1}}), plain);  // not in the second's mask
  EXPECT_EQ(first({.filter = {.category = 4, .mask = 1}}), plain);
  EXPECT_EQ(first({.filter = {.group = -3}}), plain);
  EXPECT_EQ(first({.filter = {.category = 0, .mask = 0, .group = -3}}), BodyId{});
  EXPECT_EQ(first({.ignore = {grouped, BodyId{77, 3}}}), plain);
  EXPECT_EQ(first({.ignore = {grouped, plain}}), BodyId{});
  EXPECT_EQ(first({.accept = [&](BodyId b, std::uint32_t) { return b != grouped; }}), plain);
  EXPECT_THROW(first({.accept = [](BodyId, std::uint32_t) -> bool { throw 7; }}), int);
  EXPECT_EQ(first({}), grouped);
}

TEST(Queries, RefuseBadInputWithItsName) {
  World world;
  const BodyId ball = world.add_body({.shapes = {Sphere{}}});
  const auto field_of = [](const auto& call) {
    try {
      call();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(error.field()), std::string::npos);
      return error.field();
    }
    return std::string("accepted");
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const Vec3 down(0, -1, 0);
  EXPECT_EQ(field_of([&] { world.ray_cast({{0, 0, 0}, {0, 0, 0}}); }), "translation");
  EXPECT_EQ(field_of([&] { world.ray_cast({{0, kNan, 0}, down}); }), "origin");
  EXPECT_EQ(field_of([&] { world.ray_hits({{0, 0, 0}, {0, kInf, 0}}); }), "translation");
  EXPECT_EQ(field_of([&] { world.ray_cast_all({{1e16, 0, 0}, down}); }), "origin");
  EXPECT_EQ(field_of([&] { world.shape_cast({Sphere{}, {}, Vec3::Zero()}); }), "translation");
  EXPECT_EQ(field_of([&] {
              world.shape_cast({Sphere{}, {{0, 0, 0}, Quat(2, 0, 0, 0)}, down});
            }),
            "pose.orientation");
  EXPECT_EQ(field_of([&] { world.shape_cast({Sphere{-1}, {}, down}); }), "shape.radius");
  EXPECT_EQ(field_of([&] { QueryShape shape(Plane{}); }), "shape");
  EXPECT_EQ(field_of([&] { QueryShape shape{HeightField{}}; }), "shape");
  EXPECT_EQ(field_of([&] {
              QueryShape shape(ConvexHull{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}});
            }),
            "shape.points");
  EXPECT_EQ(field_of([&] { world.closest({0, 0, 0}, -1); }), "max_distance");
  EXPECT_EQ(field_of([&] { world.closest({kInf, 0, 0}, 1); }), "point");
  const std::vector<RayCast> rays = {{{0, 5, 0}, down}, {{0, 0, 0}, {0, 0, 0}}};
  EXPECT_EQ(field_of([&] { world.ray_cast_batch(rays); }), "rays[1].translation");
  const std::vector<PlacedShape> places = {{Sphere{}, {}}, {Sphere{}, {{0, kNan, 0}}}};
  EXPECT_EQ(field_of([&] { world.overlap_batch(places); }), "shapes[1].pose.position");
  EXPECT_EQ(field_of([&] { world.closest_batch(places, 1); }), "shapes[1].pose.position");
  const std::vector<Vec3> points = {{0, 0, 0}, {0, 0, kInf}};
  EXPECT_EQ(field_of([&] { world.closest_batch(points, 1); }), "points[1]");
  EXPECT_THROW(world.distance(ball, BodyId{9, 9}), UsageError);
  EXPECT_THROW(QueryView().ray_cast({{0, 0, 0}, down}), UsageError);
}

// At the touch a plane parts the two, and they share a point: nothing can have been nearer before.
TEST(ShapeCast, OfEveryPairOfConvexShapesStopsWhereTheyTouch) {
  QueryRandom random(6);
  int hits = 0;
  for (int i = 0; i < 49 * 30; ++i) {
    const Solid target{random_convex(random, i % kConvexKinds), random.pose(0.5)};
    const ShapeGeometry mover = random_convex(random, i / kConvexKinds % kConvexKinds);
    Pose pose = random.pose(1);
    pose.position = pose.position.normalized() * random.uniform(3, 6);
    const double fraction = random.uniform(0.5, 2.5);
    const Vec3 translation = fraction * (target.pose.position + random.vector(1) - pose.position);
    const World world = world_with(target);
    const QueryShape shape(std::visit([](const auto& g) { return Shape(g); }, mover));
    const auto hit = world.shape_cast({shape, pose, translation});
    const Solid moving{mover, pose};
    if (!hit) {
      for (int k = 0; k <= 40; ++k) {
        Pose there = pose;
        there.position += translation * (k / 40.0);
        const auto apart = world.closest(shape, there, 1e3);
        ASSERT_TRUE(apart && apart->distance > 0) << i;
      }
      continue;
    }
    ++hits;
    EXPECT_NEAR(hit->normal.norm(), 1, 1e-12);
    if (hit->initial_overlap) {
      EXPECT_EQ(world.overlap(shape, pose).size(), 1u) << i;
      continue;
    }
    EXPECT_LT(hit->normal.dot(translation), 0) << i;
    const Vec3 shift = hit->fraction * translation;
    EXPECT_NEAR(plane_gap(moving, shift, target, -hit->normal), 0, 1e-5) << i;
    EXPECT_TRUE(target.contains(hit->position, 1e-5)) << i;
    EXPECT_TRUE(moving.contains(hit->position - shift, 1e-5)) << i;
  }
  EXPECT_GT(hits, 600);
}

TEST(ShapeCast, AgainstSurfacesIsTheFirstTouchOfAllTriangles) {
  QueryRandom random(7);
  const auto mesh = wavy_mesh(10, 6);
  World world, field_world;
  world.add_body({.type = BodyType::fixed, .shapes = {TriangleMesh{mesh}}});
  field_world.add_body({.type = BodyType::fixed, .shapes = {wavy_field(10, 6)}});
  int hits = 0;
  for (int i = 0; i < 210; ++i) {
    const ShapeGeometry mover = random_convex(random, i % kConvexKinds);
    const QueryShape shape(std::visit([](const auto& g) { return Shape(g); }, mover));
    const Pose pose{Vec3(3, 4, 3) + random.vector(2), random.rotation()};
    const Vec3 translation{random.uniform(-3, 3), -6, random.uniform(-3, 3)};
    const auto hit = world.shape_cast({shape, pose, translation});
    const auto other = field_world.shape_cast({shape, pose, translation});
    ASSERT_EQ(hit.has_value(), other.has_value());
    if (!hit) continue;
    ++hits;
    EXPECT_NEAR(hit->fraction, other->fraction, 1e-9);
    // There it touches the triangle it names, and no triangle is cut.
    Pose there = pose;
    there.position += hit->fraction * translation;
    const auto nearest = world.closest(shape, there, 10);
    ASSERT_TRUE(nearest);
    EXPECT_LT(nearest->distance, 1e-5);
    there.position -= 1e-4 * translation;
    if (hit->initial_overlap) continue;
    EXPECT_TRUE(world.overlap(shape, there).empty());
    const auto& t = mesh->triangles[hit->triangle];
    const auto& v = mesh->vertices;
    const Vec3 nearest_point = nearest_on_triangle(v[t[0]], v[t[1]], v[t[2]], hit->position);
    EXPECT_LT((nearest_point - hit->position).norm(), 1e-5);
  }
  EXPECT_GT(hits, 100);
}

TEST(ShapeCast, OfASphereOntoAPlaneAndABoxStopsARadiusBefore) {
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
  auto hit = world.shape_cast({Sphere{0.5}, {{0, 10.5, 0}, Quat::Identity()}, {0, -20, 0}});
  ASSERT_TRUE(hit);
  EXPECT_DOUBLE_EQ(hit->fraction, 0.5);
  EXPECT_EQ(hit->position, Vec3(0, 0, 0));
  EXPECT_EQ(hit->normal, Vec3(0, 1, 0));
  World boxes;
  boxes.add_body({.type = BodyType::fixed, .shapes = {Box{{1, 1, 1}}}});
  hit = boxes.shape_cast({Sphere{0.5}, {{11.5, 0, 0}, Quat::Identity()}, {-20, 0, 0}});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->fraction, 0.5, 1e-9);
  EXPECT_LT((hit->normal - Vec3(1, 0, 0)).norm(), 1e-9);
  // In touch already, or overlapping: at once, against the motion.
  hit = boxes.shape_cast({Sphere{0.5}, {{1.2, 0, 0}, Quat::Identity()}, {3, 4, 0}});
  ASSERT_TRUE(hit);
  EXPECT_TRUE(hit->initial_overlap);
  EXPECT_EQ(hit->fraction, 0);
  EXPECT_LT((hit->normal - Vec3(-0.6, -0.8, 0)).norm(), 1e-12);
}

TEST(ShapeCast, UsesTheLocalPoseOfItsShape) {
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
  const QueryShape offset(Shape(Sphere{0.5}, {.local_pose = {{0, -2, 0}, Quat::Identity()}}));
  const auto hit = world.shape_cast({offset, {{0, 10.5, 0}, Quat::Identity()}, {0, -16, 0}});
  ASSERT_TRUE(hit);
  EXPECT_DOUBLE_EQ(hit->fraction, 0.5);
}

}  // namespace
}  // namespace skerry::test
