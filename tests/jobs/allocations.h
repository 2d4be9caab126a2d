// Counts calls of operator new in this test program, all threads.
#pragma once

#include <cstdint>

namespace skerry::jobs::test {
// False in sanitizer builds, where operator new is the sanitizer's.
bool counts_allocations();
std::uint64_t allocation_count();
}  // namespace skerry::jobs::test
