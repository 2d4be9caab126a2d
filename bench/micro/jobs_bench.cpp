// What running work costs by itself: empty graphs, empty loops, phase barriers, waking a worker.
// Names end in kind/workers/...; times are real time. The cold ones sleep like a 60 Hz game loop.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <skerry/jobs.h>

namespace skerry::jobs {
namespace {

using Clock = std::chrono::steady_clock;

// The plainest pool that a host might have.
class HostPool : public TaskPool {
 public:
  explicit HostPool(int workers) : executor_threads_(workers) {
    for (int i = 0; i < workers; ++i) threads_.emplace_back([this] { serve(); });
  }
  ~HostPool() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  Handle submit(Function function, void* context, const char*) override {
    auto* job = new Job{function, context};
    {
      const std::lock_guard lock(mutex_);
      queue_.push_back(job);
    }
    changed_.notify_one();
    return job;
  }
  void wait(Handle handle) override {
    const std::unique_ptr<Job> job(static_cast<Job*>(handle));
    {
      const std::lock_guard lock(mutex_);
      const auto queued = std::find(queue_.begin(), queue_.end(), job.get());
      if (queued != queue_.end()) {
        queue_.erase(queued);
        job->done = true;
      }
    }
    if (job->done) return job->function(job->context);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return job->done; });
  }
  int worker_count() const override { return executor_threads_; }

 private:
  struct Job {
    Function function;
    void* context;
    bool done = false;
  };
  void serve() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
      if (queue_.empty()) return;
      Job* job = queue_.front();
      queue_.erase(queue_.begin());
      lock.unlock();
      job->function(job->context);
      lock.lock();
      job->done = true;
      changed_.notify_all();
    }
  }

  int executor_threads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Job*> queue_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

struct Bench {
  Bench(ExecutorKind kind, int workers, Affinity affinity = Affinity::none) {
    ExecutorSettings settings{.workers = workers, .affinity = affinity};
    if (kind == ExecutorKind::host_pool) {
      pool = std::make_unique<HostPool>(workers - 1);
      settings.pool = pool.get();
    }
    executor = make_executor(kind, settings);
  }
  std::unique_ptr<HostPool> pool;
  std::unique_ptr<Executor> executor;
};

void nothing(void*, IndexRange, Task&) {}

void empty_graph(benchmark::State& state, ExecutorKind kind) {
  Bench bench(kind, 2);
  const TaskGraph graph;
  for (auto _ : state) bench.executor->run(graph, nullptr);
}

// Twelve stages of one item, each waiting for the one before.
TaskGraph chain_of_twelve() {
  TaskGraph graph;
  for (int i = 0; i < 12; ++i) {
    graph.stage({.name = "stage", .kernel = nothing, .reads = 1u << i, .writes = 2u << i});
  }
  return graph;
}

void twelve_stages(benchmark::State& state, ExecutorKind kind) {
  Bench bench(kind, 2);
  const TaskGraph graph = chain_of_twelve();
  for (auto _ : state) bench.executor->run(graph, nullptr);
}

void twelve_stages_reported(benchmark::State& state, ExecutorKind kind) {
  Bench bench(kind, 2);
  const TaskGraph graph = chain_of_twelve();
  RunReport report;
  for (auto _ : state) bench.executor->run(graph, nullptr, {.report = &report});
}

// Arg: chunks.
void empty_loop(benchmark::State& state, ExecutorKind kind) {
  Bench bench(kind, 2);
  const auto chunks = static_cast<std::uint32_t>(state.range(0));
  for (auto _ : state) parallel_for(*bench.executor, chunks, 1, nothing, nullptr);
}

struct Phases : PhaseProgram {
  static constexpr std::uint32_t kPhases = 1000;
  std::uint32_t blocks = 2;
  int rounds = 0;  // about 4 ns each
  struct alignas(64) PerWorker {
    std::uint64_t blocks = 0;
    double sink = 1;
  };
  std::vector<PerWorker> by_worker = std::vector<PerWorker>(8);
  std::uint32_t phase_count() const override { return kPhases; }
  std::uint32_t block_count(std::uint32_t) const override { return blocks; }
  void run_block(std::uint32_t, std::uint32_t, std::uint32_t worker) override {
    PerWorker& mine = by_worker[worker];
    ++mine.blocks;
    for (int i = 0; i < rounds; ++i) benchmark::DoNotOptimize(mine.sink *= 1.0000001);
  }
};

void run_program(void* context, IndexRange, Task& task) {
  task.run_phases(*static_cast<Phases*>(context));
}

// Best time per phase in a run of 1000, in nanoseconds.
double phase_ns(Executor& executor, Phases& program, int runs) {
  TaskGraph graph;
  graph.stage({.name = "program", .kernel = run_program});
  double best = 1e30;
  for (int i = 0; i < runs; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));  // a fresh time slice
    const auto begin = Clock::now();
    executor.run(graph, &program);
    const std::chrono::duration<double, std::nano> time = Clock::now() - begin;
    best = std::min(best, time.count() / Phases::kPhases);
  }
  return best;
}

