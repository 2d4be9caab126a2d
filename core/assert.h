// Asserts with a sentence. On in builds where SKERRY_ASSERTS is 1, nothing otherwise.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace skerry::core {
[[noreturn]] inline void assertion_failed(const char* condition, const char* sentence,
                                          const char* file, int line) {
  std::fprintf(stderr, "%s:%d: %s\n  assertion: %s\n", file, line, sentence, condition);
  std::abort();
}
}  // namespace skerry::core

#if SKERRY_ASSERTS
#define SKERRY_ASSERT(condition, sentence) \
  ((condition) ? void(0)                   \
               : ::skerry::core::assertion_failed(#condition, sentence, __FILE__, __LINE__))
#else
#define SKERRY_ASSERT(condition, sentence) void(sizeof((condition) ? 1 : 0))
#endif
