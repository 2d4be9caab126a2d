// Per-item chains and overlap, seen from outside: kernels that wait for each other.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/jobs/executors.h"

namespace skerry::jobs::test {
namespace {

using std::chrono::milliseconds;

// Waits for a while; whether it came true.
bool comes_true(const std::atomic<bool>& flag, milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!flag && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  return flag;
}

constexpr milliseconds kLong{10'000};  // the second worker may take its time to come
constexpr milliseconds kShort{30};

// Item 0 of the first stage waits until item 1 of the second has run.
struct TwoStages {
  milliseconds patience{};
  std::atomic<bool> second_ran_item_1 = false;
  std::atomic<bool> seen_from_first = false;
};

TaskGraph two_stages(bool partitioned) {
  TaskGraph graph;
  if (partitioned) graph.partition(1, 1);
  graph.stage({.name = "first",
               .domain = 1,
               .kernel =
                   [](void* context, IndexRange items, Task&) {
                     auto& data = *static_cast<TwoStages*>(context);
                     if (items.begin != 0) return;
                     data.seen_from_first = comes_true(data.second_ran_item_1, data.patience);
                   },
               .count = [](void*) { return 2u; },
               .writes = 1});
  graph.stage({.name = "second",
               .domain = 1,
               .kernel =
                   [](void* context, IndexRange items, Task&) {
                     if (items.begin == 1)
                       static_cast<TwoStages*>(context)->second_ran_item_1 = true;
                   },
               .count = [](void*) { return 2u; },
               .reads = 1});
  return graph;
}

class Overlapping : public EveryExecutor {};
INSTANTIATE_TEST_SUITE_P(EveryExecutor, Overlapping, testing::ValuesIn(every_parallel_executor()),
                         case_name);

TEST_P(Overlapping, a_chain_goes_on_per_item_with_no_barrier) {
  TwoStages data{.patience = kLong};
  executor->run(two_stages(true), &data);
  EXPECT_TRUE(data.seen_from_first);
}

TEST_P(Overlapping, without_a_partition_there_is_a_barrier) {
  TwoStages data{.patience = kShort};
  executor->run(two_stages(false), &data);
  EXPECT_FALSE(data.seen_from_first);
  EXPECT_TRUE(data.second_ran_item_1);
}

TEST(ForkJoin, has_a_barrier_even_within_a_chain) {
  TestedExecutor executor({ExecutorKind::fork_join, 2});
  TwoStages data{.patience = kShort};
  executor->run(two_stages(true), &data);
  EXPECT_FALSE(data.seen_from_first);
  EXPECT_TRUE(data.second_ran_item_1);
}

// Two stages that do not conflict wait for each other.
struct Pair {
  milliseconds patience{};
  std::atomic<bool> here[2] = {false, false};
  std::atomic<bool> met[2] = {false, false};
};

template <int which>
void meet(void* context, IndexRange, Task&) {
  auto& pair = *static_cast<Pair*>(context);
  pair.here[which] = true;
  pair.met[which] = comes_true(pair.here[1 - which], pair.patience);
}

TaskGraph independent_stages() {
  TaskGraph graph;
  graph.stage({.name = "wide",
               .domain = 1,
               .kernel = [](void*, IndexRange, Task&) {},
               .count = [](void*) { return 8u; },
               .writes = 1});
  graph.stage({.name = "left", .kernel = meet<0>, .reads = 1, .writes = 2});
  graph.stage({.name = "right", .kernel = meet<1>, .reads = 1, .writes = 4});
  return graph;
}

TEST_P(Overlapping, independent_stages_run_side_by_side) {
  // The wide stage before them has brought the second worker; it spins for longer than its chunks
  // take. begin() and the caller's late end() make no difference.
  TestedExecutor patient(GetParam(), {.spin_us = 1e6});
  Pair pair{.patience = kLong};
  const TaskGraph graph = independent_stages();
  patient->begin(graph, &pair);
  patient->end();
  EXPECT_TRUE(pair.met[0] && pair.met[1]);
}

TEST(ForkJoin, does_not_overlap_stages) {
  TestedExecutor executor({ExecutorKind::fork_join, 2});
  Pair pair{.patience = kShort};
  executor->run(independent_stages(), &pair);
  EXPECT_FALSE(pair.met[0]);
  EXPECT_TRUE(pair.here[0] && pair.here[1]);
}

TEST_P(Overlapping, the_run_goes_on_while_the_caller_is_away) {
  struct Data {
    std::atomic<bool> done = false;
    std::thread::id caller = std::this_thread::get_id();
    std::atomic<int> on_caller = 0;
  } data;
  TaskGraph graph;
  const Kernel note = [](void* context, IndexRange, Task&) {
    auto& away = *static_cast<Data*>(context);
    if (std::this_thread::get_id() == away.caller) ++away.on_caller;
  };
  graph.stage({.name = "one", .kernel = note, .writes = 1});
  graph.stage({.name = "wide",
               .domain = 1,
               .kernel = note,
               .count = [](void*) { return 100u; },
               .reads = 1,
               .writes = 2});
  graph.stage(
      {.name = "last",
       .kernel = [](void* context, IndexRange, Task&) { static_cast<Data*>(context)->done = true; },
       .reads = 2});
  executor->begin(graph, &data);
  EXPECT_TRUE(comes_true(data.done, kLong));
  executor->end();
  EXPECT_EQ(data.on_caller, 0);
}

TEST_P(Overlapping, end_helps) {
  // The only helper-sized hole is taken by item 0, so item 1 needs the caller.
  struct Data {
    std::atomic<bool> second = false;
    std::atomic<bool> met = false;
  } data;
  TaskGraph graph;
  graph.stage({.name = "pair",
               .domain = 1,
               .kernel =
                   [](void* context, IndexRange items, Task&) {
                     auto& both = *static_cast<Data*>(context);
                     if (items.begin == 1) both.second = true;
                     if (items.begin == 0) both.met = comes_true(both.second, kLong);
                   },
               .count = [](void*) { return 2u; }});
  executor->begin(graph, &data);
  executor->end();
  EXPECT_TRUE(data.met);
}

}  // namespace
}  // namespace skerry::jobs::test
