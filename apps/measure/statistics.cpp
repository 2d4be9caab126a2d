#include "apps/measure/statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace skerry::measure {

double mean(std::span<const double> values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double percentile(std::span<const double> ascending, double q) {
  if (ascending.empty()) return 0;
  const double at = std::clamp(q, 0.0, 1.0) * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<std::size_t>(std::floor(at));
  const std::size_t above = std::min(below + 1, ascending.size() - 1);
  const double share = at - static_cast<double>(below);
  return ascending[below] + share * (ascending[above] - ascending[below]);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return percentile(values, 0.5);
}

Summary summarize(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {values.size(),
          mean(values),
          percentile(values, 0.50),
          percentile(values, 0.95),
          percentile(values, 0.99),
          values.back()};
}

}  // namespace skerry::measure
