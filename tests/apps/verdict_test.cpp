// Statistics and sentences on made-up figures: nothing here depends on time.
#include <gtest/gtest.h>

#include <cmath>

#include "apps/measure/compare.h"
#include "apps/measure/plan.h"
#include "apps/measure/verdict.h"

namespace skerry::test {
namespace {

using namespace measure;

// Values around `center`, the same every time.
std::vector<double> around(double center, double spread, std::size_t count, int seed) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(center + spread * std::sin(double(i) * 1.7 + seed * 0.9));
  }
  return values;
}

TEST(Bootstrap, gives_the_same_interval_every_time_and_holds_the_value) {
  const Repetitions values = {around(10, 1, 20, 0), around(10.2, 1, 20, 1), around(9.9, 1, 20, 2)};
  const Estimate a = bootstrap_percentile(values, 0.5);
  const Estimate b = bootstrap_percentile(values, 0.5);
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
  EXPECT_LT(a.low, a.value);
  EXPECT_GT(a.high, a.value);
  EXPECT_GT(a.low, 8.5);
  EXPECT_LT(a.high, 11.5);
}

TEST(Bootstrap, sees_that_repetitions_differ_though_each_is_steady) {
  const Repetitions steady = {around(10, 0.1, 50, 0), around(10, 0.1, 50, 1),
                              around(10, 0.1, 50, 2)};
  const Repetitions moody = {around(9, 0.1, 50, 0), around(10, 0.1, 50, 1), around(11, 0.1, 50, 2)};
  const Estimate a = bootstrap_percentile(steady, 0.5);
  const Estimate b = bootstrap_percentile(moody, 0.5);
  EXPECT_LT(a.high - a.low, 0.2);
  EXPECT_GT(b.high - b.low, 1.5);
}

TEST(Bootstrap, of_few_repetitions_reaches_to_their_extremes) {
  const Estimate estimate = bootstrap_typical({{1}, {2}, {3}, {4}, {5}});
  EXPECT_EQ(estimate.value, 3);
  EXPECT_EQ(estimate.low, 1);
  EXPECT_EQ(estimate.high, 5);
  EXPECT_EQ(bootstrap_typical({}).value, 0);
  EXPECT_EQ(bootstrap_ratio({}, {}).value, 0);
  EXPECT_TRUE(overlap({1, 0, 2}, {3, 2, 4}));
  EXPECT_FALSE(overlap({1, 0, 2}, {3, 2.1, 4}));
}

// Steps differ from each other far more than repetitions do; in each repetition something else
// disturbs a third of the steps.
TEST(Bootstrap, of_the_same_steps_is_not_moved_by_what_disturbs_each_repetition_elsewhere) {
  Repetitions serial, faster;
  for (std::size_t rep = 0; rep < 9; ++rep) {
    for (Repetitions* row : {&serial, &faster}) {
      std::vector<double>& steps = row->emplace_back();
      const double cost = row == &serial ? 1 : 0.5;
      for (std::size_t step = 0; step < 30; ++step) {
        const bool disturbed = (step + rep) % 9 < 3;
        steps.push_back(cost * double(1 + step % 7) * (disturbed ? 3 : 1));
      }
    }
  }
  const Estimate ratio = bootstrap_ratio(serial, faster);
  EXPECT_DOUBLE_EQ(ratio.value, 2);
  const Estimate step = bootstrap_typical(serial);
  EXPECT_LT(step.value, 4.2);  // 3.9 undisturbed, 6.5 the mean of all
  EXPECT_LT(step.low, 4.2);
}

TEST(KarpFlatt, is_the_serial_share) {
  EXPECT_NEAR(karp_flatt(2, 2), 0, 1e-12);
  EXPECT_NEAR(karp_flatt(1, 2), 1, 1e-12);
  EXPECT_NEAR(karp_flatt(1 / (0.2 + 0.8 / 4), 4), 0.2, 1e-12);  // Amdahl with a fifth serial
  EXPECT_EQ(karp_flatt(1, 1), 0);
}

