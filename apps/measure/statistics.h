#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace skerry::measure {

struct Summary {
  std::size_t count = 0;
  double mean = 0, p50 = 0, p95 = 0, p99 = 0, max = 0;
};

// Zeros for no values.
Summary summarize(std::vector<double> values);

// Of ascending values, at q in [0, 1], interpolated between neighbours. 0 for no values.
double percentile(std::span<const double> ascending, double q);
double median(std::vector<double> values);
double mean(std::span<const double> values);

}  // namespace skerry::measure
