// What every executor promises about a run: order, items, counts, exceptions, cancellation.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/jobs/executors.h"

namespace skerry::jobs::test {
namespace {

using RunTest = EveryExecutor;
INSTANTIATE_TEST_SUITE_P(EveryExecutor, RunTest, testing::ValuesIn(every_executor()), case_name);

// A graph of random stages whose kernels check that everything they wait for has been done.
struct Probe {
  struct Row {
    std::uint32_t items = 0;
    std::vector<std::atomic<int>> runs;  // [item] finished kernels
    std::atomic<std::uint32_t> finished = 0;
    std::atomic<int> counted = 0;
    std::mutex mutex;
    std::set<std::pair<std::uint32_t, std::uint32_t>> ranges;
  };
  struct Node {
    Probe* probe;
    std::uint32_t stage;
  };
  TaskGraph graph;
  std::vector<std::unique_ptr<Row>> rows;
  std::atomic<int> mistakes = 0;
  std::atomic<std::uint32_t> next_stage = 0;

  void check_order(std::uint32_t stage, IndexRange items) {
    for (std::uint32_t earlier = 0; earlier < stage; ++earlier) {
      if (!graph.depends(stage, earlier)) continue;
      const Row& row = *rows[earlier];
      if (graph.chain_head(stage) == graph.chain_head(earlier)) {
        for (std::uint32_t i = items.begin; i < items.end; ++i) {
          if (row.runs[i].load() != 1) ++mistakes;
        }
      } else if (row.finished.load() != row.items) {
        ++mistakes;
      }
    }
  }