ThroughputRow steps(ThreadingMode mode, double speed_up, double spread) {
  ThroughputRow row;
  row.strategy = {.mode = mode, .workers = mode == ThreadingMode::serial ? 1 : 2};
  row.strategy.label = to_string(mode);
  row.speed_up = {speed_up, speed_up - spread, speed_up + spread};
  return row;
}

FrameRow frames(ThreadingMode mode, double host_ms, double frame_ms, double input_ms,
                std::uint64_t missed = 0) {
  FrameRow row;
  row.strategy.mode = mode;
  row.strategy.label = to_string(mode);
  row.host_ms = host_ms;
  for (int rep = 0; rep < 3; ++rep) {
    FrameSamples samples;
    samples.latency_ms = around(frame_ms, 0.05 * frame_ms, 20, rep);
    samples.input_ms = around(input_ms, 0.05 * input_ms, 20, rep);
    samples.missed = missed;
    row.reps.push_back(samples);
  }
  return row;
}

SceneComparison made_up() {
  SceneComparison comparison;
  comparison.dt = 1.0 / 60;
  comparison.throughput_reps = {.made = 3, .counted = 3};
  comparison.throughput = {steps(ThreadingMode::serial, 1, 0),
                           steps(ThreadingMode::fork_join, 1.5, 0.05),
                           steps(ThreadingMode::job_system, 1.7, 0.05)};
  comparison.bound.parts = {{.work_ms = 10, .critical_ms = 1}};
  comparison.frames = {frames(ThreadingMode::dedicated_thread, 2, 2.2, 30),
                       frames(ThreadingMode::fork_join, 2, 7, 7),
                       frames(ThreadingMode::job_system, 2, 7.1, 7.1),
                       frames(ThreadingMode::dedicated_thread, 12, 12.5, 45),
                       frames(ThreadingMode::fork_join, 12, 18, 18),
                       frames(ThreadingMode::job_system, 12, 17, 17)};
  return comparison;
}

bool says(const SceneComparison& comparison, const std::string& what) {
  for (const std::string& sentence : verdict_of(comparison)) {
    if (sentence.find(what) != std::string::npos) return true;
  }
  return false;
}

TEST(Verdict, claims_no_ranking_where_intervals_overlap) {
  SceneComparison comparison = made_up();
  EXPECT_TRUE(says(comparison, "job_system steps fastest: 1.70 times serial"));
  EXPECT_TRUE(says(comparison, "the task graph allows 2.00"));
  comparison.throughput[1].speed_up = {1.65, 1.55, 1.75};
  EXPECT_TRUE(says(comparison, "job_system and fork_join step fastest and cannot be told apart"));
  // Sure, but too small to matter.
  comparison.throughput[1].speed_up = {1.69, 1.689, 1.691};
  comparison.throughput[2].speed_up = {1.70, 1.699, 1.701};
  EXPECT_TRUE(says(comparison, "cannot be told apart"));
  for (auto i : {1, 2}) comparison.throughput[std::size_t(i)].speed_up = {1.05, 0.95, 1.2};
  EXPECT_TRUE(says(comparison, "No mode steps faster than serial beyond noise"));
}

TEST(Verdict, recommends_the_soonest_input_among_those_that_hold_the_rate) {
  const std::vector<LoadVerdict> verdicts = load_verdicts(made_up());
  ASSERT_EQ(verdicts.size(), 2u);
  EXPECT_EQ(verdicts[0].best, (std::vector<std::string>{"fork_join", "job_system"}));
  EXPECT_EQ(verdicts[0].holding.size(), 3u);
  ASSERT_TRUE(verdicts[0].shortest.has_value());
  EXPECT_EQ(*verdicts[0].shortest, "dedicated_thread");
  // Most frames late: job_system's sooner input does not count.
  EXPECT_EQ(verdicts[1].holding, (std::vector<std::string>{"dedicated_thread"}));
  EXPECT_EQ(verdicts[1].best, (std::vector<std::string>{"dedicated_thread"}));
}

