// Shifts that take back a change in the moment of momenta.
#include "solver/moment_shift.h"

#include <gtest/gtest.h>

#include <vector>

namespace skerry::test {
namespace {

const std::vector<Vec3> kVelocities = {{1, 0.2, -3}, {-2, 1, 0.5}, {0.3, -1.5, 2}, {0.7, 0.3, 0.5}};

core::BodyMass body_of(double mass) {
  core::BodyMass body;
  body.mass = mass;
  body.inner_radius = 0.2f;
  return body;
}

TEST(MomentShift, takes_back_a_change_and_moves_no_common_centre_of_mass) {
  Vec3 mean = Vec3::Zero();
  double total = 0;
  for (std::size_t i = 0; i < kVelocities.size(); ++i) {
    mean += (1.0 + double(i)) * kVelocities[i];
    total += 1.0 + double(i);
  }
  mean /= total;
  solver::MomentShift moment;
  moment.begin(0.25, 1);
  for (std::size_t i = 0; i < kVelocities.size(); ++i)
    moment.add(body_of(1.0 + double(i)), kVelocities[i] - mean);
  const Vec3 change(0.02, -0.03, 0.01);
  EXPECT_TRUE(moment.solve(change));
  Vec3 moved = Vec3::Zero(), taken = Vec3::Zero();
  for (std::size_t i = 0; i < kVelocities.size(); ++i) {
    const double mass = 1.0 + double(i);
    moved += mass * moment.shift(i);
    taken += mass * moment.shift(i).cross(kVelocities[i]);
  }
  EXPECT_LT(moved.norm(), 1e-15);
  EXPECT_LT((taken + change).norm(), 1e-7 * change.norm());
}

TEST(MomentShift, moves_nobody_farther_than_it_may) {
  solver::MomentShift moment;
  moment.begin(0.25, 1);
  for (const Vec3& v : kVelocities) moment.add(body_of(1), v);
  EXPECT_FALSE(moment.solve({20, -30, 10}));
  for (std::size_t i = 0; i < kVelocities.size(); ++i)
    EXPECT_LE(moment.shift(i).norm(), 0.25 * double(0.2f));
}

TEST(MomentShift, moves_nobody_farther_than_it_flies) {
  constexpr double kTime = 1e-3;
  solver::MomentShift moment;
  moment.begin(0.25, kTime);
  for (const Vec3& v : kVelocities) moment.add(body_of(1), v);
  EXPECT_FALSE(moment.solve({0.2, -0.3, 0.1}));
  for (std::size_t i = 0; i < kVelocities.size(); ++i)
    EXPECT_LE(moment.shift(i).norm(), kTime * kVelocities[i].norm());
}

TEST(MomentShift, leaves_bodies_alone_that_do_not_move) {
  solver::MomentShift moment;
  moment.begin(0.25, 1);
  for (int i = 0; i < 2; ++i) moment.add(body_of(1), Vec3::Zero());
  EXPECT_FALSE(moment.solve({1, 0, 0}));
  EXPECT_EQ(moment.shift(0), Vec3::Zero());
}

}  // namespace
}  // namespace skerry::test
