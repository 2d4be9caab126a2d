#include "collision/sort_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "tests/collision/instruction_sets.h"

namespace skerry::test {
namespace {

TEST(SortRows, every_width_sorts_lists_of_any_length) {
  std::mt19937 random(31);
  for (std::size_t count = 0; count < 400; ++count) {
    // Ends of the range and neighbours, then anything between.
    std::vector<std::uint32_t> rows = {0, 0x7fffffffu, 1, 0x7ffffffeu};
    while (rows.size() < count) rows.push_back(2 + (random() >> 2));
    rows.resize(count);
    std::shuffle(rows.begin(), rows.end(), random);
    std::vector<std::uint32_t> sorted = rows;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) continue;
    on_every_instruction_set([&](const std::string& name) {
      std::vector<std::uint32_t> wide = rows;
      collision::sort_rows(wide);
      ASSERT_EQ(wide, sorted) << name << ", " << count;
    });
  }
}

}  // namespace
}  // namespace skerry::test
