#pragma once

namespace skerry::test {

// How many rounds of random input a test makes: `full`, or that divided by SKERRY_TEST_ROUNDS_DIVISOR of
// the environment where more rounds find nothing new (sanitizers, -O0); at least one.
int rounds(int full);

}  // namespace skerry::test