  void run(std::uint32_t stage, IndexRange items) {
    check_order(stage, items);
    Row& row = *rows[stage];
    for (std::uint32_t i = items.begin; i < items.end; ++i) ++row.runs[i];
    row.finished += items.size();
    const std::lock_guard lock(row.mutex);
    row.ranges.emplace(items.begin, items.end);
  }
};

constexpr int kMostStages = 24;

// A kernel is a plain function, so each stage of the probe has its own.
template <std::uint32_t stage>
void probe_kernel(void* context, IndexRange items, Task&) {
  static_cast<Probe*>(context)->run(stage, items);
}
template <std::uint32_t stage>
std::uint32_t probe_count(void* context) {
  auto& row = *static_cast<Probe*>(context)->rows[stage];
  ++row.counted;
  return row.items;
}
template <std::size_t... stage>
std::pair<std::vector<Kernel>, std::vector<ItemCount>> probe_functions(
    std::index_sequence<stage...>) {
  return {{probe_kernel<stage>...}, {probe_count<stage>...}};
}

std::unique_ptr<Probe> random_probe(unsigned seed) {
  static const auto functions = probe_functions(std::make_index_sequence<kMostStages>());
  std::mt19937 random(seed);
  auto probe = std::make_unique<Probe>();
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  const std::uint32_t sizes[] = {1, below(40), below(200), below(5)};
  const std::uint32_t chunks[] = {1, 1 + below(8), 1 + below(30), 1};
  for (Domain domain = 1; domain < 4; ++domain) {
    probe->graph.partition(domain, random() & 0xff);
  }
  const std::uint32_t stages = 1 + below(kMostStages);
  for (std::uint32_t i = 0; i < stages; ++i) {
    const Domain domain = below(4);
    const auto some_bits = [&] { return std::uint64_t{random() & random() & random() & 0xff}; };
    probe->graph.stage({.name = "probe",
                        .domain = domain,
                        .kernel = functions.first[i],
                        .count = domain == kOnce ? nullptr : functions.second[i],
                        .chunk = chunks[domain],
                        .reads = some_bits(),
                        .writes = some_bits()});
    auto row = std::make_unique<Probe::Row>();
    row->items = sizes[domain];
    row->runs = std::vector<std::atomic<int>>(row->items);
    probe->rows.push_back(std::move(row));
  }
  return probe;
}

void expect_everything_ran_once(const Probe& probe) {
  EXPECT_EQ(probe.mistakes, 0);
  for (std::uint32_t stage = 0; stage < probe.rows.size(); ++stage) {
    const auto& row = *probe.rows[stage];
    for (const auto& runs : row.runs) EXPECT_EQ(runs.load(), 1);
    std::uint32_t expected_begin = 0;
    const std::uint32_t chunk = probe.graph.stages()[stage].chunk;
    for (const auto& [begin, end] : row.ranges) {
      EXPECT_EQ(begin, expected_begin);
      EXPECT_EQ(end, std::min(begin + chunk, row.items));
      expected_begin = end;
    }
    EXPECT_EQ(expected_begin, row.items);
    const bool is_head = !probe.graph.follows_per_item(stage);
    const bool has_count = probe.graph.stages()[stage].count != nullptr;
    EXPECT_EQ(row.counted, is_head && has_count ? 1 : 0);
  }
}

TEST_P(RunTest, random_graphs_keep_their_order_and_run_every_item_once) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    const auto probe = random_probe(seed);
    executor->run(probe->graph, probe.get());
    expect_everything_ran_once(*probe);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST_P(RunTest, begin_and_end_do_the_same_as_run) {
  for (unsigned seed = 100; seed < 140; ++seed) {
    const auto probe = random_probe(seed);
    executor->begin(probe->graph, probe.get());
    if (seed % 3 == 0) std::this_thread::sleep_for(std::chrono::microseconds(seed));
    executor->end();
    expect_everything_ran_once(*probe);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST_P(RunTest, empty_graphs_and_empty_domains_end) {
  TaskGraph graph;
  executor->run(graph, nullptr);
  graph.stage({.name = "none",
               .domain = 1,
               .kernel = [](void*, IndexRange, Task&) { FAIL() << "nothing to run"; },
               .count = [](void*) { return 0u; },
               .writes = 1});
  executor->run(graph, nullptr);
  bool ran = false;
  graph.stage(
      {.name = "after",
       .kernel = [](void* context, IndexRange, Task&) { *static_cast<bool*>(context) = true; },
       .reads = 1});
  executor->begin(graph, &ran);
  executor->end();
  EXPECT_TRUE(ran);
}

TEST_P(RunTest, counts_are_asked_after_what_they_wait_for) {
  struct Data {
    std::uint32_t made = 0;
    std::atomic<std::uint32_t> used = 0;
  } data;
  TaskGraph graph;
  graph.stage(
      {.name = "make",
       .kernel = [](void* context, IndexRange, Task&) { static_cast<Data*>(context)->made = 77; },
       .writes = 1});
  graph.stage({.name = "use",
               .domain = 1,
               .kernel = [](void* context, IndexRange items,
                            Task&) { static_cast<Data*>(context)->used += items.size(); },
               .count = [](void* context) { return static_cast<Data*>(context)->made; },
               .chunk = 10,
               .reads = 1});
  executor->run(graph, &data);
  EXPECT_EQ(data.used, 77u);
}

TEST_P(RunTest, a_worker_index_is_held_by_one_thread_at_a_time) {
  struct Data {
    std::vector<std::atomic<int>> holders;
    std::atomic<int> mistakes = 0;
  } data{std::vector<std::atomic<int>>(executor->worker_count())};
  const auto body = [&](IndexRange, Task& task) {
    if (task.worker() >= data.holders.size()) {
      ++data.mistakes;
      return;
    }
    if (data.holders[task.worker()].fetch_add(1) != 0) ++data.mistakes;
    for (int i = 0; i < 50; ++i) std::this_thread::yield();
    if (data.holders[task.worker()].fetch_sub(1) != 1) ++data.mistakes;
  };
  for (int repeat = 0; repeat < 20; ++repeat) parallel_for(*executor, 64, 1, body);
  EXPECT_EQ(data.mistakes, 0);
  EXPECT_LE(executor->worker_count(), static_cast<std::uint32_t>(GetParam().workers));
}

// ---- exceptions ---------------------------------------------------------------------------------

struct Thrower {
  std::uint32_t stage = 0;
  std::uint32_t item = 0;
  bool from_count = false;
  std::atomic<int> runs_after = 0;
};

template <std::uint32_t stage>
void throwing_kernel(void* context, IndexRange items, Task&) {
  auto& thrower = *static_cast<Thrower*>(context);
  if (stage > thrower.stage) ++thrower.runs_after;
  if (stage == thrower.stage && !thrower.from_count && items.begin <= thrower.item &&
      thrower.item < items.end) {
    throw std::runtime_error("stage " + std::to_string(stage));
  }
}
template <std::uint32_t stage>
std::uint32_t throwing_count(void* context) {
  const auto& thrower = *static_cast<Thrower*>(context);
  if (stage == thrower.stage && thrower.from_count) throw std::runtime_error("count");
  return 40;
}

// One stage of each kind: once, chunks, the head, middle and end of a chain, once again.
TaskGraph throwing_graph() {
  TaskGraph graph;
  graph.partition(2, 4 | 8 | 16);
  graph.stage({.name = "once", .kernel = throwing_kernel<0>, .writes = 1});
  graph.stage({.name = "chunks",
               .domain = 1,
               .kernel = throwing_kernel<1>,
               .count = throwing_count<1>,
               .chunk = 4,
               .reads = 1,
               .writes = 2});
  graph.stage({.name = "head",
               .domain = 2,
               .kernel = throwing_kernel<2>,
               .count = throwing_count<2>,
               .reads = 2,
               .writes = 4});
  graph.stage({.name = "middle",
               .domain = 2,
               .kernel = throwing_kernel<3>,
               .count = throwing_count<3>,
               .reads = 4,
               .writes = 8});
  graph.stage({.name = "end",
               .domain = 2,
               .kernel = throwing_kernel<4>,
               .count = throwing_count<4>,
               .reads = 8,
               .writes = 16});
  graph.stage({.name = "last", .kernel = throwing_kernel<5>, .reads = 16});
  return graph;
}

TEST_P(RunTest, an_exception_of_any_stage_kind_reaches_the_caller) {
  const TaskGraph graph = throwing_graph();
  for (std::uint32_t stage = 0; stage < 6; ++stage) {
    Thrower thrower{.stage = stage, .item = stage == 0 || stage == 5 ? 0u : 13u};
    try {
      executor->run(graph, &thrower);
      ADD_FAILURE() << "no exception from stage " << stage;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), "stage " + std::to_string(stage));
    }
    if (stage < 2) {
      EXPECT_EQ(thrower.runs_after, 0) << "stages that wait for it do not run";
    }
    Thrower nothing{.stage = 99};
    EXPECT_NO_THROW(executor->run(graph, &nothing)) << "usable afterwards";
  }
}

TEST_P(RunTest, an_exception_of_a_count_reaches_the_caller) {
  const TaskGraph graph = throwing_graph();
  for (const std::uint32_t stage : {1u, 2u}) {
    Thrower thrower{.stage = stage, .from_count = true};
    EXPECT_THROW(executor->run(graph, &thrower), std::runtime_error);
    EXPECT_EQ(thrower.runs_after, 0);
  }
}

TEST_P(RunTest, of_several_exceptions_the_earliest_seen_is_thrown) {
  // Every chunk throws once all that will run have begun, so several are seen.
  for (int repeat = 0; repeat < 20; ++repeat) {
    std::mutex mutex;
    std::uint32_t lowest = ~0u;
    const auto body = [&](IndexRange items, Task&) {
      {
        const std::lock_guard lock(mutex);
        lowest = std::min(lowest, items.begin);
      }
      throw items.begin;
    };
    try {
      parallel_for(*executor, 100, 5, body);
      ADD_FAILURE() << "no exception";
    } catch (std::uint32_t first) {
      EXPECT_EQ(first, lowest);
    }
  }
}

TEST_P(RunTest, an_exception_after_begin_is_thrown_by_end) {
  const TaskGraph graph = throwing_graph();
  Thrower thrower{.stage = 3, .item = 7};
  executor->begin(graph, &thrower);
  EXPECT_THROW(executor->end(), std::runtime_error);
}

// ---- cancellation -------------------------------------------------------------------------------

TEST_P(RunTest, a_stop_request_before_the_run_runs_nothing) {
  std::stop_source source;
  source.request_stop();
  Thrower thrower{.stage = 0};
  const TaskGraph graph = throwing_graph();
  EXPECT_THROW(executor->run(graph, &thrower, {.stop = source.get_token()}), Cancelled);
  EXPECT_EQ(thrower.runs_after, 0);
}

TEST_P(RunTest, a_stop_request_in_the_middle_ends_the_run_soon) {
  struct Data {
    std::stop_source source;
    std::atomic<int> runs = 0;
  } data;
  TaskGraph graph;
  graph.stage({.name = "work",
               .domain = 1,
               .kernel =
                   [](void* context, IndexRange, Task&) {
                     auto& stopping = *static_cast<Data*>(context);
                     if (++stopping.runs == 5) stopping.source.request_stop();
                   },
               .count = [](void*) { return 100000u; }});
  EXPECT_THROW(executor->run(graph, &data, {.stop = data.source.get_token()}), Cancelled);
  EXPECT_LT(data.runs, 100);
  data.source = {};
  data.runs = 1000;
  EXPECT_NO_THROW(executor->run(graph, &data));
}

TEST_P(RunTest, a_stop_request_after_the_last_kernel_changes_nothing) {
  std::stop_source source;
  TaskGraph graph;
  graph.stage({.name = "last", .kernel = [](void* context, IndexRange, Task&) {
                 static_cast<std::stop_source*>(context)->request_stop();
               }});
  EXPECT_NO_THROW(executor->run(graph, &source, {.stop = source.get_token()}));
}

// ---- misuse, nesting, reports -------------------------------------------------------------------

TEST_P(RunTest, calls_out_of_turn_are_refused) {
  TaskGraph graph;
  EXPECT_THROW(executor->end(), std::logic_error);
  executor->begin(graph, nullptr);
  EXPECT_THROW(executor->begin(graph, nullptr), std::logic_error);
  EXPECT_THROW(executor->run(graph, nullptr), std::logic_error);
  executor->end();
  EXPECT_NO_THROW(executor->run(graph, nullptr));
  EXPECT_THROW(
      parallel_for(*executor, 1, 1, [&](IndexRange, Task&) { executor->run(graph, nullptr); }),
      std::logic_error);
  EXPECT_NO_THROW(executor->run(graph, nullptr));
}

TEST_P(RunTest, a_kernel_may_run_a_loop_on_another_executor) {
  std::vector<std::unique_ptr<TestedExecutor>> inner;
  for (std::uint32_t i = 0; i < executor->worker_count(); ++i) {
    inner.push_back(std::make_unique<TestedExecutor>(GetParam()));
  }
  std::atomic<std::uint32_t> sum = 0;
  parallel_for(*executor, 16, 1, [&](IndexRange, Task& task) {
    parallel_for(inner[task.worker()]->get(), 100, 7,
                 [&](IndexRange items, Task&) { sum += items.size(); });
  });
  EXPECT_EQ(sum, 1600u);
}

TEST_P(RunTest, the_report_adds_up) {
  struct Data {
    std::atomic<std::uint64_t> sink = 0;
  } data;
  TaskGraph graph;
  const Kernel busy = [](void* context, IndexRange, Task&) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(200);
    while (std::chrono::steady_clock::now() < until) ++static_cast<Data*>(context)->sink;
  };
  graph.stage({.name = "wide",
               .domain = 1,
               .kernel = busy,
               .count = [](void*) { return 10u; },
               .chunk = 2,
               .writes = 1});
  graph.stage({.name = "one", .kernel = busy, .reads = 1});
  RunReport report{.record_tasks = true};
  for (int repeat = 0; repeat < 2; ++repeat) {
    executor->run(graph, &data, {.report = &report});
    ASSERT_EQ(report.stages.size(), 2u);
    EXPECT_STREQ(report.stages[0].name, "wide");
    EXPECT_EQ(report.stages[0].items, 10u);
    EXPECT_EQ(report.stages[0].tasks, 5u);
    EXPECT_EQ(report.stages[1].tasks, 1u);
    EXPECT_GE(report.stages[0].busy_ns, 5 * 200'000);
    EXPECT_LE(report.begin_ns, report.stages[0].begin_ns);
    EXPECT_LE(report.stages[0].end_ns, report.stages[1].begin_ns);
    EXPECT_LE(report.stages[1].end_ns, report.end_ns);
    EXPECT_LE(report.blocked_ns + report.helped_ns, report.end_ns - report.begin_ns);
    ASSERT_EQ(report.tasks.size(), 6u);
    std::int64_t busy_ns = 0;
    for (const TaskRecord& task : report.tasks) {
      EXPECT_LT(task.worker, executor->worker_count());
      busy_ns += task.end_ns - task.begin_ns;
    }
    EXPECT_EQ(busy_ns, report.stages[0].busy_ns + report.stages[1].busy_ns);
    EXPECT_TRUE(std::is_sorted(report.tasks.begin(), report.tasks.end(),
                               [](auto& a, auto& b) { return a.begin_ns < b.begin_ns; }));
  }
}

TEST_P(RunTest, parallel_for_covers_every_index_once_in_the_same_chunks) {
  for (const std::uint32_t count : {0u, 1u, 7u, 64u, 1000u}) {
    for (const std::uint32_t chunk : {1u, 3u, 64u, 5000u}) {
      std::vector<std::atomic<int>> seen(count);
      std::atomic<int> wrong_bounds = 0;
      parallel_for(*executor, count, chunk, [&](IndexRange items, Task&) {
        if (items.begin % chunk != 0 || items.end != std::min(count, items.begin + chunk)) {
          ++wrong_bounds;
        }
        for (std::uint32_t i = items.begin; i < items.end; ++i) ++seen[i];
      });
      EXPECT_EQ(wrong_bounds, 0);
      EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](auto& n) { return n == 1; }));
    }
  }
  EXPECT_THROW(parallel_for(*executor, 1, 0, [](IndexRange, Task&) {}), std::invalid_argument);
}

