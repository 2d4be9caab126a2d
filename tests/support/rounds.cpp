#include "tests/support/rounds.h"

#include <algorithm>
#include <cstdlib>

namespace skerry::test {

int rounds(int full) {
  const char* given = std::getenv("SKERRY_TEST_ROUNDS_DIVISOR");
  const int divisor = given ? std::atoi(given) : 1;
  return std::max(1, full / std::max(1, divisor));
}

}  // namespace skerry::test