// One phase of `blocks` blocks of `rounds` each, best of 20 runs. barrier_ns: what it takes more
// than half of the serial executor's time; helped: the share of blocks that the other worker ran.
void phase_barrier(benchmark::State& state, ExecutorKind kind) {
  Bench bench(kind, 2, Affinity::spread);
  Phases program;
  program.blocks = static_cast<std::uint32_t>(state.range(0));
  program.rounds = static_cast<int>(state.range(1));
  const double serial_ns = phase_ns(*make_executor(ExecutorKind::serial), program, 20);
  program.by_worker.assign(8, {});
  for (auto _ : state) state.SetIterationTime(phase_ns(*bench.executor, program, 20) * 1e-9);
  const auto helped = double(program.by_worker[1].blocks);
  state.counters["helped"] = helped / (helped + double(program.by_worker[0].blocks));
  state.counters["serial_ns"] = serial_ns;
  if (kind == ExecutorKind::serial) return;
  state.counters["barrier_ns"] = phase_ns(*bench.executor, program, 20) - serial_ns / 2;
}

// 4 ms of work in 40 chunks after everybody slept 12 ms: the time until the second worker has begun,
// and until all is done. wake: wake() is called 0.2 ms before the run.
struct ColdWork {
  Clock::time_point begin;
  std::thread::id caller;
  std::atomic<std::int64_t> joined_ns{0};
};

void cold_kernel(void* context, IndexRange, Task&) {
  auto& work = *static_cast<ColdWork*>(context);
  const auto now = Clock::now();
  if (std::this_thread::get_id() != work.caller) {
    std::int64_t none = 0;
    work.joined_ns.compare_exchange_strong(none, (now - work.begin).count());
  }
  while (Clock::now() < now + std::chrono::microseconds(100)) {
  }
}

void cold_start(benchmark::State& state, ExecutorKind kind, Affinity affinity, bool wake) {
  Bench bench(kind, 2, affinity);
  std::vector<double> joined_us;
  for (auto _ : state) {
    std::this_thread::sleep_for(std::chrono::milliseconds(12));
    if (wake) {
      bench.executor->wake();
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    ColdWork work{Clock::now(), std::this_thread::get_id()};
    parallel_for(*bench.executor, 40, 1, cold_kernel, &work);
    const auto time = Clock::now() - work.begin;
    state.SetIterationTime(std::chrono::duration<double>(time).count());
    const std::int64_t joined = work.joined_ns;
    joined_us.push_back(joined > 0 ? double(joined) / 1e3 : double(time.count()) / 1e3);
  }
  std::sort(joined_us.begin(), joined_us.end());
  state.counters["joined_us_p50"] = joined_us[joined_us.size() / 2];
  state.counters["joined_us_max"] = joined_us.back();
}

const char* name_of(ExecutorKind kind) {
  const char* const names[] = {"serial", "fork_join", "job_system", "host_pool", "threads"};
  return names[static_cast<int>(kind)];
}

void register_for(ExecutorKind kind) {
  const std::string name = name_of(kind);
  const auto add = [&](const std::string& what, auto function, auto... arguments) {
    return benchmark::RegisterBenchmark((what + "/" + name).c_str(), function, kind, arguments...);
  };
  add("jobs/empty_graph", empty_graph)->UseRealTime();
  add("jobs/twelve_stages", twelve_stages)->UseRealTime();
  add("jobs/twelve_stages_reported", twelve_stages_reported)->UseRealTime();
  add("jobs/empty_loop", empty_loop)->UseRealTime()->ArgName("chunks")->Arg(2)->Arg(64);
  add("jobs/phase_barrier", phase_barrier)
      ->ArgNames({"blocks", "rounds"})
      ->Args({2, 0})
      ->Args({8, 250})
      ->Args({2, 1250})
      ->Iterations(1)
      ->UseManualTime();
  if (kind == ExecutorKind::serial) return;
  for (const auto affinity : {Affinity::none, Affinity::spread}) {
    for (const bool wake : {false, true}) {
      const std::string how = std::string("jobs/cold_start/") +
                              (affinity == Affinity::spread ? "spread" : "none") +
                              (wake ? "/wake" : "");
      add(how, cold_start, affinity, wake)
          ->UseManualTime()
          ->Iterations(40)
          ->Unit(benchmark::kMillisecond);
    }
  }
}

const bool kRegistered = [] {
  for (const auto kind : {ExecutorKind::serial, ExecutorKind::fork_join, ExecutorKind::job_system,
                          ExecutorKind::host_pool, ExecutorKind::threads}) {
    register_for(kind);
  }
  return true;
}();

}  // namespace
}  // namespace skerry::jobs
