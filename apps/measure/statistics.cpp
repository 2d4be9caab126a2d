#include "apps/measure/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>

namespace skerry::measure {
namespace {

constexpr int kResamples = 1000;
constexpr std::size_t kRun = 5;  // neighbours that are drawn together
constexpr std::uint64_t kSeed = 20240607;

// std::uniform_int_distribution differs between libraries.
std::size_t draw(std::mt19937_64& random, std::size_t below) {
  return static_cast<std::size_t>(random() % below);
}

Estimate interval(double value, std::vector<double>& resampled) {
  std::sort(resampled.begin(), resampled.end());
  return {value, percentile(resampled, 0.025), percentile(resampled, 0.975)};
}

void append_runs(const std::vector<double>& from, std::mt19937_64& random,
                 std::vector<double>& to) {
  for (std::size_t taken = 0; taken < from.size(); taken += kRun) {
    const std::size_t first = draw(random, from.size());
    const std::size_t count = std::min(kRun, from.size() - taken);
    for (std::size_t i = 0; i < count; ++i) to.push_back(from[(first + i) % from.size()]);
  }
}

using Draw = std::vector<std::size_t>;  // repetitions, some of them more than once

double typical(const Repetitions& repetitions, const Draw& draw) {
  std::vector<double> of_place(draw.size()), medians;
  for (std::size_t place = 0; place < repetitions.front().size(); ++place) {
    for (std::size_t i = 0; i < draw.size(); ++i) of_place[i] = repetitions[draw[i]][place];
    medians.push_back(median(of_place));
  }
  return mean(medians);
}

// The figure of each repetition once, and of kResamples random draws.
template <class Figure>
Estimate bootstrap_draws(std::size_t repetitions, const Figure& figure) {
  if (repetitions == 0) return {};
  Draw drawn(repetitions);
  std::iota(drawn.begin(), drawn.end(), std::size_t{0});
  const double value = figure(drawn);
  std::mt19937_64 random(kSeed);
  std::vector<double> resampled(kResamples);
  for (double& result : resampled) {
    for (std::size_t& repetition : drawn) repetition = draw(random, repetitions);
    result = figure(drawn);
  }
  return interval(value, resampled);
}

}  // namespace

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

bool overlap(const Estimate& a, const Estimate& b) { return a.low <= b.high && b.low <= a.high; }

std::vector<double> pooled(const Repetitions& repetitions) {
  std::vector<double> all;
  for (const auto& values : repetitions) all.insert(all.end(), values.begin(), values.end());
  return all;
}

Estimate bootstrap(const Repetitions& repetitions, const Statistic& statistic) {
  std::vector<double> values = pooled(repetitions);
  if (values.empty()) return {};
  const double value = statistic(values);
  std::mt19937_64 random(kSeed);
  std::vector<double> resampled(kResamples);
  for (double& result : resampled) {
    values.clear();
    for (std::size_t i = 0; i < repetitions.size(); ++i) {
      append_runs(repetitions[draw(random, repetitions.size())], random, values);
    }
    result = values.empty() ? value : statistic(values);
  }
  return interval(value, resampled);
}

Estimate bootstrap_percentile(const Repetitions& repetitions, double q) {
  return bootstrap(repetitions, [q](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return percentile(values, q);
  });
}

Estimate bootstrap_typical(const Repetitions& repetitions) {
  return bootstrap_draws(repetitions.size(),
                         [&](const Draw& draw) { return typical(repetitions, draw); });
}

Estimate bootstrap_ratio(const Repetitions& dividend, const Repetitions& divisor) {
  return bootstrap_draws(std::min(dividend.size(), divisor.size()), [&](const Draw& draw) {
    return typical(dividend, draw) / typical(divisor, draw);
  });
}

double karp_flatt(double speed_up, int workers) {
  if (workers < 2 || speed_up <= 0) return 0;
  const double p = workers;
  return (1 / speed_up - 1 / p) / (1 - 1 / p);
}

}  // namespace skerry::measure
