// What the process as a whole has used.
#pragma once

#include <cstdint>

namespace skerry::measure {

double cpu_ms();       // of all threads, user and system
double peak_rss_mb();  // largest resident set so far
// Calls of operator new in this program so far, all threads. Memory that libraries take from malloc
// or from their own allocators directly is not seen. Always 0 in builds under Address- or
// ThreadSanitizer, where operator new is the sanitizer's.
std::uint64_t allocation_count();
bool counts_allocations();

std::int64_t now_ns();  // monotonic

}  // namespace skerry::measure
