// Pairs that broke others: near-touching, deep, degenerate, huge beside tiny. Whatever they are, the
// kernels end, normals are unit, depths finite; and what FCL can be trusted with agrees.
#include <fcl/narrowphase/collision.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/vec.h"
#include "tests/collision/narrowphase_fixture.h"
#include "tests/collision/narrowphase_oracle.h"
#include "tests/collision/query_random.h"

namespace skerry::test {
namespace {

constexpr int kKinds = kConvexKinds + 3;  // and plane, mesh, height field

// Near 1 m across; scaled for the extremes.
ShapeGeometry shape_of_kind(QueryRandom& random, int kind, double scale) {
  if (kind == kConvexKinds) return Plane{.normal = random.rotation() * Vec3::UnitY(), .offset = 0};
  if (kind == kConvexKinds + 1)
    return TriangleMesh{.data = wavy_mesh(6, 2), .scale = scale * Vec3::Ones()};
  if (kind == kConvexKinds + 2) {
    HeightField field = wavy_field(6, 2);
    field.scale *= scale;
    return field;
  }
  ShapeGeometry shape = random_convex(random, kind);
  struct Scale {
    double by;
    void operator()(Sphere& s) const { s.radius *= by; }
    void operator()(Capsule& s) const { s.radius *= by, s.half_height *= by; }
    void operator()(Box& s) const { s.half_extents *= by; }
    void operator()(Cylinder& s) const { s.radius *= by, s.half_height *= by; }
    void operator()(Cone& s) const { s.radius *= by, s.half_height *= by; }
    void operator()(Ellipsoid& s) const { s.semi_axes *= by; }
    void operator()(ConvexHull& s) const {
      for (Vec3& point : s.points) point *= by;
    }
    void operator()(Plane&) const {}
    void operator()(TriangleMesh&) const {}
    void operator()(HeightField&) const {}
  };
  std::visit(Scale{scale}, shape);
  return shape;
}

// Number of points; fails on anything that no contact may be.
int expect_sound(PairScene& scene, const std::string& what) {
  int points = 0;
  const core::ContactPair& pair = scene.contact();
  EXPECT_LE(pair.manifold_count, pair.manifold_capacity) << what;
  for (std::uint32_t m = 0; m < pair.manifold_count; ++m) {
    const core::Manifold& manifold = scene.manifold(0, m);
    EXPECT_NEAR(double(core::length(manifold.normal)), 1, 1e-4) << what;
    EXPECT_GE(manifold.point_count, 1u) << what;
    EXPECT_LE(manifold.point_count, 4u) << what;
    for (std::uint32_t i = 0; i < manifold.point_count; ++i, ++points) {
      const core::ManifoldPoint& point = manifold.points[i];
      EXPECT_TRUE(std::isfinite(point.separation)) << what;
      EXPECT_TRUE(std::isfinite(core::length(point.position))) << what;
    }
  }
  return points;
}

struct Pair {
  ShapeGeometry a = Sphere{}, b = Sphere{};
  Pose pose_a, pose_b;

  // Depth of the deepest point, or 1e30 if there is none.
  double collide(const std::string& what, bool swapped = false) const {
    PairScene scene;
    scene.add(swapped ? b : a, swapped ? pose_b : pose_a);
    scene.add(swapped ? a : b, swapped ? pose_a : pose_b);
    scene.pair(0, 1);
    scene.collide();
    expect_sound(scene, what);
    return double(scene.deepest());
  }
};

bool is_convex(int kind) { return kind < kConvexKinds; }

TEST(HardPairs, of_all_kinds_give_unit_normals_and_finite_depths) {
  QueryRandom random(31);
  int contacts = 0, pairs = 0;
  for (int ka = 0; ka < kKinds; ++ka)
    for (int kb = 0; kb < kKinds; ++kb)
      for (int i = 0; i < 30; ++i) {
        Pair pair;
        pair.a = shape_of_kind(random, ka, 1);
        pair.b = shape_of_kind(random, kb, 1);
        pair.pose_a = random.pose(3);
        pair.pose_b = {pair.pose_a.position, i % 2 ? pair.pose_a.orientation : random.rotation()};
        const Vec3 n = (random.rotation() * Vec3::UnitX()).normalized();
        // Touching to rounding, near, deep, and in one place.
        constexpr double kGaps[] = {0, 1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-2, -0.3};
        if (i % 9 < 8 && is_convex(ka) && is_convex(kb))
          pair.pose_b.position +=
              (kGaps[i % 9] - gap_along(pair.a, pair.pose_a, pair.b, pair.pose_b, n)) * n;
        else if (i % 9 < 8)
          pair.pose_b.position += 0.4 * (i % 9) * n;
        contacts += pair.collide("kinds " + std::to_string(ka) + " " + std::to_string(kb) + " #" +
                                 std::to_string(i)) < 1e29;
        ++pairs;
      }
  EXPECT_GT(contacts, pairs / 3);
}

TEST(HardPairs, of_huge_beside_tiny_shapes_give_unit_normals_and_finite_depths) {
  QueryRandom random(32);
  int contacts = 0;
  for (int ka = 0; ka < kKinds; ++ka)
    for (int kb = 0; kb < kKinds; ++kb)
      for (const double small : {1e-3, 1e-2, 1.0})
        for (int i = 0; i < 4; ++i) {
          Pair pair;
          pair.a = shape_of_kind(random, ka, 1e3);
          pair.b = shape_of_kind(random, kb, small);
          pair.pose_a = random.pose(1e4);
          pair.pose_b = {pair.pose_a.position, random.rotation()};
          const Vec3 n = random.rotation() * Vec3::UnitX();
          if (is_convex(ka) && is_convex(kb))
            pair.pose_b.position +=
                (-0.3 * small * i - gap_along(pair.a, pair.pose_a, pair.b, pair.pose_b, n)) * n;
          contacts += pair.collide("kinds " + std::to_string(ka) + " " + std::to_string(kb) +
                                   " small " + std::to_string(small)) < 1e29;
        }
  EXPECT_GT(contacts, 300);
}

TEST(HardPairs, of_needles_plates_and_coins_give_unit_normals_and_finite_depths) {
  QueryRandom random(33);
  const auto thin = [&](int kind) -> ShapeGeometry {
    switch (kind % 6) {
      case 0:
        return Box{.half_extents = {1e-4, 1, 1}};
      case 1:
        return Box{.half_extents = {1e-4, 1e-4, 2}};
      case 2:
        return Cylinder{.radius = 1, .half_height = 1e-4};
      case 3:
        return Capsule{.radius = 1e-4, .half_height = 3};
      case 4:
        return Ellipsoid{.semi_axes = {1e-3, 1, 2}};
      default:
        return ConvexHull{.points = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0.5, 0.5, 1e-3}}};
    }
  };
  int contacts = 0;
  for (int i = 0; i < 1500; ++i) {
    Pair pair;
    pair.a = thin(i);
    pair.b = thin(i / 6);
    pair.pose_a = random.pose(1);
    pair.pose_b = {pair.pose_a.position + random.vector(0.3),
                   i % 3 ? random.rotation() : pair.pose_a.orientation};
    contacts += pair.collide("#" + std::to_string(i)) < 1e29;
  }
  EXPECT_GT(contacts, 100);
}

