// Hosts' pools with every habit that the contract allows.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/jobs/executors.h"

namespace skerry::jobs::test {
namespace {

// Chunks, a chain, a once-stage and a phase program.
struct Work {
  std::atomic<std::uint32_t> items = 0;
  std::atomic<std::uint32_t> blocks = 0;
};

class Blocks : public PhaseProgram {
 public:
  explicit Blocks(Work& work) : work_(work) {}
  std::uint32_t phase_count() const override { return 20; }
  std::uint32_t block_count(std::uint32_t phase) const override { return phase % 5; }
  void run_block(std::uint32_t, std::uint32_t, std::uint32_t) override { ++work_.blocks; }

 private:
  Work& work_;
};

void count_items(void* context, IndexRange items, Task&) {
  static_cast<Work*>(context)->items += items.size();
}
std::uint32_t thirty(void*) { return 30; }

const TaskGraph& mixed_graph() {
  static const TaskGraph kGraph = [] {
    TaskGraph graph;
    graph.partition(1, 2 | 4);
    graph.stage({.name = "once", .kernel = count_items, .writes = 1});
    graph.stage({.name = "head",
                 .domain = 1,
                 .kernel = count_items,
                 .count = thirty,
                 .chunk = 2,
                 .reads = 1,
                 .writes = 2});
    graph.stage({.name = "tail",
                 .domain = 1,
                 .kernel = count_items,
                 .count = thirty,
                 .chunk = 2,
                 .reads = 2,
                 .writes = 4});
    graph.stage({.name = "wide",
                 .kernel =
                     [](void* context, IndexRange items, Task& task) {
                       Blocks blocks(*static_cast<Work*>(context));
                       task.run_phases(blocks);
                       count_items(context, items, task);
                     },
                 .reads = 4,
                 .writes = 8});
    graph.stage({.name = "rest", .domain = 1, .kernel = count_items, .count = thirty, .reads = 8});
    return graph;
  }();
  return kGraph;
}

void run_mixed_work(Executor& executor, int times) {
  for (int i = 0; i < times; ++i) {
    Work work;
    if (i % 2 == 0) {
      executor.run(mixed_graph(), &work);
    } else {
      executor.begin(mixed_graph(), &work);
      executor.end();
    }
    ASSERT_EQ(work.items, 92u);
    ASSERT_EQ(work.blocks, 40u);
  }
}

std::unique_ptr<Executor> executor_on(TaskPool& pool, int workers = 0) {
  return make_executor(ExecutorKind::host_pool, {.workers = workers, .pool = &pool});
}

TEST(HostPoolStdThread, pools_with_any_habits_finish_the_run) {
  for (const int threads : {1, 2, 4}) {
    for (const bool last_in_first_out : {false, true}) {
      for (const int delay_us : {0, 300}) {
        ThreadPool pool(threads,
                        {.last_in_first_out = last_in_first_out, .longest_delay_us = delay_us});
        const auto executor = executor_on(pool);
        EXPECT_EQ(executor->worker_count(), static_cast<std::uint32_t>(threads + 1));
        run_mixed_work(*executor, 40);
        EXPECT_EQ(pool.submitted(), pool.waited()) << "each handle is waited for, once";
      }
    }
  }
}

TEST(HostPoolStdThread, fewer_threads_than_promised_finish_the_run) {
  for (const int threads : {0, 1}) {
    ThreadPool pool(threads, {.promised_workers = 7});
    const auto executor = executor_on(pool, 4);
    EXPECT_EQ(executor->worker_count(), 4u);
    run_mixed_work(*executor, 40);
    EXPECT_EQ(pool.submitted(), pool.waited());
  }
}

TEST(HostPool, an_inline_pool_finishes_the_run) {
  InlinePool pool;
  run_mixed_work(*executor_on(pool), 100);
  EXPECT_EQ(pool.submitted, pool.waited);
}

TEST(HostPool, a_pool_that_runs_only_in_wait_finishes_the_run) {
  LazyPool pool;
  run_mixed_work(*executor_on(pool), 100);
  EXPECT_GT(pool.waited, 0);
  EXPECT_EQ(pool.submitted, pool.waited);
}

TEST(HostPool, a_pool_without_workers_is_never_asked) {
  struct Empty : TaskPool {
    Handle submit(Function, void*, const char*) override { throw std::runtime_error("asked"); }
    void wait(Handle) override {}
    int worker_count() const override { return 0; }
  } pool;
  const auto executor = executor_on(pool, 4);
  EXPECT_EQ(executor->worker_count(), 1u);
  run_mixed_work(*executor, 4);
}

TEST(HostPool, a_pool_that_refuses_work_is_done_without) {
  struct Full : TaskPool {
    Handle submit(Function, void*, const char*) override { throw std::runtime_error("full"); }
    void wait(Handle) override { ADD_FAILURE() << "nothing was submitted"; }
    int worker_count() const override { return 2; }
  } pool;
  run_mixed_work(*executor_on(pool), 10);
}

TEST(HostPoolStdThread, a_host_task_may_run_a_graph_on_its_own_pool) {
  for (const int threads : {1, 2}) {
    ThreadPool pool(threads);
    struct HostTask {
      TaskPool* pool;
      std::atomic<int> done = 0;
    } task{&pool};
    std::vector<TaskPool::Handle> handles;
    for (int i = 0; i < 4; ++i) {  // more of them than threads
      handles.push_back(pool.submit(
          [](void* context) {
            auto& host_task = *static_cast<HostTask*>(context);
            run_mixed_work(*executor_on(*host_task.pool), 10);
            ++host_task.done;
          },
          &task, "host task"));
    }
    for (const TaskPool::Handle handle : handles) pool.wait(handle);
    EXPECT_EQ(task.done, 4);
  }
}

TEST(HostPool, a_kernel_never_starts_inside_another_kernel) {
  // An inline pool and a lazy one, shared by two executors, one inside the other: waiting for the
  // inner run may not run chunks of the outer one on top of the kernel that waits.
  struct Depth {
    Executor* inner;
    int depth = 0;
    int deepest = 0;
  };
  const auto check = [](TaskPool& pool) {
    const auto outer = executor_on(pool), inner = executor_on(pool);
    Depth depth{inner.get()};
    parallel_for(*outer, 10, 1, [&](IndexRange, Task&) {
      depth.deepest = std::max(depth.deepest, ++depth.depth);
      parallel_for(*depth.inner, 10, 1, [](IndexRange, Task&) {});
      --depth.depth;
    });
    EXPECT_EQ(depth.deepest, 1);
  };
  InlinePool inline_pool;
  check(inline_pool);
  LazyPool lazy_pool;
  check(lazy_pool);
}

TEST(HostPoolStdThread, tickets_carry_the_name_of_the_stage_that_asks) {
  ThreadPool pool(1);
  const auto executor = executor_on(pool);
  Work work;
  executor->run(mixed_graph(), &work);
  parallel_for(
      *executor, 10, 1, [](IndexRange, Task&) {}, "my loop");
  const auto names = pool.names();
  ASSERT_FALSE(names.empty());
  EXPECT_EQ(names.front(), "head");
  EXPECT_EQ(names.back(), "my loop");
}

}  // namespace
}  // namespace skerry::jobs::test
