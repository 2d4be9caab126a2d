// A task graph that is built once and run many times. A stage names its kernel, how its work splits
// into items, and what it reads and writes; order, barriers and per-item chains follow from that.
// Knows nothing of physics.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace skerry::jobs {

struct IndexRange {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  constexpr std::uint32_t size() const { return end - begin; }
  constexpr bool empty() const { return begin == end; }
};

// Work in phases: all blocks of a phase may run at once, a phase starts when the one before it is
// complete. For kernels whose one item is so large that several workers should share it (graph
// colours of a big island). Blocks must be independent within a phase.
class PhaseProgram {
 public:
  virtual ~PhaseProgram() = default;
  virtual std::uint32_t phase_count() const = 0;
  virtual std::uint32_t block_count(std::uint32_t phase) const = 0;
  // `worker` is below Executor::worker_count() and held by no other thread meanwhile.
  virtual void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t worker) = 0;
};

// What a running kernel may know of its surroundings.
class Task {
 public:
  virtual ~Task() = default;
  // Index of the worker that runs this task, below Executor::worker_count(); stable for the task,
  // held by one thread at a time. For scratch memory only: no result may depend on it.
  virtual std::uint32_t worker() const = 0;
  // Runs a program to its end, with every worker that has nothing else to do. Finishes on the
  // calling thread alone if none comes; never waits for a worker that has not begun a block.
  virtual void run_phases(PhaseProgram& program) = 0;
};

// Runs the items of a range. May throw: the rest of the run is cancelled and the exception reaches
// the caller of Executor::run (of several, that of the earliest stage and lowest item seen).
using Kernel = void (*)(void* context, IndexRange items, Task& task);

// Number of items of a stage in this run; asked once all stages it depends on have finished.
// Asked once per run; a chain of stages that follow each other per item asks its first stage only.
using ItemCount = std::uint32_t (*)(void* context);

// What the items of a stage are (bodies, pairs, island groups). Items of two stages with the same
// domain correspond one to one. `kOnce` means: one item, run once.
using Domain = std::uint32_t;
inline constexpr Domain kOnce = 0;

struct Stage {
  const char* name = "";  // static storage; the name in timers, traces and tables
  Domain domain = kOnce;
  Kernel kernel = nullptr;
  ItemCount count = nullptr;  // null for kOnce
  std::uint32_t chunk = 1;    // items per task
  std::uint64_t reads = 0;    // bit per kind of data
  std::uint64_t writes = 0;
};

class TaskGraph {
 public:
  // Declares that the rows of these kinds of data belong to one item of `domain` each: a kernel of
  // that domain touches only the rows of its own items.
  void partition(Domain domain, std::uint64_t data);

  // Appends a stage. It starts once every earlier stage it conflicts with has finished (one writes
  // what the other reads or writes).
  // Throws std::invalid_argument if the kernel is null, or the count is null for a domain other
  // than kOnce, or the chunk is 0.
  void stage(const Stage& stage);

  std::span<const Stage> stages() const { return stages_; }

  // True if stage `later` must wait for stage `earlier` (direct conflict).
  bool depends(std::uint32_t later, std::uint32_t earlier) const;

  // True if stage `index` may follow its predecessor (the latest stage it depends on) item by item
  // with no barrier: same domain and chunk, all data they conflict over is partitioned by that
  // domain, and every other stage it depends on is one the predecessor (or the chain it is in)
  // waits for as well.
  bool follows_per_item(std::uint32_t index) const { return links_[index].head != index; }

  // What executors run from, derived as stages are added so that a run allocates nothing.
  //
  // A chain is a stage and all that follow it per item, in stage order; a task runs the whole chain
  // for its items. Most chains are one stage long.
  std::uint32_t chain_head(std::uint32_t index) const { return links_[index].head; }
  std::span<const std::uint32_t> chain(std::uint32_t head) const { return links_[head].chain; }
  // The chain heads that wait for stage `index`, less those that wait for it anyhow through another
  // stage; and of how many such stages a head must wait for the end.
  std::span<const std::uint32_t> successors(std::uint32_t index) const {
    return links_[index].successors;
  }
  std::uint32_t wait_count(std::uint32_t head) const { return links_[head].wait_count; }

 private:
  struct Links {
    std::uint32_t head = 0;
    std::uint32_t wait_count = 0;
    std::vector<std::uint32_t> chain;
    std::vector<std::uint32_t> successors;
    std::vector<bool> ancestors;  // [earlier stage] over by the time this one is over
  };
  void link(std::uint32_t index);
  bool may_follow(std::uint32_t index, const std::vector<std::uint32_t>& dependencies) const;
  bool conflicts_stay_within_items(std::uint32_t later, std::uint32_t earlier) const;

  std::vector<Stage> stages_;
  std::vector<std::uint64_t> partitioned_;  // [domain] data bits
  std::vector<Links> links_;                // [stage]
};

}  // namespace skerry::jobs
