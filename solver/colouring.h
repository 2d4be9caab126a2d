// Greedy colouring of contacts: those of one colour share no dynamic body.
#pragma once

#include <cstdint>
#include <vector>

namespace skerry::solver {

class Colouring {
 public:
  // Colours `count` contacts between the bodies of rows `row_a` and `row_b`, each with the lowest
  // colour that neither body has yet; rows outside [1, dynamic_end) are shared freely. A contact's
  // colour depends on the contacts before it that it is connected with, on nothing else.
  // Linear; bodies with more than 64 contacts are gone over again, 64 colours at a time.
  void run(const std::uint32_t* row_a, const std::uint32_t* row_b, std::uint32_t count,
           std::uint32_t dynamic_end);

  std::vector<std::uint32_t> colour;  // [count]
  std::uint32_t colours = 0;

 private:
  std::vector<std::uint64_t> used_;  // [dynamic_end] colours of a body, of the present 64
  std::vector<std::uint32_t> left_;
};

}  // namespace skerry::solver
