#include "core/hash.h"

#include <bit>
#include <new>

#include <xxhash.h>

namespace skerry::core {

static_assert(std::endian::native == std::endian::little, "hashes are over little-endian bytes");

StateHasher::StateHasher() : state_(XXH64_createState()) {
  if (!state_) throw std::bad_alloc();
  XXH64_reset(static_cast<XXH64_state_t*>(state_), 0);
}

StateHasher::~StateHasher() { XXH64_freeState(static_cast<XXH64_state_t*>(state_)); }

void StateHasher::add(std::uint64_t value) {
  buffer_[used_++] = value;
  if (used_ == kBuffer) flush();
}

void StateHasher::add(double value) {
  // All NaNs count as one: which bits an operation gives depends on the order of its operands.
  if (value != value) return add(std::uint64_t{0x7ff8000000000000u});
  add(std::bit_cast<std::uint64_t>(value == 0 ? 0.0 : value));
}

std::uint64_t StateHasher::finish() {
  flush();
  return XXH64_digest(static_cast<XXH64_state_t*>(state_));
}

void StateHasher::flush() {
  XXH64_update(static_cast<XXH64_state_t*>(state_), buffer_, used_ * sizeof(buffer_[0]));
  used_ = 0;
}

}  // namespace skerry::core
