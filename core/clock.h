// The one clock of timers, traces and reports: monotonic, nanoseconds.
#pragma once

#include <chrono>
#include <cstdint>

namespace skerry::core {
inline std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}
}  // namespace skerry::core
