#include <gtest/gtest.h>

#include <memory>

#include "apps/measure/compare.h"
#include "apps/measure/host_work.h"
#include "apps/measure/machine_load.h"
#include "apps/measure/process_meter.h"
#include "apps/measure/statistics.h"
#include "scenes/catalogue.h"

namespace skerry::test {
namespace {

using namespace measure;

TEST(Statistics, percentiles_are_interpolated) {
  const std::vector<double> values = {10, 20, 30, 40, 50};
  EXPECT_EQ(percentile(values, 0), 10);
  EXPECT_EQ(percentile(values, 0.5), 30);
  EXPECT_EQ(percentile(values, 0.9), 46);
  EXPECT_EQ(percentile(values, 1), 50);
  EXPECT_EQ(percentile({}, 0.5), 0);
}

TEST(Statistics, summaries_do_not_mind_the_order) {
  const Summary summary = summarize({5, 1, 4, 2, 3});
  EXPECT_EQ(summary.count, 5u);
  EXPECT_EQ(summary.mean, 3);
  EXPECT_EQ(summary.p50, 3);
  EXPECT_EQ(summary.max, 5);
  EXPECT_EQ(median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(summarize({}).max, 0);
}

TEST(ProcessMeter, counts_operator_new) {
  if (!counts_allocations()) GTEST_SKIP() << "operator new is the sanitizer's";
  const std::uint64_t before = allocation_count();
  const auto one = std::make_unique<std::vector<int>>(100);
  EXPECT_EQ(allocation_count() - before, 2u);
}

TEST(ProcessMeter, cpu_time_grows_with_work) {
  const double before = cpu_ms();
  HostWork work(1 << 16);
  work.calibrate();
  EXPECT_GT(cpu_ms(), before);
  EXPECT_GT(peak_rss_mb(), 0);
  const MachineLoad load;
  EXPECT_GE(load.others_share(), 0);
  EXPECT_LE(load.others_share(), 1);
}

TEST(HostWork, is_a_fixed_amount_per_millisecond) {
  HostWork work(1 << 20);
  work.calibrate();
  EXPECT_GT(work.blocks_per_ms(), 10);
  const double before = work.checksum();
  work.run(0);
  EXPECT_EQ(work.checksum(), before);
  const double cpu_before = cpu_ms();
  work.run(20);
  // Never faster than calibrated but for noise; slower when the machine is busy.
  EXPECT_GT(cpu_ms() - cpu_before, 10);
  EXPECT_NE(work.checksum(), before);
}

TEST(Compare, frame_loop_counts_from_the_due_time) {
  const scenes::SceneDesc scene = scenes::make_scene("tiny");
  Session session(scene, scenes::world_settings(scene), 0.005);
  HostWork work(1 << 20);
  work.calibrate();
  // 20 ms of work every 5 ms: frame k is late by what all before it took too long.
  const FrameSamples samples = run_frames(session, work, {.host_ms = 20, .frames = 6});
  ASSERT_EQ(samples.frames(), 6u);
  EXPECT_EQ(samples.missed, 6u);
  EXPECT_GT(samples.latency_ms.back(), 3 * samples.latency_ms.front());
  EXPECT_EQ(session.world().step_count(), 6u);
}

TEST(Compare, a_stopped_comparison_keeps_whole_repetitions) {
  const scenes::SceneDesc scene = scenes::make_scene("tiny");
  HostWork work(1 << 20);
  work.calibrate();
  int asked = 0;
  const Watcher watcher = {.stop = [&asked] { return ++asked > 5 * 20 + 30; }};
  const SceneComparison comparison =
      compare_scene(scene, {.reps = 3, .steps = 10, .warmup = 10}, work, watcher);
  EXPECT_EQ(comparison.reps, 1);
  EXPECT_TRUE(comparison.equal());
  EXPECT_TRUE(comparison.frames.empty());
}

}  // namespace
}  // namespace skerry::test
