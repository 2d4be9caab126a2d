// Ascending order for short lists of row numbers, as queries of a tree make them.
#pragma once

#include <cstdint>
#include <span>

namespace skerry::collision {

// Sorts numbers below 2^31, none of them twice. Short lists by counting, for each number, those below it,
// many at once: no branch depends on the numbers, whose order nobody can predict.
void sort_rows(std::span<std::uint32_t> rows);

}  // namespace skerry::collision
