// An executor that does whatever the contract allows, from a seed: finds results that depend on the
// order of tasks, without threads.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include <skerry/jobs.h>

namespace skerry::test {

struct Shuffle {
  std::uint64_t seed = 1;
  std::uint32_t workers = 4;           // worker indices are drawn from 0..workers-1
  std::uint32_t longest_sleep_us = 0;  // a random sleep before every eighth task or so
};

// Everything runs on the caller. Ready tasks (a stage's chunk, or a chunk that follows its
// predecessor per item) and the blocks of a phase run in random order, each with a random worker
// index. Chunk bounds are those of every executor. The seed goes on from run to run, so a second
// run is shuffled differently.
class ShufflingExecutor : public jobs::Executor {
 public:
  explicit ShufflingExecutor(const Shuffle& shuffle);

  void run(const jobs::TaskGraph& graph, void* context,
           const jobs::RunOptions& options = {}) override;
  // All work is done in end().
  void begin(const jobs::TaskGraph& graph, void* context,
             const jobs::RunOptions& options = {}) override;
  void end() override;
  std::uint32_t worker_count() const override { return shuffle_.workers; }

 private:
  struct StageState {
    bool released = false;  // its chunks are, or may become, ready
    std::uint32_t items = 0;
    std::uint32_t chunks = 0;
    std::uint32_t finished = 0;        // chunks
    std::vector<bool> chunk_finished;  // [chunk]
    bool is_finished() const { return released && finished == chunks; }
  };
  struct Ready {
    std::uint32_t stage;
    std::uint32_t chunk;
  };
  class ShuffledTask;

  void release_stages();
  bool may_release(std::uint32_t stage) const;
  void release(std::uint32_t stage);
  void release_followers(const Ready& done);
  bool chunk_may_follow(std::uint32_t stage, std::uint32_t chunk) const;
  void run_task(const Ready& ready);
  void maybe_sleep();
  std::uint32_t draw(std::uint32_t below);
  void fill_report();

  Shuffle shuffle_;
  std::mt19937_64 random_;
  const jobs::TaskGraph* graph_ = nullptr;
  void* context_ = nullptr;
  jobs::RunOptions options_;
  std::vector<StageState> stages_;
  std::vector<Ready> ready_;
};

}  // namespace skerry::test
