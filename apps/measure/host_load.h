// The game's own work beside physics: what a frame loop does on its main thread and in its jobs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <skerry/jobs.h>

namespace skerry::measure {

// The game's pool. Its threads are those that run the step where the mode has some (they share
// oneTBB's workers), so that no mode has more threads than another.
class HostPool {
 public:
  // threads: the calling thread included; 1: that alone.
  HostPool(int threads, const jobs::WaitPolicy& wait, jobs::Affinity affinity);
  ~HostPool();

  int threads() const { return threads_; }
  // Calls job(begin, end) for parts of [0, count) of `chunk` at most, on all threads; returns when
  // all are done.
  void parallel_for(std::uint32_t count, std::uint32_t chunk,
                    const std::function<void(std::uint32_t begin, std::uint32_t end)>& job);

  // Keeps what ran when and where from now on.
  void record(bool on) { report_.record_tasks = on; }
  std::vector<jobs::TaskRecord> take_tasks();

 private:
  struct Loop {
    std::uint32_t count = 0;
    const std::function<void(std::uint32_t, std::uint32_t)>* job = nullptr;
  };

  int threads_;
  std::unique_ptr<jobs::Executor> executor_;
  jobs::RunReport report_;
  std::vector<jobs::TaskRecord> tasks_;
};

// A game's own work of one frame. `ms` is how much was asked for (--host-ms): milliseconds on one
// undisturbed thread. The amount must depend on `ms` alone, never on the clock: work that is
// disturbed must last longer. Called from the main thread, one call at a time.
class HostLoad {
 public:
  virtual ~HostLoad() = default;
  virtual void run(double ms) = 0;                       // on the main thread alone
  virtual void run_jobs(double ms, HostPool& pool) = 0;  // spread over the pool
};

// How the host's work of a frame is done.
enum class HostShape : std::uint8_t {
  serial,  // one block on the main thread
  jobs,    // jobs in the pool
  mixed,   // half and half, the serial half first
};
const char* to_string(HostShape shape);

}  // namespace skerry::measure
