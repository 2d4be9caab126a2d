// Counts calls of operator new in this test program, all threads.
#pragma once

#include <cstdint>

namespace skerry::jobs::test {
std::uint64_t allocation_count();
}
