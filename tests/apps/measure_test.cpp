#include <gtest/gtest.h>
#include <algorithm>

#include <memory>
#include <set>

#include "apps/measure/compare.h"
#include "apps/measure/compare_parts.h"
#include "apps/measure/host_work.h"
#include "apps/measure/process_meter.h"
#include "apps/measure/statistics.h"
#include "apps/measure/step_log.h"
#include "pipeline/threading_mode.h"
#include "scenes/catalogue.h"
#include "scenes/load.h"

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
  EXPECT_GE(load.others(), 0);
  EXPECT_LE(load.others(), 1);
  EXPECT_GE(load.steal(), 0);
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
  // About 20 ms; less where the machine was busy while it was calibrated.
  EXPECT_GT(cpu_ms() - cpu_before, 2);
  EXPECT_NE(work.checksum(), before);
}

TEST(HostWork, is_the_same_work_in_jobs) {
  HostWork serial(1 << 20), jobs(1 << 20);
  serial.calibrate();
  HostPool pool(3, {}, Affinity::none);
  // Calibrations differ, so by blocks: ms = blocks / blocks_per_ms.
  jobs.calibrate();
  const double before = serial.checksum();
  ASSERT_EQ(jobs.checksum(), before);
  serial.run(2000.25 / serial.blocks_per_ms());
  jobs.run_jobs(2000.25 / jobs.blocks_per_ms(), pool);
  EXPECT_NE(serial.checksum(), before);
  EXPECT_EQ(jobs.checksum(), serial.checksum());
}

// What frame loops of a test need.
struct FrameFixture {
  FrameFixture(ThreadingMode mode, double dt) {
    WorldSettings settings = scenes::world_settings(scene);
    settings.mode = mode;
    settings.workers = 2;
    settings.rate_hz = 1 / dt;
    settings.record_tasks = true;
    settings.after_step = log.after_step();
    session = std::make_unique<Session>(scene, settings, dt);
    work.calibrate();
  }
  scenes::SceneDesc scene = scenes::make_scene("tiny");
  StepLog log;
  std::unique_ptr<Session> session;
  HostWork work{1 << 20};
  HostPool pool{1, {}, Affinity::none};
};

TEST(Frames, count_from_the_due_time) {
  FrameFixture f(ThreadingMode::serial, 0.005);
  // 20 ms of work every 5 ms: frame k is late by what all before it took too long.
  const FrameSamples samples =
      run_frames(*f.session, f.log, f.work, f.pool, {.host_ms = 20, .frames = 6});
  ASSERT_EQ(samples.frames(), 6u);
  EXPECT_EQ(samples.missed, 6u);
  // By 75 ms if the work takes what it was calibrated to; whatever delays one frame delays the later ones.
  EXPECT_GT(samples.latency_ms.back(), samples.latency_ms.front() + 10);
  EXPECT_EQ(f.session->world().step_count(), 6u);
}

TEST(Frames, show_input_in_the_same_frame_where_the_caller_steps) {
  for (const ThreadingMode mode :
       {ThreadingMode::serial, ThreadingMode::fork_join, ThreadingMode::job_system}) {
    FrameFixture f(mode, 0.005);
    const FrameSamples samples =
        run_frames(*f.session, f.log, f.work, f.pool, {.host_ms = 1, .frames = 5, .warmup = 2});
    EXPECT_EQ(samples.frames(), 5u);
    EXPECT_EQ(samples.input_ms, samples.latency_ms) << to_string(mode);
    EXPECT_EQ(samples.step_ms.size(), 5u);
    EXPECT_EQ(samples.state_age_ms, samples.latency_ms);
  }
}

TEST(Frames, show_input_later_with_a_dedicated_thread) {
  FrameFixture f(ThreadingMode::dedicated_thread, 0.01);
  const FrameSamples samples =
      run_frames(*f.session, f.log, f.work, f.pool, {.host_ms = 0.1, .frames = 40, .phase = 0.3});
  ASSERT_EQ(samples.frames(), 40u);
  ASSERT_FALSE(samples.input_ms.empty());
  EXPECT_LT(samples.input_ms.size(), samples.frames());  // the last ones were never shown
  // Posted after a step began, so it waits for the next, and is shown one step behind: more than one
  // period, unless the machine held up the frame until just before a step.
  EXPECT_GT(*std::max_element(samples.input_ms.begin(), samples.input_ms.end()), 10);
}

