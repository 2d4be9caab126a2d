#include "apps/measure/process_meter.h"

#include <sys/resource.h>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <new>

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

double peak_rss_mb() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;  // Linux counts in KiB
}

std::uint64_t allocation_count() { return allocations.load(std::memory_order_relaxed); }

bool counts_allocations() {
#ifdef SKERRY_SANITIZER_OWNS_NEW
  return false;
#else
  return true;
#endif
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace skerry::measure
