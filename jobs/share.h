// A contiguous part of some numbered work, from which several threads claim.
//
// Each worker has a share, the same part of the work in every stage, phase and run, and claims from
// the others' only when its own is empty: so what a worker wrote is mostly read by the same worker,
// and does not travel between caches.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

namespace skerry::jobs {

class Share {
 public:
  static constexpr std::uint32_t kMost = 16;  // shares of one work

  // The part of share `index` of `count`, of numbers below `total`: [begin_of(index), begin_of(index + 1)).
  static std::uint32_t begin_of(std::uint32_t index, std::uint32_t count, std::uint32_t total) {
    return static_cast<std::uint32_t>(std::uint64_t{total} * index / count);
  }

  // Only while it is empty.
  void fill(std::uint32_t begin, std::uint32_t end) {
    range_.store(pack(begin, end), std::memory_order_release);
  }

  bool is_empty() const { return is_empty(range_.load(std::memory_order_relaxed)); }

  // For its owner.
  std::optional<std::uint32_t> take_front() {
    std::uint64_t range = range_.load(std::memory_order_relaxed);
    while (!is_empty(range)) {
      const std::uint32_t next = next_of(range);
      if (replace(range, pack(next + 1, end_of(range)))) return next;
    }
    return std::nullopt;
  }

  // For the others.
  std::optional<std::uint32_t> take_back() {
    std::uint64_t range = range_.load(std::memory_order_relaxed);
    while (!is_empty(range)) {
      const std::uint32_t last = end_of(range) - 1;
      if (replace(range, pack(next_of(range), last))) return last;
    }
    return std::nullopt;
  }

 private:
  static constexpr std::uint64_t pack(std::uint32_t next, std::uint32_t end) {
    return std::uint64_t{end} << 32 | next;
  }
  static constexpr std::uint32_t next_of(std::uint64_t range) { return std::uint32_t(range); }
  static constexpr std::uint32_t end_of(std::uint64_t range) { return std::uint32_t(range >> 32); }
  static constexpr bool is_empty(std::uint64_t range) { return next_of(range) >= end_of(range); }

  bool replace(std::uint64_t& expected, std::uint64_t range) {
    return range_.compare_exchange_weak(expected, range, std::memory_order_acq_rel,
                                        std::memory_order_relaxed);
  }

  std::atomic<std::uint64_t> range_{0};  // not yet claimed: end << 32 | next
};

}  // namespace skerry::jobs
