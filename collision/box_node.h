// Node of our bounding-volume trees: eight children, their boxes in lanes.
#pragma once

#include <cstdint>

namespace skerry::collision {

struct alignas(32) BoxNode {
  static constexpr std::uint32_t kWidth = 8;
  static constexpr std::uint32_t kItem = 0x80000000u;   // bit of a child that is an item
  static constexpr std::uint32_t kEmpty = 0xffffffffu;  // no child; its box is inverted

  float min[3][kWidth];
  float max[3][kWidth];
  std::uint32_t child[kWidth];  // node, kItem | item, or kEmpty
};

}  // namespace skerry::collision
