// Starting, stopping, sleeping and leaving.
#include <gtest/gtest.h>
#include <sched.h>
#include <time.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

#include "apps/measure/process_meter.h"
#include "jobs/machine.h"
#include "tests/jobs/executors.h"

namespace skerry::jobs::test {
namespace {

using LifetimeTest = EveryExecutor;
INSTANTIATE_TEST_SUITE_P(EveryExecutor, LifetimeTest, testing::ValuesIn(every_executor()),
                         case_name);

std::uint32_t sum_of(Executor& executor, std::uint32_t count) {
  std::atomic<std::uint32_t> sum = 0;
  parallel_for(executor, count, 1, [&](IndexRange items, Task&) { sum += items.begin; });
  return sum;
}

double process_cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) * 1e3 + double(time.tv_nsec) * 1e-6;
}

TEST_P(LifetimeTest, a_thousand_executors_start_work_and_stop) {
  for (int i = 0; i < 1000 / GetParam().workers; ++i) {
    TestedExecutor one(GetParam());
    if (i % 3 == 0) continue;  // never used
    ASSERT_EQ(sum_of(one.get(), 10), 45u);
  }
}

TEST_P(LifetimeTest, an_executor_may_go_in_the_middle_of_a_run) {
  for (int i = 0; i < 20; ++i) {
    std::atomic<int> runs = 0;
    TaskGraph graph;
    graph.stage({.name = "work",
                 .domain = 1,
                 .kernel = [](void* context, IndexRange,
                              Task&) { ++*static_cast<std::atomic<int>*>(context); },
                 .count = [](void*) { return 1000u; }});
    TestedExecutor one(GetParam());
    one->begin(graph, &runs);
  }
}

// Whether the process stops burning processor time: a busy machine may let workers fall asleep late.
bool comes_to_rest() {
  for (int attempt = 0; attempt < 100; ++attempt) {
    const double before_ms = process_cpu_ms();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (process_cpu_ms() - before_ms < 3) return true;
  }
  return false;
}

TEST_P(LifetimeTest, idle_workers_burn_no_processor_time) {
  TestedExecutor other(GetParam(), {.spin_us = 1e6});  // spinning is for runs in progress
  for (int i = 0; i < 3; ++i) {
    sum_of(*executor, 100);
    sum_of(other.get(), 100);
  }
  EXPECT_TRUE(comes_to_rest());
}

TEST_P(LifetimeTest, an_early_wake_is_only_that) {
  for (int i = 0; i < 5; ++i) {
    executor->wake();
    ASSERT_EQ(sum_of(*executor, 10), 45u);
  }
  executor->wake();
  executor->wake();
  EXPECT_TRUE(comes_to_rest()) << "woken workers go back to sleep";
}

TEST_P(LifetimeTest, steady_runs_allocate_nothing) {
  if (!measure::counts_allocations()) GTEST_SKIP() << "not counted in this build";
  if (GetParam().kind == ExecutorKind::host_pool) GTEST_SKIP() << "the pool of the test allocates";
  struct Phases : PhaseProgram {
    std::uint32_t phase_count() const override { return 5; }
    std::uint32_t block_count(std::uint32_t) const override { return 4; }
    void run_block(std::uint32_t, std::uint32_t, std::uint32_t) override {}
  };
  TaskGraph graph;
  const Kernel nothing = [](void*, IndexRange, Task&) {};
  const ItemCount hundred = [](void*) { return 100u; };
  graph.partition(1, 2);
  graph.stage({.name = "once", .kernel = nothing, .writes = 1});
  graph.stage({.name = "head",
               .domain = 1,
               .kernel = nothing,
               .count = hundred,
               .chunk = 3,
               .reads = 1,
               .writes = 2});
  graph.stage({.name = "tail",
               .domain = 1,
               .kernel = nothing,
               .count = hundred,
               .chunk = 3,
               .reads = 2,
               .writes = 4});
  graph.stage({.name = "phases",
               .kernel =
                   [](void*, IndexRange, Task& task) {
                     Phases phases;
                     task.run_phases(phases);
                   },
               .reads = 4});
  // Any worker may come to run any share of the tasks, and each records its own.
  RunReport report;
  const auto run_both_ways = [&] {
    executor->run(graph, nullptr, {.report = &report});
    executor->begin(graph, nullptr);
    executor->end();
    parallel_for(*executor, 100, 3, [](IndexRange, Task&) {});
  };
  // A worker that the machine was too busy to start brings its first buffers when it comes at last:
  // the state is steady once a round allocates nothing.
  bool steady = false;
  for (int round = 0; round < 50 && !steady; ++round) {
    const std::uint64_t before = measure::allocation_count();
    for (int i = 0; i < 200; ++i) run_both_ways();
    steady = measure::allocation_count() == before;
  }
  EXPECT_TRUE(steady) << "every one of 50 rounds allocated";
}

// The last processor it may run on, and no other.
cpu_set_t last_of(const cpu_set_t& processors) {
  cpu_set_t last;
  CPU_ZERO(&last);
  for (int i = CPU_SETSIZE - 1; i >= 0; --i) {
    if (!CPU_ISSET(i, &processors)) continue;
    CPU_SET(i, &last);
    return last;
  }
  return last;
}

