// What the process has used, and what others have.
#pragma once

#include <cstdint>

namespace skerry::measure {

double cpu_ms();       // of all threads, user and system
double peak_rss_mb();  // largest resident set so far, or since forget_peak_rss()
double rss_mb();
// Gives free memory back to the system and lets the peak begin anew, where the kernel allows it.
void forget_peak_rss();

// Calls of operator new in this program so far, all threads. Memory that libraries take from malloc
// or from their own allocators directly is not seen. Always 0 in builds under Address- or
// ThreadSanitizer, where operator new is the sanitizer's.
std::uint64_t allocation_count();
bool counts_allocations();

struct ContextSwitches {
  std::int64_t voluntary = 0, involuntary = 0;  // all threads that live or have lived
};
ContextSwitches context_switches();

std::int64_t now_ns();  // monotonic

// Shares of all processors' time, 0 to 1, since the object was made. 0 where /proc/stat is missing.
// The kernel counts in ticks of 10 ms: short spans say little.
class MachineLoad {
 public:
  MachineLoad();
  double others() const;  // other programs, and the hypervisor
  double steal() const;   // the hypervisor alone
  // Enough of either to show in the figures, and more than a few ticks.
  bool disturbing() const;

 private:
  struct Times {
    double busy_ms = 0, steal_ms = 0, total_ms = 0;  // of all processors
  };
  static Times read();

  Times before_;
  double own_before_ms_;
};

}  // namespace skerry::measure
