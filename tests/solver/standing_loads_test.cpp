// Loads of bodies that are put on each other at rest, against statics by hand.
#include "solver/standing_loads.h"

#include <gtest/gtest.h>

#include <deque>
#include <numeric>
#include <utility>
#include <vector>

namespace skerry::solver {
namespace {

constexpr double kSubstep = 0.25;
constexpr double kWeight = 8;

// Cubes of side 1, row k at `centers`[k]; row 0 is the ground.
class Cubes {
 public:
  explicit Cubes(std::vector<Vec3> centers) : centers_(std::move(centers)) {}

  // The two share a face from `low` to `high` along x.
  core::Manifold& rests(std::uint32_t above, std::uint32_t below, float low, float high,
                        bool begins = true) {
    core::Manifold& m = manifolds_.emplace_back();
    m.normal = {0, 1, 0};
    m.point_count = 4;
    m.placed = m.begins = begins;
    const core::V3f below_center = core::to_float(centers_[below]);
    const float top = core::to_float(centers_[above]).y - 0.5f;
    const float x[4] = {low, high, high, low}, z[4] = {-0.5f, -0.5f, 0.5f, 0.5f};
    for (int i = 0; i < 4; ++i) {
      m.points[i].position = core::V3f{x[i], top, z[i]} - below_center;
      m.points[i].separation = 0;
    }
    supports_.push_back({above,
                         below == 0 ? StandingLoads::kGround : below,
                         &m,
                         {centers_[below] - centers_[above], Vec3::Zero()}});
    return m;
  }
  void share() {
    StandingLoads loads;
    loads.begin(static_cast<std::uint32_t>(centers_.size()), {0, -10, 0}, kSubstep,
                StandingLoads::Scope::begun);
    for (std::uint32_t row = 1; row < centers_.size(); ++row) loads.add_body(row, kWeight);
    for (const auto& support : supports_) loads.add(support);
    loads.share();
  }

 private:
  std::vector<Vec3> centers_;
  std::deque<core::Manifold> manifolds_;
  std::vector<StandingLoads::Support> supports_;
};

// In weights of a cube.
double load(const core::Manifold& m) {
  return double(std::accumulate(m.normal_impulse, m.normal_impulse + 4, 0.0f)) / kSubstep / kWeight;
}

TEST(StandingLoads, each_contact_of_a_column_bears_what_lies_above) {
  Cubes cubes({{0, -0.5, 0}, {0, 0.5, 0}, {0, 1.5, 0}, {0, 2.5, 0}});
  const auto& top = cubes.rests(3, 2, -0.5f, 0.5f);
  const auto& foot = cubes.rests(1, 0, -0.5f, 0.5f);
  const auto& middle = cubes.rests(2, 1, -0.5f, 0.5f);
  cubes.share();
  EXPECT_NEAR(load(top), 1, 1e-6);
  EXPECT_NEAR(load(middle), 2, 1e-6);
  EXPECT_NEAR(load(foot), 3, 1e-6);
  for (const float impulse : foot.normal_impulse)
    EXPECT_NEAR(impulse, 0.75 * kWeight * kSubstep, 1e-5);
  const float mean = foot.normal_impulse[0];
  EXPECT_FLOAT_EQ(foot.standing_impulse, mean);
  EXPECT_FLOAT_EQ(foot.carried_impulse, kPlacedShare * mean);
}

TEST(StandingLoads, a_bridge_shares_its_load_between_its_piers) {
  Cubes cubes({{0, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0, 1.5, 0}});
  const auto& left = cubes.rests(3, 1, -0.5f, 0);
  const auto& right = cubes.rests(3, 2, 0, 0.5f);
  const auto& left_foot = cubes.rests(1, 0, -1, 0);
  cubes.rests(2, 0, 0, 1);
  cubes.share();
  EXPECT_NEAR(load(left), 0.5, 1e-3);
  EXPECT_NEAR(load(right), 0.5, 1e-3);
  EXPECT_NEAR(load(left_foot), 1.5, 1e-3);
  // The pier's load comes down beside its centre.
  EXPECT_GT(left_foot.normal_impulse[1], 1.2f * left_foot.normal_impulse[0]);
}

TEST(StandingLoads, what_leads_to_no_ground_or_was_there_before_is_left_alone) {
  Cubes cubes({{0, -0.5, 0}, {0, 0.5, 0}, {0, 1.5, 0}, {3, 0.5, 0}, {3, 1.5, 0}});
  const auto& falling = cubes.rests(2, 1, -0.5f, 0.5f);
  const auto& old = cubes.rests(3, 0, 2.5f, 3.5f, false);
  const auto& put_on_it = cubes.rests(4, 3, 2.5f, 3.5f);
  cubes.share();
  EXPECT_EQ(load(falling), 0);
  EXPECT_EQ(load(old), 0);
  EXPECT_NEAR(load(put_on_it), 1, 1e-6);
}

TEST(StandingLoads, points_that_do_not_touch_yet_bear_nothing) {
  Cubes cubes({{0, -0.5, 0}, {0, 0.5, 0}});
  auto& m = cubes.rests(1, 0, -0.5f, 0.5f);
  m.points[0].separation = m.points[3].separation = 1;
  cubes.share();
  EXPECT_EQ(m.normal_impulse[0], 0);
  EXPECT_EQ(m.normal_impulse[3], 0);
  EXPECT_NEAR(load(m), 1, 1e-6);
}

}  // namespace
}  // namespace skerry::solver