TEST(Verdict, claims_no_frame_rate_that_the_interval_leaves_open) {
  SceneComparison comparison = made_up();
  comparison.frames = {frames(ThreadingMode::dedicated_thread, 8, 9, 40),
                       frames(ThreadingMode::fork_join, 8, 15.9, 15.9),
                       frames(ThreadingMode::job_system, 8, 19, 19)};
  const FrameRow& at_edge = comparison.frames[1];
  EXPECT_EQ(frame_rate(comparison.frames[0], comparison.dt), FrameRate::held);
  EXPECT_EQ(frame_rate(at_edge, comparison.dt), FrameRate::edge);
  EXPECT_EQ(frame_rate(comparison.frames[2], comparison.dt), FrameRate::lost);
  EXPECT_TRUE(says(comparison,
                   "dedicated_thread holds 60 Hz, fork_join is at its edge. Use dedicated_thread"));
  EXPECT_TRUE(says(comparison, "fork_join would show input after 16."));
  comparison.frames[0] = frames(ThreadingMode::dedicated_thread, 8, 20, 40);
  EXPECT_TRUE(says(comparison,
                   "no mode surely holds 60 Hz, fork_join is at its edge. Use fork_join: input"));
  comparison.frames[1].gave_up = true;
  EXPECT_TRUE(says(comparison, "no mode holds 60 Hz;"));
}

TEST(Verdict, says_where_modes_cross_over) {
  const SceneComparison comparison = made_up();
  EXPECT_TRUE(
      says(comparison, "Between 2 ms and 12 ms fork_join and job_system stop holding 60 Hz."));
  EXPECT_TRUE(says(
      comparison, "Between 2 ms and 12 ms the choice changes from fork_join to dedicated_thread."));
}

TEST(Verdict, puts_a_difference_first) {
  SceneComparison comparison = made_up();
  comparison.throughput[2].difference = Difference{12, "body 3, position.x: 1 instead of 2"};
  EXPECT_EQ(
      verdict_of(comparison).front(),
      "job_system DIFFERS from serial, first at step 12 (body 3, position.x: 1 instead of 2): "
      "its figures do not count.");
}

TEST(Verdict, says_when_no_mode_holds_the_rate) {
  SceneComparison comparison = made_up();
  comparison.frames = {frames(ThreadingMode::serial, 8, 40, 40, 20),
                       frames(ThreadingMode::job_system, 8, 20, 20, 12)};
  EXPECT_TRUE(
      says(comparison, "With 8 ms of host work no mode holds 60 Hz; job_system misses least."));
}

TEST(Plan, cuts_what_is_not_fixed_until_it_fits) {
  const SceneCost cost = {.build_s = 0.01, .step_s = 0.006, .hash_s = 0.001};
  const CompareOptions options = {.axes = {.workers = {2}}};
  const Plan free = make_plan({cost, cost}, {options, options}, {}, 1e6);
  EXPECT_TRUE(free.cut.empty());
  EXPECT_GT(free.total_s, 50);
  const Plan cut = make_plan({cost, cost}, {options, options}, {}, 0.6 * free.total_s);
  EXPECT_LE(cut.total_s, 0.6 * free.total_s);
  EXPECT_LT(cut.options[0].frames, options.frames);
  EXPECT_EQ(cut.options[0].frames, cut.options[1].frames);
  EXPECT_NE(cut.cut.find("frames cut from 15 to"), std::string::npos) << cut.cut;
  const Plan fixed = make_plan({cost}, {options}, {true, true, true}, 1);
  EXPECT_EQ(fixed.options[0].frames, options.frames);
  EXPECT_EQ(fixed.options[0].reps, options.reps);
  EXPECT_TRUE(fixed.cut.empty());
  const Plan least = make_plan({cost}, {options}, {}, 0.1);
  EXPECT_EQ(least.options[0].reps, 3);
  EXPECT_EQ(least.options[0].frames, 5u);
}

}  // namespace
}  // namespace skerry::test
