// Phase programs: every block once, phases in order, with any number of workers present.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <numeric>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/jobs/executors.h"

namespace skerry::jobs::test {
namespace {

using PhasesTest = EveryExecutor;
INSTANTIATE_TEST_SUITE_P(EveryExecutor, PhasesTest, testing::ValuesIn(every_executor()), case_name);

// Checks that phases do not overlap and counts the runs of each block.
class Program : public PhaseProgram {
 public:
  explicit Program(std::vector<std::uint32_t> blocks) : blocks_(std::move(blocks)) {
    for (const std::uint32_t count : blocks_) runs_.emplace_back(count);
  }
  std::uint32_t phase_count() const override { return std::uint32_t(blocks_.size()); }
  std::uint32_t block_count(std::uint32_t phase) const override { return blocks_[phase]; }
  void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t worker) override {
    const auto before = std::accumulate(blocks_.begin(), blocks_.begin() + phase, 0u);
    if (finished_.load() < before || finished_.load() >= before + blocks_[phase]) ++mistakes;
    if (sleepy && block % 7 == 3) std::this_thread::sleep_for(std::chrono::microseconds(100));
    ++runs_[phase][block];
    if (worker >= 8) ++mistakes;
    ++finished_;
  }
  void expect_all_ran_once() const {
    EXPECT_EQ(mistakes, 0);
    for (const auto& phase : runs_) {
      EXPECT_TRUE(std::all_of(phase.begin(), phase.end(), [](auto& runs) { return runs == 1; }));
    }
  }
  std::atomic<int> mistakes = 0;
  bool sleepy = false;

 private:
  std::vector<std::uint32_t> blocks_;
  std::vector<std::vector<std::atomic<int>>> runs_;
  std::atomic<std::uint32_t> finished_ = 0;
};

std::vector<std::uint32_t> random_blocks(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> blocks(random() % 60);
  for (auto& count : blocks) {
    count = static_cast<std::uint32_t>(random() % 4 == 0 ? random() % 100 : random() % 4);
  }
  return blocks;
}

void run_alone(Executor& executor, PhaseProgram& program) {
  parallel_for(executor, 1, 1, [&](IndexRange, Task& task) { task.run_phases(program); });
}

TEST_P(PhasesTest, random_programs_run_every_block_once_phase_after_phase) {
  for (unsigned seed = 0; seed < 150; ++seed) {
    Program program(random_blocks(seed));
    program.sleepy = seed % 16 == 0;
    run_alone(*executor, program);
    program.expect_all_ran_once();
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST_P(PhasesTest, several_programs_at_once_beside_other_work) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::vector<std::unique_ptr<Program>> programs;
    for (unsigned i = 0; i < 20; ++i) {
      programs.push_back(std::make_unique<Program>(random_blocks(seed * 100 + i)));
    }
    std::atomic<int> others = 0;
    parallel_for(*executor, 40, 1, [&](IndexRange items, Task& task) {
      if (items.begin % 2 == 0) {
        task.run_phases(*programs[items.begin / 2]);
      } else {
        ++others;
      }
    });
    for (const auto& program : programs) program->expect_all_ran_once();
    EXPECT_EQ(others, 20);
  }
}

TEST_P(PhasesTest, a_kernel_may_run_programs_one_after_the_other) {
  parallel_for(*executor, 2, 1, [&](IndexRange, Task& task) {
    for (unsigned seed = 0; seed < 20; ++seed) {
      Program program(random_blocks(seed));
      task.run_phases(program);
      program.expect_all_ran_once();
    }
  });
}

TEST_P(PhasesTest, what_a_phase_wrote_the_next_one_reads) {
  // Plain memory: each block reads a neighbour that another worker may have written.
  struct Ring : PhaseProgram {
    std::vector<std::uint32_t> values = std::vector<std::uint32_t>(64, 0);
    std::vector<std::uint32_t> next = std::vector<std::uint32_t>(64, 0);
    std::uint32_t phase_count() const override { return 200; }
    std::uint32_t block_count(std::uint32_t) const override { return 64; }
    void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t) override {
      auto& from = phase % 2 == 0 ? values : next;
      auto& to = phase % 2 == 0 ? next : values;
      to[block] = from[(block + 17) % 64] + 1;
    }
  } ring;
  run_alone(*executor, ring);
  EXPECT_EQ(ring.values, std::vector<std::uint32_t>(64, 200));
}

TEST_P(PhasesTest, an_exception_of_a_block_leaves_run_phases_and_then_the_run) {
  struct Bad : Program {
    Bad() : Program(std::vector<std::uint32_t>(10, 20)) {}
    void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t worker) override {
      if (phase == 4 && block == 7) throw std::runtime_error("block 7");
      if (phase > 4) ++mistakes;
      Program::run_block(phase, block, worker);
    }
  };
  for (int repeat = 0; repeat < 10; ++repeat) {
    Bad caught_inside, caught_outside;
    parallel_for(*executor, 1, 1, [&](IndexRange, Task& task) {
      EXPECT_THROW(task.run_phases(caught_inside), std::runtime_error);
    });
    EXPECT_THROW(run_alone(*executor, caught_outside), std::runtime_error);
    EXPECT_EQ(caught_inside.mistakes, 0);
    EXPECT_EQ(caught_outside.mistakes, 0);
    Program good({3, 3});
    run_alone(*executor, good);
    good.expect_all_ran_once();
  }
}

TEST_P(PhasesTest, an_exception_of_a_block_count_leaves_too) {
  struct Bad : Program {
    Bad() : Program({2, 2, 2}) {}
    std::uint32_t block_count(std::uint32_t phase) const override {
      return phase < 2 ? 2 : throw std::runtime_error("no count");
    }
  } bad;
  EXPECT_THROW(run_alone(*executor, bad), std::runtime_error);
}