TEST(Frames, keep_a_typical_frame_with_everything_in_it) {
  FrameFixture f(ThreadingMode::job_system, 0.01);
  HostPool pool(2, {}, Affinity::none);
  const FrameSamples samples =
      run_frames(*f.session, f.log, f.work, pool,
                 {.host_ms = 2, .host_shape = HostShape::mixed, .frames = 5, .keep_typical = true});
  ASSERT_TRUE(samples.typical.has_value());
  EXPECT_EQ(samples.typical->tracks, (std::vector<std::string>{"main thread", "worker 1"}));
  std::set<FrameSpan::Kind> kinds;
  bool solve = false;
  for (const FrameSpan& span : samples.typical->spans) {
    kinds.insert(span.kind);
    EXPECT_LT(span.track, samples.typical->tracks.size());
    EXPECT_LE(span.begin_ms, span.end_ms);
    solve = solve || span.name == "solve_islands";
  }
  EXPECT_EQ(kinds.size(), 5u);
  EXPECT_TRUE(solve);
}

TEST(Compare, a_stopped_comparison_keeps_whole_repetitions) {
  const scenes::SceneDesc scene = scenes::make_scene("tiny");
  HostWork work(1 << 20);
  work.calibrate();
  int asked = 0;
  const Watcher watcher = {.stop = [&asked] { return ++asked > 5 * 20 + 30; }};
  const CompareOptions options = {.reps = 3, .steps = 10, .warmup = 10, .other_schedulers = false};
  const SceneComparison comparison = compare_scene(scene, options, work, watcher);
  EXPECT_EQ(comparison.throughput_reps.made, 1);
  EXPECT_EQ(comparison.throughput_reps.counted, 1);
  for (const ThroughputRow& row : comparison.throughput) EXPECT_EQ(row.rep_ms.size(), 1u);
  EXPECT_TRUE(comparison.equal());
  EXPECT_TRUE(comparison.frames.empty());
}

TEST(Compare, disturbed_repetitions_are_left_out_if_enough_remain) {
  using Flags = std::vector<bool>;
  EXPECT_EQ(repetitions_that_count({false, true, false, false}), (Flags{true, false, true, true}));
  EXPECT_EQ(repetitions_that_count({false, true, false}), (Flags{true, true, true}));
  EXPECT_EQ(repetitions_that_count({true, true, true, false, false, false}),
            (Flags{true, true, true, true, true, true}));
}

// Runs everything in order, but for one thing in one step.
class FaultyExecutor : public jobs::Executor {
 public:
  void run(const jobs::TaskGraph& graph, void* context, const jobs::RunOptions& options) override {
    begin(graph, context, options);
    end();
  }
  void begin(const jobs::TaskGraph& graph, void* context,
             const jobs::RunOptions& options) override {
    ++runs_;
    if (runs_ != 7) return serial_->begin(graph, context, options);
    broken_ = {};
    for (const jobs::Stage& stage : graph.stages()) {
      if (stage.name != std::string("solve_islands")) broken_.stage(stage);
    }
    serial_->begin(broken_, context, options);
  }
  void end() override { serial_->end(); }
  std::uint32_t worker_count() const override { return 1; }

 private:
  std::unique_ptr<jobs::Executor> serial_ = jobs::make_executor(jobs::ExecutorKind::serial);
  jobs::TaskGraph broken_;
  int runs_ = 0;
};

