#include "tests/support/shuffling_executor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace skerry::test {
namespace {

using jobs::IndexRange;
using jobs::Task;
using jobs::TaskGraph;

using Log = std::vector<std::pair<char, std::uint32_t>>;  // stage, first item

template <char name>
void note(void* context, IndexRange items, Task&) {
  static_cast<Log*>(context)->emplace_back(name, items.begin);
}
std::uint32_t five(void*) { return 5; }

// a -> (b -> c per item) -> d
TaskGraph graph_of_four() {
  TaskGraph graph;
  graph.partition(1, 2);
  graph.stage({.name = "a", .kernel = note<'a'>, .writes = 1});
  graph.stage(
      {.name = "b", .domain = 1, .kernel = note<'b'>, .count = five, .reads = 1, .writes = 2});
  graph.stage(
      {.name = "c", .domain = 1, .kernel = note<'c'>, .count = five, .reads = 2, .writes = 4});
  graph.stage({.name = "d", .kernel = note<'d'>, .reads = 4});
  return graph;
}

std::size_t at(const Log& log, char stage, std::uint32_t item) {
  return static_cast<std::size_t>(std::find(log.begin(), log.end(), std::pair(stage, item)) -
                                  log.begin());
}

TEST(ShufflingExecutor, keeps_the_order_that_the_graph_asks_for_and_no_other) {
  const TaskGraph graph = graph_of_four();
  std::set<Log> orders;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    ShufflingExecutor executor({.seed = seed});
    Log log;
    executor.run(graph, &log);
    ASSERT_EQ(log.size(), 12u);
    EXPECT_EQ(at(log, 'a', 0), 0u);
    EXPECT_EQ(at(log, 'd', 0), 11u);
    for (std::uint32_t i = 0; i < 5; ++i) EXPECT_LT(at(log, 'b', i), at(log, 'c', i));
    orders.insert(log);
  }
  EXPECT_GT(orders.size(), 40u);
}

TEST(ShufflingExecutor, the_same_seed_gives_the_same_order_and_goes_on) {
  const TaskGraph graph = graph_of_four();
  ShufflingExecutor one({.seed = 3}), two({.seed = 3});
  Log first, second, third;
  one.run(graph, &first);
  two.run(graph, &second);
  two.run(graph, &third);
  EXPECT_EQ(first, second);
  EXPECT_NE(second, third);
}

TEST(ShufflingExecutor, blocks_of_a_phase_are_shuffled_and_phases_are_not) {
  struct Program : jobs::PhaseProgram {
    Log log;
    std::set<std::uint32_t> workers;
    std::uint32_t phase_count() const override { return 3; }
    std::uint32_t block_count(std::uint32_t phase) const override { return phase * 10; }
    void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t worker) override {
      log.emplace_back(char('0' + phase), block);
      workers.insert(worker);
    }
  } program;
  ShufflingExecutor executor({.seed = 1, .workers = 3});
  jobs::parallel_for(executor, 1, 1, [&](IndexRange, Task& task) { task.run_phases(program); });
  EXPECT_EQ(program.workers, (std::set<std::uint32_t>{0, 1, 2}));
  Log sorted = program.log;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_NE(program.log, sorted);
  EXPECT_EQ(std::unique(sorted.begin(), sorted.end()) - sorted.begin(), 30);
  EXPECT_TRUE(std::is_sorted(program.log.begin(), program.log.end(),
                             [](auto& a, auto& b) { return a.first < b.first; }));
}

TEST(ShufflingExecutor, is_usable_after_an_exception_and_reports) {
  ShufflingExecutor executor({.seed = 1, .longest_sleep_us = 50});
  EXPECT_THROW(jobs::parallel_for(executor, 10, 1,
                                  [](IndexRange, Task&) { throw std::runtime_error("no"); }),
               std::runtime_error);
  Log log;
  jobs::RunReport report;
  const TaskGraph graph = graph_of_four();
  executor.begin(graph, &log, {.report = &report});
  executor.end();
  EXPECT_EQ(report.stages[1].tasks, 5u);
  EXPECT_EQ(report.stages[2].items, 5u);
}

}  // namespace
}  // namespace skerry::test