TEST_P(PhasesTest, a_stop_request_ends_a_program_between_phases) {
  struct Long : Program {
    explicit Long(std::stop_source& stop) : Program({}), source(stop) {}
    std::uint32_t phase_count() const override { return 1u << 30; }
    std::uint32_t block_count(std::uint32_t) const override { return 2; }
    void run_block(std::uint32_t phase, std::uint32_t, std::uint32_t) override {
      if (phase == 100) source.request_stop();
      if (phase > 101) ++mistakes;
    }
    std::stop_source& source;
  };
  std::stop_source source;
  Long program(source);
  TaskGraph graph;
  graph.stage({.name = "long", .kernel = [](void* context, IndexRange, Task& task) {
                 task.run_phases(*static_cast<Long*>(context));
               }});
  EXPECT_THROW(executor->run(graph, &program, {.stop = source.get_token()}), Cancelled);
  EXPECT_EQ(program.mistakes, 0);
}

TEST_P(PhasesTest, busy_time_counts_what_helpers_did) {
  struct Slow : Program {
    Slow() : Program(std::vector<std::uint32_t>(10, 4)) {}
    void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t worker) override {
      const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(100);
      while (std::chrono::steady_clock::now() < until) {
      }
      Program::run_block(phase, block, worker);
    }
  } slow;
  TaskGraph graph;
  graph.stage({.name = "island", .kernel = [](void* context, IndexRange, Task& task) {
                 task.run_phases(*static_cast<Slow*>(context));
               }});
  RunReport report{.record_tasks = true};
  executor->run(graph, &slow, {.report = &report});
  EXPECT_GE(report.stages[0].busy_ns, 40 * 100'000);
  EXPECT_EQ(report.stages[0].tasks, 1u) << "kernels, not blocks";
  for (const TaskRecord& task : report.tasks) EXPECT_STREQ(task.name, "island");
}

TEST(SerialExecutor, knows_what_phases_would_gain_from_more_workers) {
  Program program({4, 1});
  TaskGraph graph;
  graph.stage({.name = "island", .kernel = [](void* context, IndexRange, Task& task) {
                 task.run_phases(*static_cast<Program*>(context));
               }});
  graph.stage({.name = "plain", .kernel = [](void*, IndexRange, Task&) {}});
  RunReport report{.record_tasks = true};
  const auto executor = make_executor(ExecutorKind::serial);
  executor->run(graph, &program, {.report = &report});
  ASSERT_EQ(report.tasks.size(), 2u);
  const auto duration = [&](std::size_t i) {
    return report.tasks[i].end_ns - report.tasks[i].begin_ns;
  };
  EXPECT_LE(report.tasks[0].critical_ns, duration(0));
  EXPECT_GE(report.tasks[0].critical_ns, 0);
  EXPECT_EQ(report.tasks[1].critical_ns, duration(1));
  EXPECT_EQ(report.phase_wait_ns, 0);
}

// ---- with two workers for certain ---------------------------------------------------------------

class Team : public EveryExecutor {};
std::vector<ExecutorCase> teams() {
  return {{ExecutorKind::fork_join, 2},
          {ExecutorKind::job_system, 2},
          {ExecutorKind::host_pool, 2},
          {ExecutorKind::threads, 2}};
}
INSTANTIATE_TEST_SUITE_P(EveryExecutor, Team, testing::ValuesIn(teams()), case_name);

TEST_P(Team, an_idle_worker_joins_a_program_of_a_single_item) {
  // The two blocks of the first phase wait for each other.
  struct Meeting : PhaseProgram {
    std::atomic<int> here = 0;
    std::atomic<bool> met = false;
    std::uint32_t phase_count() const override { return 1; }
    std::uint32_t block_count(std::uint32_t) const override { return 2; }
    void run_block(std::uint32_t, std::uint32_t, std::uint32_t) override {
      ++here;
      const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
      while (here < 2 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
      if (here == 2) met = true;
    }
  } meeting;
  run_alone(*executor, meeting);
  EXPECT_TRUE(meeting.met);
}

TEST_P(Team, a_worker_mostly_gets_the_same_blocks_in_every_phase) {
  constexpr std::uint32_t kPhases = 2000, kBlocks = 16;
  struct Affine : PhaseProgram {
    std::vector<std::uint32_t> last = std::vector<std::uint32_t>(kBlocks, 99);
    std::vector<std::uint32_t> moves = std::vector<std::uint32_t>(kBlocks, 0);
    std::vector<std::uint32_t> by_helper = std::vector<std::uint32_t>(kBlocks, 0);
    std::uint32_t phase_count() const override { return kPhases; }
    std::uint32_t block_count(std::uint32_t) const override { return kBlocks; }
    void run_block(std::uint32_t, std::uint32_t block, std::uint32_t worker) override {
      const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(2);
      while (std::chrono::steady_clock::now() < until) {
      }
      moves[block] += last[block] != worker;
      by_helper[block] += worker;
      last[block] = worker;
    }
  } program;
  run_alone(*executor, program);
  const auto moves = std::accumulate(program.moves.begin(), program.moves.end(), 0u);
  const auto helped = std::accumulate(program.by_helper.begin(), program.by_helper.end(), 0u);
  // A machine with a free second core gives about 0.5 helped and few moves; a busy one is allowed
  // its preemptions.
  RecordProperty("moves_per_block_and_phase", std::to_string(moves / 32000.0));
  RecordProperty("helped_share", std::to_string(helped / 32000.0));
  EXPECT_LT(moves / 32000.0, 0.5);
}

}  // namespace
}  // namespace skerry::jobs::test
