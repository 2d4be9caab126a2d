// Parallel loops inside a kernel, for stages that run once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <skerry/jobs/task_graph.h>

namespace skerry::jobs {

// Calls body(block, worker) for every block below `blocks`, with every worker that has nothing else
// to do; blocks must be independent. Returns when all are done.
template <class Body>
void run_blocks(Task& task, std::uint32_t blocks, const Body& body) {
  class Program final : public PhaseProgram {
   public:
    Program(std::uint32_t block_count, const Body& block_body)
        : blocks_(block_count), body_(block_body) {}
    std::uint32_t phase_count() const override { return 1; }
    std::uint32_t block_count(std::uint32_t) const override { return blocks_; }
    void run_block(std::uint32_t, std::uint32_t block, std::uint32_t worker) override {
      body_(block, worker);
    }

   private:
    std::uint32_t blocks_;
    const Body& body_;
  };
  if (blocks > 1) {
    Program program(blocks, body);
    task.run_phases(program);
  } else if (blocks == 1) {
    body(0u, task.worker());
  }
}

// The same by the caller alone if there is no task.
template <class Body>
void run_blocks(Task* task, std::uint32_t blocks, const Body& body) {
  if (task != nullptr) return run_blocks(*task, blocks, body);
  for (std::uint32_t block = 0; block < blocks; ++block) body(block, 0u);
}

// `count` items in blocks of `grain`.
constexpr std::uint32_t blocks_of(std::uint32_t count, std::uint32_t grain) {
  return (count + grain - 1) / grain;
}
constexpr IndexRange items_of(std::uint32_t block, std::uint32_t grain, std::uint32_t count) {
  return {block * grain, std::min(count, (block + 1) * grain)};
}

// Finds the rows of a table that pass a test, with all workers. An object of its own for the memory
// that it keeps from one use to the next.
class RowFilter {
 public:
  // Appends to `found` the rows below `count` for which keep(row) holds, ascending. Asks once per
  // row, on any worker.
  template <class Keep>
  void run(Task& task, std::uint32_t count, const Keep& keep, std::vector<std::uint32_t>& found) {
    const std::uint32_t blocks = blocks_of(count, kGrain);
    if (rows_.size() < count) rows_.resize(count + count / 2);
    if (counts_.size() < blocks) counts_.resize(blocks + blocks / 2);
    run_blocks(task, blocks, [&](std::uint32_t block, std::uint32_t) {
      const IndexRange range = items_of(block, kGrain, count);
      std::uint32_t* const begin = rows_.data() + range.begin;
      std::uint32_t kept = 0;
      for (std::uint32_t row = range.begin; row < range.end; ++row) {
        begin[kept] = row;
        kept += keep(row) ? 1 : 0;
      }
      counts_[block] = kept;
    });
    for (std::uint32_t block = 0; block < blocks; ++block) {
      const auto begin = rows_.begin() + block * kGrain;
      found.insert(found.end(), begin, begin + counts_[block]);
    }
  }

 private:
  static constexpr std::uint32_t kGrain = 2048;  // rows in a block: some 10 us

  std::vector<std::uint32_t> rows_;    // each block's at its beginning
  std::vector<std::uint32_t> counts_;  // [block]
};

}  // namespace skerry::jobs
