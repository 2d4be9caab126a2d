// Every pair of convex shapes against an oracle that sweeps directions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "core/vec.h"
#include "tests/collision/narrowphase_fixture.h"
#include "tests/collision/narrowphase_oracle.h"
#include "tests/support/rounds.h"

namespace skerry::test {
namespace {

double radius(Random& random) { return random.uniform(0.15, 0.8); }

ShapeGeometry random_shape(const std::string& name, Random& random) {
  if (name == "sphere") return Sphere{.radius = radius(random)};
  if (name == "capsule") return Capsule{.radius = radius(random), .half_height = radius(random)};
  if (name == "box") return Box{.half_extents = {radius(random), radius(random), radius(random)}};
  if (name == "cylinder") return Cylinder{.radius = radius(random), .half_height = radius(random)};
  if (name == "cone") return Cone{.radius = radius(random), .half_height = radius(random)};
  if (name == "ellipsoid")
    return Ellipsoid{.semi_axes = {radius(random), radius(random), radius(random)}};
  ConvexHull hull;
  const int count = static_cast<int>(random.uniform(6, 20));
  for (int i = 0; i < count; ++i) {
    const double length = radius(random);
    hull.points.push_back(length * random.unit());
  }
  // The origin well inside.
  for (int i = 0; i < 3; ++i)
    for (const double sign : {-0.3, 0.3}) hull.points.push_back(sign * Vec3::Unit(i));
  return hull;
}

double size(const ShapeGeometry& shape) {
  double least = 1e9;
  for (int i = 0; i < 3; ++i)
    for (const double sign : {-1.0, 1.0})
      least = std::min(least, std::abs(support(shape, {}, sign * Vec3::Unit(i))[i]));
  return least;
}

// The diagonal of its bounds.
double width(const ShapeGeometry& shape) {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < 3; ++i)
    for (const double sign : {-1.0, 1.0})
      sum[i] += std::abs(support(shape, {}, sign * Vec3::Unit(i))[i]);
  return sum.norm();
}

bool is_polytope(const ShapeGeometry& shape) {
  return std::holds_alternative<Box>(shape) || std::holds_alternative<ConvexHull>(shape);
}

using Names = std::pair<const char*, const char*>;

class NarrowphaseConvexPair : public testing::TestWithParam<Names> {
 protected:
  void place(Random& random, int i) {
    pose_a_ = random.pose(2);
    pose_b_ = at(pose_a_.position, pose_a_.orientation * random.resting_rotation());
    const Vec3 n = i % 2 == 0 ? Vec3(pose_a_.orientation * Vec3::Unit(i / 2 % 3)) : random.unit();
    constexpr double kGaps[] = {0.003, 0, -0.002, -0.03, -0.2};
    pose_b_.position += (kGaps[i % 5] - gap_along(a_, pose_a_, b_, pose_b_, n)) * n;
  }
  void collide() {
    scene_.set_pose(0, pose_a_);
    scene_.set_pose(1, pose_b_);
    scene_.contact().cache = 0;
    scene_.contact().manifold_count = 0;
    scene_.collide();
  }
  void draw_shapes(Random& random) {
    a_ = random_shape(GetParam().first, random);
    b_ = random_shape(GetParam().second, random);
    scene_ = PairScene();
    scene_.add(a_, {});
    scene_.add(b_, {});
    scene_.pair(0, 1);
  }
  // By how much, in m, the contact misses the best depth or its own normal's, if that is more than
  // the tolerance; else 0.
  double missed_by(const Sweep& best);
  // `shapes` random pairs of shapes, in `poses` each.
  void expect_best_depths(std::uint64_t seed, int shapes, int poses);

