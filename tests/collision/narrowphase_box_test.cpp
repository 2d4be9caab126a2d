// Box against box: the separating-axis kernel at every width, and its manifolds.
#include <gtest/gtest.h>
#include <cmath>

#include <cstring>
#include <set>

#include "collision/box_batch.h"
#include "core/vec.h"
#include "tests/collision/instruction_sets.h"
#include "tests/collision/narrowphase_fixture.h"
#include "tests/collision/narrowphase_oracle.h"
#include "tests/support/rounds.h"

namespace skerry::test {
namespace {

using collision::BoxBatch;

struct BoxPair {
  Box a, b;
  Pose pose_a, pose_b;
};

Box random_box(Random& random) {
  return {.half_extents = {random.uniform(0.1, 1), random.uniform(0.1, 1), random.uniform(0.1, 1)}};
}

// b's centre is put along a random direction so that the gap along it is what is wanted: by turns
// about to touch, touching, shallow, deep.
BoxPair random_pair(Random& random, int kind) {
  BoxPair pair{random_box(random), random_box(random), random.pose(2), {}};
  pair.pose_b = at(pair.pose_a.position, pair.pose_a.orientation * random.resting_rotation());
  if (kind % 3 == 0) pair.b.half_extents = pair.a.half_extents;
  const Vec3 n = kind % 2 == 0 ? Vec3(pair.pose_a.orientation * Vec3::UnitY()) : random.unit();
  constexpr double kGaps[] = {0.004, 0, -0.002, -0.05, -0.4};
  const double gap = gap_along(pair.a, pair.pose_a, pair.b, pair.pose_b, n);
  pair.pose_b.position += (kGaps[kind % 5] - gap) * n;
  return pair;
}

void put(BoxBatch& batch, int row, int lane, const Vec3& v) {
  for (int i = 0; i < 3; ++i) batch.in[row + i][lane] = static_cast<float>(v[i]);
}
void put(BoxBatch& batch, int row, int lane, const Quat& q) {
  put(batch, row, lane, Vec3(q.x(), q.y(), q.z()));
  batch.in[row + 3][lane] = static_cast<float>(q.w());
}
void put(BoxBatch& batch, int lane, const BoxPair& pair, Random& random) {
  put(batch, BoxBatch::kDx, lane, pair.pose_b.position - pair.pose_a.position);
  put(batch, BoxBatch::kQax, lane, pair.pose_a.orientation);
  put(batch, BoxBatch::kQbx, lane, pair.pose_b.orientation);
  put(batch, BoxBatch::kHax, lane, pair.a.half_extents);
  put(batch, BoxBatch::kHbx, lane, pair.b.half_extents);
  put(batch, BoxBatch::kVx, lane, random.in_box(3));
  put(batch, BoxBatch::kWx, lane, random.in_box(3));
  batch.in[BoxBatch::kDt][lane] = 1 / 60.0f;
  batch.in[BoxBatch::kSlop][lane] = 0.005f;
  batch.in[BoxBatch::kMargin][lane] = static_cast<float>(random.uniform(0, 0.3));
  batch.in[BoxBatch::kKind][lane] = static_cast<float>(static_cast<int>(random.uniform(0, 4)));
}

bool same_results(const BoxBatch& a, const BoxBatch& b, int count) {
  for (int row = 0; row < BoxBatch::kOutCount; ++row)
    if (std::memcmp(a.out[row], b.out[row], sizeof(float) * static_cast<std::size_t>(count)) != 0)
      return false;
  return true;
}

TEST(NarrowphaseBox, every_width_gives_the_bits_of_the_float_reference) {
  Random random(1);
  BoxBatch reference, wide;
  std::set<std::string> tried;
  const int batches = rounds(200000 / BoxBatch::kSize);
  for (int batch = 0; batch < batches; ++batch) {
    for (int lane = 0; lane < BoxBatch::kSize; ++lane)
      put(reference, lane, random_pair(random, batch * BoxBatch::kSize + lane), random);
    std::memcpy(wide.in, reference.in, sizeof wide.in);
    collide_boxes_reference(reference, BoxBatch::kSize);
    on_every_instruction_set([&](const std::string& name) {
      collide_boxes(wide, BoxBatch::kSize);
      tried.insert(name);
      ASSERT_TRUE(same_results(reference, wide, BoxBatch::kSize)) << name << " batch " << batch;
    });
    if (HasFatalFailure()) return;
    collide_boxes(wide, BoxBatch::kSize);
    ASSERT_TRUE(same_results(reference, wide, BoxBatch::kSize)) << "dispatched, batch " << batch;
  }
  RecordProperty("targets", testing::PrintToString(tried));
}

// A crossing of edges within 8 degrees of a face's normal is answered with the face, for its up to
// four points; what that may cost in depth.
double tilt_allowance(const BoxPair& pair, const Vec3& normal) {
  const double cosine =
      std::max((pair.pose_a.orientation.conjugate() * normal).cwiseAbs().maxCoeff(),
               (pair.pose_b.orientation.conjugate() * normal).cwiseAbs().maxCoeff());
  if (cosine < 0.989 || cosine > 1 - 1e-9) return 0;
  return std::sqrt(1 - cosine * cosine) * (pair.a.half_extents.norm() + pair.b.half_extents.norm());
}

TEST(NarrowphaseBox, depth_and_normal_are_the_best_of_fifteen_axes) {
  Random random(2);
  PairScene scene;
  const auto a = scene.add(Box{}, {}), b = scene.add(Box{}, {});
  scene.pair(a, b);
  int contacts = 0;
  const int pairs = rounds(100000);
  for (int i = 0; i < pairs; ++i) {
    const BoxPair pair = random_pair(random, i);
    scene.colliders.rows[a].size = core::to_float(pair.a.half_extents);
    scene.colliders.rows[b].size = core::to_float(pair.b.half_extents);
    scene.set_pose(a, pair.pose_a);
    scene.set_pose(b, pair.pose_b);
    scene.contact().cache = 0;
    scene.collide();
    const Sweep best = sweep(pair.a, pair.pose_a, pair.b, pair.pose_b);
    if (scene.contact().manifold_count == 0) {
      ASSERT_GT(best.separation, -1e-5) << "pair " << i << " overlaps but has no contact";
      continue;
    }
    ++contacts;
    const core::Manifold& manifold = scene.manifold();
    const Vec3 normal = core::to_double(manifold.normal);
    const double size = std::min(pair.a.half_extents.maxCoeff(), pair.b.half_extents.maxCoeff());
    const double tolerance = 0.01 * std::abs(best.separation) + 6e-4 * size + 1e-5;
    ASSERT_NEAR(normal.norm(), 1, 1e-5) << "pair " << i;
    const double along = gap_along(pair.a, pair.pose_a, pair.b, pair.pose_b, normal);
    ASSERT_GT(along, best.separation - tolerance - tilt_allowance(pair, best.normal))
        << "pair " << i;
    ASSERT_GT(scene.deepest(), along - tolerance) << "pair " << i;
    // Boxes that an axis all but parts may have their deepest corner beside the face; and among
    // more than four points the choice is the deepest but for a millimetre per metre.
    if (best.separation < -2 * tolerance) {
      ASSERT_LT(scene.deepest(), along + 2 * tolerance + tilt_allowance(pair, best.normal))
          << "pair " << i;
    }
  }
  EXPECT_GT(contacts, pairs / 5 * 2);
}

TEST(NarrowphaseBox, points_lie_halfway_between_the_surfaces) {
  PairScene scene;
  const auto a = scene.add(Box{}, at({0, 0, 0})), b = scene.add(Box{}, at({0.2, 0.9, 0.1}));
  scene.pair(a, b);
  scene.collide();
  ASSERT_EQ(scene.manifold().point_count, 4u);
  for (const auto& point : scene.manifold().points) {
    EXPECT_NEAR(scene.world(0, point).y(), 0.45, 1e-6);
    EXPECT_NEAR(point.separation, -0.1, 1e-6);
  }
}

// Aligned, yawed, offset and unequal towers under motions of micrometres.
TEST(NarrowphaseBox, stacks_keep_four_points_and_their_features_under_micro_motion) {
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    PairScene scene;
    const double yaw = i % 3 == 0 ? 0 : random.uniform(-3.2, 3.2);
    const double size = i % 2 == 0 ? 0.5 : random.uniform(0.2, 0.8);
    const Vec3 offset = i % 4 == 0 ? Vec3::Zero() : Vec3(random.uniform(-.3, .3), 0, 0);
    const auto a = scene.add(Box{}, {});
    const auto b = scene.add(Box{.half_extents = {size, size, size}}, {});
    scene.pair(a, b);
    std::set<std::uint32_t> first;
    for (int step = 0; step < 50; ++step) {
      const Pose shaken{random.in_box(2e-6) + offset + Vec3(0, 0.5 + size - 0.002, 0),
                        random.small_turn(2e-6) * turned(yaw, {0, 1, 0})};
      scene.set_pose(b, shaken);
      scene.collide();
      ASSERT_EQ(scene.contact().manifold_count, 1) << "stack " << i;
      ASSERT_EQ(scene.manifold().point_count, 4u) << "stack " << i << " yaw " << yaw;
      const auto& feature = scene.manifold().feature;
      const std::set<std::uint32_t> features(std::begin(feature), std::end(feature));
      ASSERT_EQ(features.size(), 4u) << "stack " << i;
      if (step == 0) first = features;
      ASSERT_EQ(features, first) << "stack " << i << " yaw " << yaw << " step " << step;
    }
  }
}

// The sides of boxes that lie nearly along each other cross anywhere along their length. No corner of
// what lies on each other may be lost over such a crossing.
TEST(NarrowphaseBox, nearly_aligned_boxes_are_held_at_all_corners_of_their_overlap) {
  Random random(5);
  const int pairs = rounds(20000);
  for (int i = 0; i < pairs; ++i) {
    const double scale = random.uniform(0.2, 3), yaw = random.uniform(-0.01, 0.01);
    const double dx = i % 3 == 0 ? random.uniform(-1e-3, 1e-3) : random.uniform(-0.4, 0.4);
    const double dz = i % 2 == 0 ? random.uniform(-1e-3, 1e-3) : random.uniform(-0.4, 0.4);
    const Vec3 half(0.5 * scale, 0.5 * scale, 0.5 * scale);
    PairScene scene;
    const auto a = scene.add(Box{.half_extents = half}, {});
    const auto b =
        scene.add(Box{.half_extents = half},
                  {scale * Vec3(dx, 0.98, dz), random.small_turn(2e-3) * turned(yaw, {0, 1, 0})});
    scene.pair(a, b);
    scene.collide();
    ASSERT_EQ(scene.contact().manifold_count, 1) << i;
    for (const double x : {std::max(dx, 0.0) - 0.5, std::min(dx, 0.0) + 0.5}) {
      for (const double z : {std::max(dz, 0.0) - 0.5, std::min(dz, 0.0) + 0.5}) {
        double nearest = 1e30;
        for (std::uint32_t k = 0; k < scene.manifold().point_count; ++k) {
          const Vec3 at = scene.world(0, scene.manifold().points[k]) / scale;
          nearest = std::min(nearest, std::hypot(at.x() - x, at.z() - z));
        }
        ASSERT_LT(nearest, 0.05) << i << " yaw " << yaw << " offset " << dx << " " << dz;
      }
    }
  }
}

TEST(NarrowphaseBox, impulses_follow_their_features) {
  PairScene scene;
  const auto a = scene.add(Box{}, {}), b = scene.add(Box{}, at({0.1, 0.999, 0}));
  scene.pair(a, b);
  scene.collide();
  float given[4];
  for (int k = 0; k < 4; ++k) given[k] = scene.manifold().normal_impulse[k] = 1.0f + k;
  scene.manifold().twist_impulse = 7;
  scene.set_pose(b, at({0.1001, 0.9991, 1e-4}));
  scene.collide();
  for (int k = 0; k < 4; ++k) EXPECT_EQ(scene.manifold().normal_impulse[k], given[k]);
  EXPECT_EQ(scene.manifold().twist_impulse, 7);
}

TEST(NarrowphaseBox, a_far_world_gives_the_same_contact) {
  core::Manifold near_origin;
  for (const double where : {0.0, 1048576.0}) {
    PairScene scene;
    const Vec3 origin(where, -where, where);
    const auto a = scene.add(Box{}, at(origin));
    const auto b = scene.add(Box{}, at(origin + Vec3(0.25, 0.9990234375, 0)));
    scene.pair(a, b);
    scene.collide();
    if (where == 0) near_origin = scene.manifold();
    ASSERT_EQ(scene.manifold().point_count, 4u);
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(scene.manifold().points[k].separation, near_origin.points[k].separation);
      EXPECT_EQ(scene.manifold().points[k].position.x, near_origin.points[k].position.x);
    }
  }
}

}  // namespace
}  // namespace skerry::test
