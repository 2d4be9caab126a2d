// Waiting without a system call, for a while.
#pragma once

#include <cstdint>

#include "core/clock.h"

namespace skerry::jobs {

inline void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

// Spins until `done()` holds or the time is up; returns done(). Looks at the clock every 16 pauses
// (under a microsecond), and not before it has looked at the condition that often.
template <class Done>
bool spin_until(Done&& done, std::int64_t spin_ns) {
  if (done()) return true;
  if (spin_ns <= 0) return false;
  std::int64_t deadline = 0;
  while (true) {
    for (int i = 0; i < 16; ++i) {
      pause();
      if (done()) return true;
    }
    const std::int64_t now = core::now_ns();
    if (deadline == 0) deadline = now + spin_ns;
    if (now >= deadline) return false;
  }
}

}  // namespace skerry::jobs
