// Body rows, manifold rows, filters, the state hash, kept exceptions.
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "core/bodies.h"
#include "core/colliders.h"
#include "core/contacts.h"
#include "core/hash.h"
#include "core/mass_properties.h"
#include "core/step_context.h"

namespace skerry::core {
namespace {

Quat random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Quat{normal(random), normal(random), normal(random), normal(random)}.normalized();
}

BodyIndex add_box(Bodies& bodies, const Vec3& half) {
  const BodyIndex body = take_row(bodies);
  bodies.flags[body] |= kDynamic | kAwake;
  const MassProperties box = solid_box(half, 500);
  BodyMass& mass = bodies.mass[body];
  mass.mass = box.mass;
  mass.inv_mass = 1 / box.mass;
  mass.inertia_b = box.inertia;
  mass.inv_inertia_b = box.inertia.inverse();
  return body;
}

TEST(BodyRows, lowest_free_row_is_taken_first_with_a_new_generation) {
  Bodies bodies;
  for (BodyIndex i = 0; i < 6; ++i) EXPECT_EQ(take_row(bodies), i);
  const BodyId old = bodies.id(1);
  for (const BodyIndex body : {4u, 1u, 3u}) free_row(bodies, body);
  EXPECT_FALSE(bodies.alive(old));
  EXPECT_EQ(take_row(bodies), 1u);
  EXPECT_FALSE(bodies.alive(old));
  EXPECT_TRUE(bodies.alive(bodies.id(1)));
  EXPECT_EQ(take_row(bodies), 3u);
  EXPECT_EQ(take_row(bodies), 4u);
  EXPECT_EQ(take_row(bodies), 6u);
}

TEST(BodyRows, default_id_is_never_alive) {
  Bodies bodies;
  take_row(bodies);
  EXPECT_FALSE(bodies.alive(BodyId{}));
  EXPECT_FALSE(bodies.alive(BodyId{0, 0}));
}

TEST(BodyRows, freed_rows_come_back_clean) {
  Bodies bodies;
  const BodyIndex body = add_box(bodies, {1, 2, 3});
  set_motion(bodies, body, {1, 2, 3}, {4, 5, 6});
  bodies.user_data[body] = 7;
  free_row(bodies, body);
  ASSERT_EQ(take_row(bodies), body);
  EXPECT_EQ(bodies.flags[body], std::uint32_t{kAlive});
  EXPECT_TRUE(bodies.motion[body].linear.isZero());
  EXPECT_EQ(bodies.mass[body].mass, 0);
  EXPECT_EQ(bodies.user_data[body], 0u);
}

TEST(BodyRows, awake_list_holds_awake_rows_in_order_and_no_quarantined_one) {
  Bodies bodies;
  for (int i = 0; i < 5; ++i) add_box(bodies, {1, 1, 1});
  bodies.flags[1] &= ~std::uint32_t{kAwake};
  bodies.flags[3] |= kQuarantined;
  bodies.awake_stale = true;
  refresh_awake(bodies);
  EXPECT_EQ(bodies.awake, (std::vector<BodyIndex>{0, 2, 4}));
  free_row(bodies, 2);
  refresh_awake(bodies);
  EXPECT_EQ(bodies.awake, (std::vector<BodyIndex>{0, 4}));
}

TEST(BodyRows, world_inertia_is_the_turned_one_and_its_inverse) {
  std::mt19937 random(1);
  Bodies bodies;
  const BodyIndex body = add_box(bodies, {0.2, 0.5, 0.9});
  const BodyMass& mass = bodies.mass[body];
  for (int i = 0; i < 20; ++i) {
    const Quat q = random_rotation(random);
    const Mat3 r = q.toRotationMatrix(), inertia = inertia_w(mass, q);
    EXPECT_TRUE(inertia.isApprox(r * mass.inertia_b * r.transpose(), 1e-14));
    EXPECT_EQ(inertia, inertia.transpose());
    EXPECT_TRUE((inertia * inv_inertia_w(mass, q, kAlive)).isApprox(Mat3::Identity(), 1e-12));
  }
}

TEST(BodyRows, angular_velocity_follows_from_momentum_under_any_lock) {
  std::mt19937 random(2);
  Bodies bodies;
  const BodyIndex body = add_box(bodies, {0.2, 0.5, 0.9});
  for (std::uint32_t locks = 0; locks < 64; ++locks) {
    bodies.flags[body] = kAlive | kDynamic | (locks << kLockShift);
    bodies.pose[body].orientation = random_rotation(random);
    set_motion(bodies, body, {1, 2, 3}, {4, 5, 6});
    const BodyMotion& motion = bodies.motion[body];
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(motion.linear[i], (locks >> i) & 1 ? 0 : i + 1);
      EXPECT_EQ(motion.angular[i], (locks >> (3 + i)) & 1 ? 0 : i + 4);
    }
    const Mat3 w =
        inv_inertia_w(bodies.mass[body], bodies.pose[body].orientation, bodies.flags[body]);
    EXPECT_LT((w * motion.angular_momentum - motion.angular).norm(), 1e-12) << "locks " << locks;
  }
}