// With spread the caller works on the first of the processors, from wherever it comes.
TEST_P(LifetimeTest, the_caller_gets_its_affinity_back) {
  cpu_set_t allowed, inside, after;
  ASSERT_EQ(sched_getaffinity(0, sizeof(allowed), &allowed), 0);
  const cpu_set_t before = last_of(allowed);
  ASSERT_EQ(sched_setaffinity(0, sizeof(before), &before), 0);
  int processor = -1;
  const std::thread::id caller = std::this_thread::get_id();
  parallel_for(*executor, 1, 1, [&](IndexRange, Task&) {
    if (std::this_thread::get_id() != caller) return;
    sched_getaffinity(0, sizeof(inside), &inside);
    processor = sched_getcpu();
  });
  ASSERT_EQ(sched_getaffinity(0, sizeof(after), &after), 0);
  sched_setaffinity(0, sizeof(allowed), &allowed);
  EXPECT_TRUE(CPU_EQUAL(&before, &after));
  if (GetParam().workers == 1) return;
  EXPECT_EQ(CPU_COUNT(&inside), 1);
  const bool spread = GetParam().affinity == Affinity::spread;
  EXPECT_EQ(processor, spread ? allowed_processors().front() : allowed_processors().back());
}

// Phases of several blocks, which invite helpers; the caller may come to run such a ticket itself.
struct TwoBlockPhases final : PhaseProgram {
  std::uint32_t phase_count() const override { return 20; }
  std::uint32_t block_count(std::uint32_t) const override { return 2; }
  void run_block(std::uint32_t, std::uint32_t, std::uint32_t) override {}
};

TEST_P(LifetimeTest, runs_with_phases_leave_the_callers_affinity_as_it_was) {
  cpu_set_t before, after;
  ASSERT_EQ(sched_getaffinity(0, sizeof(before), &before), 0);
  for (int i = 0; i < 200; ++i) {
    parallel_for(*executor, 4, 1, [&](IndexRange, Task& task) {
      TwoBlockPhases program;
      task.run_phases(program);
    });
  }
  ASSERT_EQ(sched_getaffinity(0, sizeof(after), &after), 0);
  EXPECT_TRUE(CPU_EQUAL(&before, &after));
}

TEST_P(LifetimeTest, two_threads_may_use_two_executors) {
  TestedExecutor other(GetParam());
  std::thread second([&] {
    for (int i = 0; i < 200; ++i) EXPECT_EQ(sum_of(other.get(), 20), 190u);
  });
  for (int i = 0; i < 200; ++i) EXPECT_EQ(sum_of(*executor, 20), 190u);
  second.join();
}

TEST_P(LifetimeTest, one_executor_may_move_from_thread_to_thread) {
  for (int i = 0; i < 10; ++i) {
    std::thread([&] { EXPECT_EQ(sum_of(*executor, 20), 190u); }).join();
  }
}

class Many : public EveryExecutor {};
INSTANTIATE_TEST_SUITE_P(EveryExecutor, Many,
                         testing::Values(ExecutorCase{ExecutorKind::fork_join, 2},
                                         ExecutorCase{ExecutorKind::job_system, 2},
                                         ExecutorCase{ExecutorKind::host_pool, 2},
                                         ExecutorCase{ExecutorKind::threads, 2}),
                         case_name);

TEST_P(Many, sixty_four_executors_have_runs_in_progress_at_once) {
  std::vector<std::unique_ptr<TestedExecutor>> executors;
  for (int i = 0; i < 64; ++i) executors.push_back(std::make_unique<TestedExecutor>(GetParam()));
  TaskGraph graph;
  graph.stage(
      {.name = "add",
       .domain = 1,
       .kernel = [](void* context, IndexRange items,
                    Task&) { *static_cast<std::atomic<int>*>(context) += int(items.size()); },
       .count = [](void*) { return 100u; },
       .chunk = 3});
  for (int repeat = 0; repeat < 10; ++repeat) {
    std::vector<std::atomic<int>> sums(64);
    for (std::size_t i = 0; i < 64; ++i) (*executors[i])->begin(graph, &sums[i]);
    for (std::size_t i = 0; i < 64; ++i) (*executors[i])->end();
    for (const auto& sum : sums) ASSERT_EQ(sum, 100);
  }
}

// The rest of a process's life, in processes of their own.

int run_with_one_processor(ExecutorKind kind) {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  if (sched_setaffinity(0, sizeof(one), &one) != 0) return 2;
  if (automatic_worker_count() != 1) return 3;
  if (make_executor(kind)->worker_count() != 1) return 4;
  const auto executor = make_executor(kind, {.workers = 3});  // all the same
  for (int i = 0; i < 50; ++i) {
    if (sum_of(*executor, 20) != 190) return 5;
  }
  return 0;
}

TEST(LifetimeDeathTest, one_processor_is_enough) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  for (const auto kind :
       {ExecutorKind::fork_join, ExecutorKind::job_system, ExecutorKind::threads}) {
    EXPECT_EXIT(std::exit(run_with_one_processor(kind)), testing::ExitedWithCode(0), "");
  }
}

void exit_with_a_run_in_progress(ExecutorKind kind) {
  static const TaskGraph graph = [] {
    TaskGraph one;
    one.stage({.name = "work",
               .domain = 1,
               .kernel = [](void*, IndexRange,
                            Task&) { std::this_thread::sleep_for(std::chrono::milliseconds(1)); },
               .count = [](void*) { return 1000u; }});
    return one;
  }();
  static const std::unique_ptr<Executor> executor = make_executor(kind, {.workers = 2});
  sum_of(*executor, 10);
  executor->begin(graph, nullptr);
  std::exit(0);  // destroys the executor, which cancels the run
}

TEST(LifetimeDeathTest, a_process_may_exit_with_a_run_in_progress) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  for (const auto kind :
       {ExecutorKind::fork_join, ExecutorKind::job_system, ExecutorKind::threads}) {
    EXPECT_EXIT(exit_with_a_run_in_progress(kind), testing::ExitedWithCode(0), "");
  }
}

}  // namespace
}  // namespace skerry::jobs::test
