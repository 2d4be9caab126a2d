// What runs a task graph: the calling thread alone, fork-join, a job system, or a host's pool.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <stop_token>
#include <vector>

#include <skerry/jobs/task_graph.h>
#include <skerry/jobs/task_pool.h>

namespace skerry::jobs {

enum class ExecutorKind : std::uint8_t {
  serial,      // the caller; never touches a thread
  fork_join,   // a parallel loop and a barrier per stage (oneTBB)
  job_system,  // dependencies and per-item chains; the caller may leave and come back (oneTBB)
  host_pool,   // as job_system, on ExecutorSettings::pool
  threads,     // as job_system, on our own std::thread workers: for sanitizers, and a measured row
};

// What a worker or waiting caller does when there is nothing to run but the run is not over.
struct WaitPolicy {
  // Microseconds of spinning before the thread blocks. 0 blocks at once. With no run in progress
  // idle workers always sleep.
  double spin_us = 50;
};

enum class Affinity : std::uint8_t {
  none,    // wherever the operating system puts them
  spread,  // one core each: worker i on the i-th allowed core; the caller too while it runs a graph
};

struct ExecutorSettings {
  // Threads that run the graph, the caller included. 0: min(affinity mask, cgroup quota, cores).
  int workers = 0;
  WaitPolicy wait = {};
  Affinity affinity = Affinity::none;
  TaskPool* pool = nullptr;  // for host_pool; must outlive the executor
};

struct StageTiming {
  const char* name = "";
  std::int64_t begin_ns = 0;  // first kernel entered, monotonic clock
  std::int64_t end_ns = 0;    // last kernel left
  std::int64_t busy_ns = 0;   // sum over kernels: the stage's work
  std::uint32_t items = 0;
  std::uint32_t tasks = 0;
};

// One task as it ran, for traces.
struct TaskRecord {
  const char* name = "";
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  std::uint32_t worker = 0;
  std::uint32_t first_item = 0;
  std::uint32_t item_count = 0;
  // What the task would take with any number of workers: its duration, or less if it ran a phase
  // program (the sum over phases of the longest block). Known to the serial executor alone; the
  // others put the duration here.
  std::int64_t critical_ns = 0;
};

// What one run took. Reused from run to run, so that a steady state allocates nothing.
struct RunReport {
  std::vector<StageTiming> stages;  // in graph order
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  std::int64_t blocked_ns = 0;     // the caller had nothing to run (spinning included)
  std::int64_t helped_ns = 0;      // the caller ran kernels
  std::int64_t phase_wait_ns = 0;  // kernels waited in run_phases for other workers' blocks; a sum
  bool record_tasks = false;       // in: fill `tasks`
  std::vector<TaskRecord> tasks;   // by begin time, per worker merged
};

struct RunOptions {
  std::stop_token stop = {};  // request_stop() makes the run throw Cancelled
  RunReport* report = nullptr;
  const char* name = nullptr;  // what a host's pool sees; null: the stage that asks for help
};

class Cancelled : public std::exception {
 public:
  const char* what() const noexcept override { return "the run was cancelled"; }
};

// Threads: one run at a time; run(), or begin() and end() in turn, from any one thread. The graph,
// the context and the report must live until the run is over.
class Executor {
 public:
  virtual ~Executor() = default;

  // Runs all stages; returns when all are done. The calling thread works too.
  virtual void run(const TaskGraph& graph, void* context, const RunOptions& options = {}) = 0;

  // Starts a run and returns; end() helps until it is over and rethrows. Executors without
  // background workers do all the work in end(). A kernel never runs work that is not part of this
  // run while it waits.
  virtual void begin(const TaskGraph& graph, void* context, const RunOptions& options = {}) = 0;
  virtual void end() = 0;
  void begin(TaskGraph&&, void*, const RunOptions& = {}) = delete;  // it would not live that long

  // Upper bound of worker indices that tasks see (>= 1).
  virtual std::uint32_t worker_count() const = 0;

  // Wakes sleeping workers early, so that they are running when the next run begins (a frame loop
  // calls it shortly before the frame is due). A hint; does nothing without background workers.
  virtual void wake() {}
};

// Throws std::invalid_argument for negative or absurd (> 1024) worker counts or a missing pool.
std::unique_ptr<Executor> make_executor(ExecutorKind kind, const ExecutorSettings& settings = {});

// min(affinity mask, ceil(cgroup CPU quota), physical cores), at least 1.
int automatic_worker_count();

}  // namespace skerry::jobs