TEST(BodyRows, kinematic_body_has_no_momentum) {
  Bodies bodies;
  const BodyIndex body = take_row(bodies);
  bodies.flags[body] |= kKinematic;
  set_motion(bodies, body, {1, 0, 0}, {0, 2, 0});
  EXPECT_EQ(bodies.motion[body].angular, Vec3(0, 2, 0));
  EXPECT_TRUE(bodies.motion[body].angular_momentum.isZero());
}

TEST(BodyRows, body_frame_and_center_frame_undo_each_other) {
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    const Vec3 local = Vec3::Random();
    const Pose pose{Vec3::Random() * 100, random_rotation(random)};
    const BodyPose center = center_frame(pose, local);
    EXPECT_LT((center.center - (pose.orientation * local + pose.position)).norm(), 1e-12);
    EXPECT_LT((body_frame(center, local).position - pose.position).norm(), 1e-12);
  }
}

TEST(ManifoldPool, rows_are_reused_and_runs_do_not_overlap) {
  ContactTable table;
  const std::uint32_t single = take_manifolds(table, 1),
                      run = take_manifolds(table, kMeshManifolds);
  EXPECT_EQ(run, single + 1);
  EXPECT_EQ(table.manifolds.size(), 1u + kMeshManifolds);
  give_manifolds(table, run, kMeshManifolds);
  give_manifolds(table, single, 1);
  EXPECT_EQ(take_manifolds(table, kMeshManifolds), run);
  EXPECT_EQ(take_manifolds(table, 1), single);
  EXPECT_EQ(table.manifolds.size(), 1u + kMeshManifolds);
}

TEST(Filters, meet_by_mutual_masks_unless_a_group_decides) {
  EXPECT_TRUE(filters_meet({}, {}));
  EXPECT_FALSE(filters_meet({.category = 2}, {.mask = 1}));
  EXPECT_FALSE(filters_meet({.mask = 1}, {.category = 2}));
  EXPECT_FALSE(filters_meet({.group = -3}, {.group = -3}));
  EXPECT_TRUE(filters_meet({.mask = 0, .group = 3}, {.mask = 0, .group = 3}));
  EXPECT_TRUE(filters_meet({.group = 3}, {.group = -3}));
  EXPECT_FALSE(filters_meet({.mask = 0, .group = 3}, {.group = 4}));
}

std::uint64_t hash_of(std::initializer_list<double> values) {
  StateHasher hasher;
  for (const double value : values) hasher.add(value);
  return hasher.finish();
}

TEST(StateHash, order_matters_and_the_sign_of_zero_does_not) {
  EXPECT_NE(hash_of({1, 2}), hash_of({2, 1}));
  EXPECT_EQ(hash_of({-0.0}), hash_of({0.0}));
  EXPECT_NE(hash_of({0.0}), hash_of({}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(hash_of({nan}), hash_of({-nan}));
}

TEST(StateHash, is_xxh64_over_the_values_whatever_the_buffering) {
  EXPECT_EQ(StateHasher().finish(),
            0xef46db3751d8e999u);  // XXH64 of nothing, from its specification
  StateHasher one, other;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    one.add(i);
    other.add(i);
    if (i % 7 == 0) other.finish();  // may be asked for at any time
  }
  EXPECT_EQ(one.finish(), other.finish());
}

TEST(CallbackErrors, lowest_body_wins_whatever_the_arrival_std_thread) {
  for (int round = 0; round < 20; ++round) {
    CallbackErrors errors;
    const auto keep = [&](BodyIndex first) {
      for (BodyIndex i = 0; i < 20; ++i) {
        const BodyIndex body = first + 2 * (19 - i);
        errors.keep(body, std::make_exception_ptr(std::runtime_error(std::to_string(body))));
      }
    };
    std::thread other([&] { keep(10); });
    keep(11);
    other.join();
    try {
      errors.rethrow();
      FAIL() << "nothing was kept";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "10");
    }
    EXPECT_NO_THROW(errors.rethrow());
  }
}

}  // namespace
}  // namespace skerry::core
