// Buffers that are refilled every step. A vector that is cleared and then given an exact size takes
// new memory at every new maximum, so a count that creeps up would allocate in step after step; these
// take half as much again, like push_back does.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace skerry::core {

template <class T>
void make_room(std::vector<T>& buffer, std::size_t count) {
  if (count > buffer.capacity()) buffer.reserve(count + count / 2);
}

// At least `count` entries, new ones among them; keeps all it has.
template <class T>
void grow(std::vector<T>& buffer, std::size_t count) {
  if (buffer.size() < count) buffer.resize(std::max(count, buffer.size() + buffer.size() / 2));
}

template <class T>
void refill(std::vector<T>& buffer, std::size_t count, const T& value) {
  make_room(buffer, count);
  buffer.assign(count, value);
}

}  // namespace skerry::core