  ShapeGeometry a_ = Sphere{}, b_ = Sphere{};
  Pose pose_a_, pose_b_;
  PairScene scene_;
};

double NarrowphaseConvexPair::missed_by(const Sweep& best) {
  // The sweep itself stops a little short of sharp maxima.
  if (scene_.contact().manifold_count == 0) return best.separation > -2e-4 ? 0 : -best.separation;
  const Vec3 normal = core::to_double(scene_.manifold().normal);
  EXPECT_NEAR(normal.norm(), 1, 1e-5);
  // Faces are preferred to edges that are better by no more than about this.
  const double tolerance =
      0.01 * std::abs(best.separation) + 2e-3 * std::min(size(a_), size(b_)) + 1e-5;
  // Where corners of polytopes come near each other, the best axis of faces and edges falls short of
  // their distance.
  const bool corners = best.separation > 0 && is_polytope(a_) && is_polytope(b_);
  const double short_by = corners ? std::max(tolerance, 0.25 * best.separation) : tolerance;
  const double along = gap_along(a_, pose_a_, b_, pose_b_, normal);
  const double deepest = double(scene_.deepest());
  if (!(best.separation - along < short_by)) return best.separation - along;
  if (!(along - deepest < tolerance)) return along - deepest;
  // Only where the shapes overlap clearly must a point tell of the depth. Of all that are as deep, up to a
  // thousandth of the patch's width, the four points that span it best are chosen.
  const double choice = 1e-3 * std::min(width(a_), width(b_));
  const bool overlap = best.separation < -2 * tolerance;
  return overlap && deepest >= along + tolerance + choice ? deepest - along : 0;
}

void NarrowphaseConvexPair::expect_best_depths(std::uint64_t seed, int shapes, int poses) {
  Random random(seed);
  int contacts = 0, overlaps = 0, misses = 0;
  double worst = 0;
  std::string told;
  for (int shape = 0; shape < shapes; ++shape) {
    draw_shapes(random);
    for (int i = 0; i < poses; ++i) {
      place(random, i);
      collide();
      Sweep best = sweep(a_, pose_a_, b_, pose_b_);
      overlaps += best.separation < 0;
      contacts += scene_.contact().manifold_count != 0;
      if (missed_by(best) > 0) best = sweep(a_, pose_a_, b_, pose_b_, 100);
      const double missed = missed_by(best);
      if (missed <= 0) continue;
      ++misses;
      worst = std::max(worst, missed);
      if (misses <= 50)
        told += "shapes " + std::to_string(shape) + " pose " + std::to_string(i) + ": best " +
                std::to_string(1e3 * best.separation) + " mm, missed by " +
                std::to_string(1e3 * missed) + " mm\n";
    }
  }
  EXPECT_GT(contacts, overlaps * 0.95);
  EXPECT_GT(overlaps, shapes * poses / 10);
  EXPECT_EQ(misses, 0) << told;
  RecordProperty("pairs", shapes * poses);
  RecordProperty("misses", misses);
  RecordProperty("worst_mm", std::to_string(1e3 * worst));
}

TEST_P(NarrowphaseConvexPair, depth_and_normal_are_the_best_of_all_directions) {
  expect_best_depths(7, rounds(20), 100);
}
// A hundred pairs per drawing of shapes: SKERRY_TEST_ORACLE_SHAPES=1000 asks for a hundred thousand
// of every kind, which takes minutes each.
TEST_P(NarrowphaseConvexPair, depth_and_normal_of_many_more_pairs_stress) {
  const char* given = std::getenv("SKERRY_TEST_ORACLE_SHAPES");
  const int shapes = given ? std::atoi(given) : 10;
  expect_best_depths(77, shapes, 100);
}

TEST_P(NarrowphaseConvexPair, swapping_the_two_mirrors_the_contact) {
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    a_ = random_shape(GetParam().first, random);
    b_ = random_shape(GetParam().second, random);
    place(random, i);
    float deepest[2];
    std::uint32_t count[2];
    Vec3 normal[2];
    for (const int order : {0, 1}) {
      PairScene scene;
      scene.add(order == 0 ? a_ : b_, order == 0 ? pose_a_ : pose_b_);
      scene.add(order == 0 ? b_ : a_, order == 0 ? pose_b_ : pose_a_);
      scene.pair(0, 1);
      scene.collide();
      count[order] = scene.contact().manifold_count;
      deepest[order] = scene.deepest();
      normal[order] = core::to_double(scene.manifold().normal);
    }
    if (count[0] != count[1]) continue;  // at the edge of the speculative distance
    if (count[0] == 0) continue;
    const double tolerance =
        2e-3 * std::min(size(a_), size(b_)) + 0.02 * std::abs(double(deepest[0]));
    ASSERT_NEAR(double(deepest[0]), double(deepest[1]), tolerance) << "pair " << i;
    // Either normal is as good along the other's direction.
    const double along = gap_along(a_, pose_a_, b_, pose_b_, -normal[1]);
    ASSERT_NEAR(gap_along(a_, pose_a_, b_, pose_b_, normal[0]), along, tolerance) << "pair " << i;
  }
}

std::vector<Names> all_pairs() {
  const char* names[] = {"sphere", "capsule", "box", "cylinder", "cone", "ellipsoid", "hull"};
  std::vector<Names> pairs;
  for (int i = 0; i < 7; ++i)
    for (int j = i; j < 7; ++j)
      if (i != 2 || j != 2) pairs.emplace_back(names[i], names[j]);
  return pairs;
}

INSTANTIATE_TEST_SUITE_P(All, NarrowphaseConvexPair, testing::ValuesIn(all_pairs()),
                         [](const auto& pair) {
                           return std::string(pair.param.first) + "_" + pair.param.second;
                         });

}  // namespace
}  // namespace skerry::test
