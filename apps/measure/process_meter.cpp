#include "apps/measure/process_meter.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <new>
#include <string>

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
#define SKERRY_SANITIZER_OWNS_NEW
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer) || __has_feature(address_sanitizer)
#define SKERRY_SANITIZER_OWNS_NEW
#endif
#endif

namespace {

std::atomic<std::uint64_t> allocations{0};

}  // namespace

#ifndef SKERRY_SANITIZER_OWNS_NEW

namespace {

void* counted(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}

void* counted(std::size_t size, std::align_val_t alignment) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  const auto step = static_cast<std::size_t>(alignment);
  const std::size_t rounded = (size + step - 1) / step * step;  // aligned_alloc wants a multiple
  if (void* memory = std::aligned_alloc(step, rounded > 0 ? rounded : step)) return memory;
  throw std::bad_alloc();
}

}  // namespace

// Replacements for the whole program; the array and nothrow forms of the library call these.
void* operator new(std::size_t size) { return counted(size); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, alignment);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

#endif

namespace skerry::measure {

double cpu_ms() {
  timespec time = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

namespace {

// A line of /proc/self/status, in MB; below 0 if there is none.
double status_mb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key)) return std::stod(line.substr(key.size())) / 1024;
  }
  return -1;
}

}  // namespace

double peak_rss_mb() {
  const double peak = status_mb("VmHWM:");
  if (peak >= 0) return peak;
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;  // Linux counts in KiB
}

double rss_mb() { return std::max(0.0, status_mb("VmRSS:")); }

void forget_peak_rss() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << '5';
}

std::uint64_t allocation_count() { return allocations.load(std::memory_order_relaxed); }

bool counts_allocations() {
#ifdef SKERRY_SANITIZER_OWNS_NEW
  return false;
#else
  return true;
#endif
}

ContextSwitches context_switches() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return {usage.ru_nvcsw, usage.ru_nivcsw};
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

MachineLoad::Times MachineLoad::read() {
  // cpu user nice system idle iowait irq softirq steal ...
  constexpr std::size_t kIdle = 3, kWait = 4, kSteal = 7;
  std::ifstream stat("/proc/stat");
  std::string label;
  std::array<double, 8> ticks = {};
  stat >> label;
  for (double& value : ticks) stat >> value;
  if (!stat) return {};
  const double ms_per_tick = 1e3 / static_cast<double>(sysconf(_SC_CLK_TCK));
  Times times;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    times.total_ms += ticks[i] * ms_per_tick;
    if (i != kIdle && i != kWait) times.busy_ms += ticks[i] * ms_per_tick;
  }
  times.steal_ms = ticks[kSteal] * ms_per_tick;
  return times;
}

MachineLoad::MachineLoad() : before_(read()), own_before_ms_(cpu_ms()) {}

double MachineLoad::others() const {
  const Times now = read();
  const double total = now.total_ms - before_.total_ms;
  const double busy = now.busy_ms - before_.busy_ms - (cpu_ms() - own_before_ms_);
  return total > 0 ? std::clamp(busy / total, 0.0, 1.0) : 0;
}

double MachineLoad::steal() const {
  const Times now = read();
  const double total = now.total_ms - before_.total_ms;
  return total > 0 ? std::clamp((now.steal_ms - before_.steal_ms) / total, 0.0, 1.0) : 0;
}

bool MachineLoad::disturbing() const {
  constexpr double kOthers = 0.04, kSteal = 0.01;
  constexpr double kLeastMs = 40;
  const double span_ms = read().total_ms - before_.total_ms;
  return (others() > kOthers && others() * span_ms > kLeastMs) ||
         (steal() > kSteal && steal() * span_ms > kLeastMs);
}

}  // namespace skerry::measure