TEST(Compare, names_the_first_step_and_body_that_differ) {
  const pipeline::ExecutorOverride faults(
      [](const WorldSettings& settings) -> std::unique_ptr<jobs::Executor> {
        if (settings.mode == ThreadingMode::fork_join) return std::make_unique<FaultyExecutor>();
        return jobs::make_executor(jobs::ExecutorKind::serial);
      });
  HostWork work(1 << 20);
  const CompareOptions options = {
      .reps = 1, .steps = 5, .warmup = 5, .frames = 0, .other_schedulers = false};
  const SceneComparison comparison = compare_scene(scenes::make_scene("tiny"), options, work);
  EXPECT_FALSE(comparison.equal());
  for (const ThroughputRow& row : comparison.throughput) {
    ASSERT_EQ(row.difference.has_value(), row.strategy.mode == ThreadingMode::fork_join);
    if (!row.difference) continue;
    EXPECT_EQ(row.difference->step, 7u);
    EXPECT_TRUE(row.difference->where.starts_with("body 1, ")) << row.difference->where;
  }
  EXPECT_NE(comparison.verdict.front().find("fork_join DIFFERS from serial, first at step 7 (body"),
            std::string::npos)
      << comparison.verdict.front();
}

TEST(Strategies, are_all_combinations_that_matter) {
  const std::vector<Strategy> plain = strategies({.workers = {2}});
  ASSERT_EQ(plain.size(), 5u);
  EXPECT_EQ(plain[0].label, "serial");
  EXPECT_EQ(plain[4].label, "job_system");
  // serial and dedicated_thread once; dedicated_thread_jobs 2 x 2; the others 2 x 2 x 2.
  const std::vector<Strategy> all =
      strategies({.workers = {1, 2}, .spin_us = {0, 50}, .wake_ahead_ms = {0, 0.3}});
  EXPECT_EQ(all.size(), 2u + 4u + 8u + 8u);
  std::set<std::string> labels;
  for (const Strategy& row : all) labels.insert(row.label);
  EXPECT_EQ(labels.size(), all.size());
  EXPECT_TRUE(labels.contains("job_system, 2 workers, no spinning, woken 0.3 ms ahead"));
}

TEST(Schedulers, all_make_the_bits_of_the_serial_step) {
  for (const char* name : {"brick_wall", "box_pile"}) {
    const scenes::SceneDesc scene = scenes::load_scene(name);
    Session serial(scene, scenes::world_settings(scene), 1.0 / 60);
    serial.advance_to(20);
    for (const Strategy& row : other_schedulers({.workers = {3}})) {
      Session session(scene, scenes::world_settings(scene), 1.0 / 60, row);
      session.advance_to(20);
      EXPECT_EQ(session.world().state_hash(), serial.world().state_hash())
          << name << " on " << row.label;
      const StepReport& report = session.world().last_report();
      EXPECT_GT(report.step_ms, 0) << row.label;
      EXPECT_GT(report.stages()[5].tasks, 0u) << row.label;
    }
  }
}

TEST(StepAnalysis, takes_chains_item_by_item_and_phases_by_their_longest_block) {
  const StageTime stages[] = {{.name = "a"}, {.name = "b"}, {.name = "c", .per_item = true}};
  const auto task = [](const char* name, std::int64_t ms, std::uint32_t item,
                       std::int64_t critical_ms) {
    return jobs::TaskRecord{name, 0, ms * 1'000'000, 0, item, 1, critical_ms * 1'000'000};
  };
  const jobs::TaskRecord tasks[] = {task("a", 8, 0, 2), task("b", 3, 0, 3), task("b", 1, 1, 1),
                                    task("c", 1, 0, 1), task("c", 5, 1, 5)};
  const GraphBound bound = graph_bound(stages, tasks);
  EXPECT_DOUBLE_EQ(bound.work_ms(), 18);
  EXPECT_DOUBLE_EQ(bound.critical_ms(), 2 + 6);      // item 1 of b and c
  EXPECT_DOUBLE_EQ(bound.least_ms(2), 8 / 2.0 + 6);  // b and c wait for item 1
  EXPECT_DOUBLE_EQ(bound.speed_up(2), 1.8);
  EXPECT_DOUBLE_EQ(bound.speed_up(100), 18.0 / 8);
  GraphBound mean;
  for (int i = 0; i < 2; ++i) mean.add(bound, 0.5);
  EXPECT_DOUBLE_EQ(mean.speed_up(2), bound.speed_up(2));
  EXPECT_DOUBLE_EQ(imbalance({3, 1}), 1.5);
}

}  // namespace
}  // namespace skerry::test
