// What contacts come to carry under loads that stay.
#include "solver/carried_loads.h"

#include <gtest/gtest.h>

#include <cmath>

namespace skerry::solver {
namespace {

constexpr float kDt = 1.0f / 60, kDeep = 0.003f;  // s, m
constexpr Carrying kCarrying = {kDt, 0.01f, 0.05f, kDeep};
constexpr float kSpring = 1000;  // N s per m of a point

// Four points of which the first bears `load`, and lies as deep as what it does not carry presses it.
core::Manifold loaded_corner(float load, float statics = 0) {
  core::Manifold m;
  m.point_count = 4;
  m.statics_impulse = statics;
  for (auto& point : m.points) point.separation = 0;
  m.normal_impulse[0] = load;
  for (int step = 0; step < 2000; ++step) {
    m.points[0].separation = (m.carried_impulse - load) / kSpring;
    carry(kCarrying, load / 4, m);
  }
  return m;
}
float depth_of(const core::Manifold& m) { return -m.points[0].separation; }

TEST(CarriedLoads, a_shallow_contact_carries_half_of_what_a_mean_point_bears) {
  const core::Manifold m = loaded_corner(0.8f * kSpring * kDeep);
  EXPECT_NEAR(m.carried_impulse, m.normal_impulse[0] / 8, 1e-4f);
}

TEST(CarriedLoads, a_deep_contact_comes_to_carry_nearly_all_of_its_most_loaded_point) {
  for (const float times : {2.0f, 8.0f, 32.0f}) {
    const float load = times * kSpring * kDeep;
    const core::Manifold m = loaded_corner(load);
    // Of the 7/8 beyond the usual share, (deep / depth)^4 presses it in.
    const float depth = kDeep * std::pow(times * 7 / 8, 0.2f);
    EXPECT_NEAR(depth_of(m), depth, 1e-3f * depth) << times;
    EXPECT_NEAR(m.carried_impulse, load - kSpring * depth, 1e-3f * load) << times;
  }
}

// Else a pile whose bodies do not fit would press itself apart.
TEST(CarriedLoads, the_load_that_keeps_a_depth_is_bounded) {
  core::Manifold m;
  m.point_count = 1;
  for (auto& point : m.points) point.separation = 0;
  m.points[0].separation = -2 * kDeep;
  for (int step = 0; step < 5000; ++step) {
    m.normal_impulse[0] = m.carried_impulse + 2 * kDeep * kSpring;
    carry(kCarrying, m.normal_impulse[0], m);
  }
  EXPECT_NEAR(m.normal_impulse[0], 16 * 2 * (2 * kDeep * kSpring), 0.5f);
}

TEST(CarriedLoads, where_statics_knows_the_load_depth_does_not_count) {
  const float load = 8 * kSpring * kDeep;
  EXPECT_NEAR(loaded_corner(load, load / 4).carried_impulse, load / 8, 1e-3f);
}

// Points that were there before may have been deep.
TEST(CarriedLoads, only_points_that_are_there_count) {
  core::Manifold m;
  m.point_count = 1;
  for (auto& point : m.points) point.separation = -10 * kDeep;
  m.points[0].separation = 0;
  m.normal_impulse[0] = 1;
  carry(kCarrying, 1, m);
  EXPECT_FLOAT_EQ(m.carried_impulse, kCarrying.part * kCarriedShare);
}

}  // namespace
}  // namespace skerry::solver
