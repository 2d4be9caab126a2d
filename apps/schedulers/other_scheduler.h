// The same step on schedulers that are not ours, for rows of a comparison: what is our task graph
// worth? They get the same graph, kernels and chunks. An exception to the rule that programs use the
// public API: these are executors, and one of them is made of oneTBB.
#pragma once

#include <memory>
#include <vector>

#include <skerry/jobs.h>

namespace skerry::schedulers {

enum class OtherScheduler : std::uint8_t {
  none,         // the mode's own executor
  flow_graph,   // oneTBB: a node per stage, parallel_for over its chunks
  std_threads,  // fork-join on std::thread: a queue-less pool, mutex and condition variables
  openmp,       // fork-join by `omp parallel for`
};
const char* to_string(OtherScheduler scheduler);  // as a row is called

// Those in this build.
std::vector<OtherScheduler> available();

std::unique_ptr<jobs::Executor> make_executor(OtherScheduler scheduler,
                                              const jobs::ExecutorSettings& settings);

// Worlds that are made while one lives run on that scheduler. One at a time, one thread.
class Scope {
 public:
  explicit Scope(OtherScheduler scheduler);  // none: changes nothing
  ~Scope();
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace skerry::schedulers