TEST(HardPairs, with_surfaces_are_as_deep_the_other_way_round) {
  QueryRandom random(34);
  int compared = 0;
  for (int surface = kConvexKinds; surface < kKinds; ++surface)
    for (int kind = 0; kind < kConvexKinds; ++kind)
      for (int i = 0; i < 60; ++i) {
        Pair pair;
        pair.a = shape_of_kind(random, kind, 1);
        pair.b = shape_of_kind(random, surface, 1);
        pair.pose_b = random.pose(1);
        pair.pose_a = {pair.pose_b.position + pair.pose_b.orientation * random.vector(0.8),
                       random.rotation()};
        const std::string what = "surface " + std::to_string(surface) + " kind " +
                                 std::to_string(kind) + " #" + std::to_string(i);
        const double there = pair.collide(what), back = pair.collide(what, true);
        if (there > 1e29 || back > 1e29) {
          // One may lie just within the speculative distance.
          EXPECT_TRUE(std::min(there, back) > 1e29 || std::min(there, back) > 0.0049) << what;
          continue;
        }
        EXPECT_NEAR(there, back, 1e-4 + 0.01 * std::abs(there)) << what;
        ++compared;
      }
  EXPECT_GT(compared, 300);
}

TEST(HardPairs, of_which_fcl_knows_whether_they_overlap_do) {
  QueryRandom random(35);
  const auto object = [](const ShapeGeometry& shape, const Pose& pose) {
    fcl::Transform3d place = fcl::Transform3d::Identity();
    // FCL's round shapes stand along z.
    const bool upright = !std::holds_alternative<Box>(shape);
    const Quat stand = upright ? turned(-std::numbers::pi / 2, Vec3::UnitX()) : Quat(1, 0, 0, 0);
    place.linear() = (pose.orientation * stand).toRotationMatrix();
    place.translation() = pose.position;
    std::shared_ptr<fcl::CollisionGeometryd> geometry;
    if (const auto* s = std::get_if<Sphere>(&shape))
      geometry = std::make_shared<fcl::Sphered>(s->radius);
    else if (const auto* c = std::get_if<Capsule>(&shape))
      geometry = std::make_shared<fcl::Capsuled>(c->radius, 2 * c->half_height);
    else if (const auto* y = std::get_if<Cylinder>(&shape))
      geometry = std::make_shared<fcl::Cylinderd>(y->radius, 2 * y->half_height);
    else if (const auto* k = std::get_if<Cone>(&shape))
      geometry = std::make_shared<fcl::Coned>(k->radius, 2 * k->half_height);
    else {
      const Vec3 size = 2 * std::get<Box>(shape).half_extents;
      geometry = std::make_shared<fcl::Boxd>(size.x(), size.y(), size.z());
    }
    return fcl::CollisionObjectd(geometry, place);
  };
  int overlaps = 0, apart = 0;
  for (int i = 0; i < 4000; ++i) {
    Pair pair;
    pair.a = random_convex(random, i % 5);
    pair.b = random_convex(random, i / 5 % 5);
    const auto known = [](const ShapeGeometry& s) {
      return !std::holds_alternative<Ellipsoid>(s) && !std::holds_alternative<ConvexHull>(s);
    };
    if (!known(pair.a) || !known(pair.b)) continue;
    pair.pose_a = random.pose(1);
    pair.pose_b = {pair.pose_a.position + random.vector(1.5), random.rotation()};
    const fcl::CollisionObjectd a = object(pair.a, pair.pose_a), b = object(pair.b, pair.pose_b);
    fcl::CollisionResultd result;
    const bool overlap = fcl::collide(&a, &b, fcl::CollisionRequestd{}, result) > 0;
    const double deepest = pair.collide("#" + std::to_string(i));
    if (overlap) {
      EXPECT_LT(deepest, 1e-4) << "pair " << i;
      ++overlaps;
    } else {
      EXPECT_GT(deepest, -1e-4) << "pair " << i;
      ++apart;
    }
  }
  EXPECT_GT(overlaps, 500);
  EXPECT_GT(apart, 500);
}

}  // namespace
}  // namespace skerry::test
