#include "solver/colouring.h"

#include <algorithm>
#include <bit>

#include "core/growth.h"

namespace skerry::solver {

void Colouring::run(const std::uint32_t* row_a, const std::uint32_t* row_b, std::uint32_t count,
                    std::uint32_t dynamic_end) {
  if (colour.size() < count) colour.resize(count);
  colours = 0;
  left_.clear();
  core::refill(used_, dynamic_end, std::uint64_t{0});
  const std::uint32_t solved = dynamic_end - 1;
  std::uint32_t base = 0;
  const auto place = [&](std::uint32_t contact) {
    const std::uint32_t a = row_a[contact], b = row_b[contact];
    const bool a_solved = a - 1 < solved, b_solved = b - 1 < solved;
    const std::uint64_t taken = (a_solved ? used_[a] : 0) | (b_solved ? used_[b] : 0);
    if (taken == ~std::uint64_t{0}) return false;
    const auto lowest = static_cast<std::uint32_t>(std::countr_one(taken));
    const std::uint64_t bit = std::uint64_t{1} << lowest;
    if (a_solved) used_[a] |= bit;
    if (b_solved) used_[b] |= bit;
    colour[contact] = base + lowest;
    colours = std::max(colours, base + lowest + 1);
    return true;
  };
  for (std::uint32_t contact = 0; contact < count; ++contact) {
    if (!place(contact)) left_.push_back(contact);
  }
  while (!left_.empty()) {
    base += 64;
    std::fill(used_.begin(), used_.end(), 0);
    std::erase_if(left_, place);
  }
}

}  // namespace skerry::solver
