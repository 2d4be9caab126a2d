// Where two worlds that should be equal differ.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <skerry/world.h>

namespace skerry::measure {

struct Difference {
  std::uint64_t step = 0;  // the first with unequal hashes
  std::string where;       // "body 17, position.y: 0.5 instead of 0.25"
};

// The first body by index, and its first value, that differ; "the events" if all bodies are equal.
std::string first_difference(const World& actual, const World& expected);

}  // namespace skerry::measure
