// Hands out worker indices so that each is held by one thread at a time.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

namespace skerry::jobs {

// Index 0 is the caller's and never handed out. All functions from any thread.
class WorkerIndices {
 public:
  explicit WorkerIndices(std::uint32_t workers) : workers_(workers), taken_((workers + 63) / 64) {
    for (std::uint32_t i = workers; i < taken_.size() * 64; ++i) take(i);
    take(0);
  }

  // `preferred` if it is free (a thread that keeps its index keeps its scratch memory in cache),
  // else the lowest free one, else nothing.
  std::optional<std::uint32_t> acquire(std::uint32_t preferred) {
    if (preferred < workers_ && take(preferred)) return preferred;
    for (std::uint32_t word = 0; word < taken_.size(); ++word) {
      std::uint64_t free;
      while ((free = ~taken_[word].load(std::memory_order_relaxed)) != 0) {
        const std::uint32_t index = word * 64 + std::uint32_t(std::countr_zero(free));
        if (take(index)) return index;
      }
    }
    return std::nullopt;
  }

  void release(std::uint32_t index) {
    taken_[index / 64].fetch_and(~bit(index), std::memory_order_release);
  }

 private:
  static std::uint64_t bit(std::uint32_t index) { return std::uint64_t{1} << (index % 64); }
  bool take(std::uint32_t index) {
    return (taken_[index / 64].fetch_or(bit(index), std::memory_order_acquire) & bit(index)) == 0;
  }

  std::uint32_t workers_;
  std::vector<std::atomic<std::uint64_t>> taken_;  // bit per index
};

}  // namespace skerry::jobs