TEST_P(RunTest, parallel_for_reaches_the_last_index_there_is) {
  std::atomic<std::uint32_t> last = 0;
  std::atomic<std::uint64_t> sum = 0;
  parallel_for(*executor, 0xffffffffu, 0x40000000u, [&](IndexRange items, Task&) {
    sum += items.size();
    if (items.end > last) last = items.end;
  });
  EXPECT_EQ(sum, 0xffffffffu);
}

TEST(Settings, wrong_settings_are_refused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(make_executor(ExecutorKind::threads, {.workers = -1}), std::invalid_argument);
  EXPECT_THROW(make_executor(ExecutorKind::serial, {.workers = 1025}), std::invalid_argument);
  EXPECT_THROW(make_executor(ExecutorKind::host_pool, {.workers = 2}), std::invalid_argument);
  EXPECT_THROW(make_executor(ExecutorKind::threads, {.wait = {.spin_us = -1}}),
               std::invalid_argument);
  EXPECT_THROW(make_executor(ExecutorKind::threads, {.wait = {.spin_us = kNan}}),
               std::invalid_argument);
}

TEST(Settings, automatic_workers_are_at_least_one) {
  EXPECT_GE(automatic_worker_count(), 1);
  EXPECT_GE(make_executor(ExecutorKind::job_system)->worker_count(), 1u);
}

}  // namespace
}  // namespace skerry::jobs::test
