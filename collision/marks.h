// Bytes that mark a few rows among many.
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

namespace skerry::collision {

// Calls visit(row) for the rows whose byte is not zero, ascending. Eight rows without a mark cost as
// much as one with.
template <class Visit>
void for_marked(const std::vector<std::uint8_t>& marks, const Visit& visit) {
  const auto size = static_cast<std::uint32_t>(marks.size());
  for (std::uint32_t first = 0; first < size; first += 8) {
    const std::uint32_t count = size - first < 8 ? size - first : 8;
    std::uint64_t any = 0;
    std::memcpy(&any, marks.data() + first, count);
    if (any == 0) continue;
    for (std::uint32_t row = first; row < first + count; ++row)
      if (marks[row] != 0) visit(row);
  }
}

}  // namespace skerry::collision
