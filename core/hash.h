// The state hash: what it covers and how it reads bits. XXH64 (xxhash) over canonical bytes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace skerry::core {

// Order matters; -0.0 counts as +0.0; no padding is ever read.
class StateHasher {
 public:
  StateHasher();
  ~StateHasher();
  StateHasher(const StateHasher&) = delete;
  StateHasher& operator=(const StateHasher&) = delete;
  void add(std::uint64_t value);
  void add(double value);
  std::uint64_t finish();

 private:
  static constexpr std::size_t kBuffer = 512;
  void flush();
  void* state_;
  std::uint64_t buffer_[kBuffer];
  std::size_t used_ = 0;
};

}  // namespace skerry::core
