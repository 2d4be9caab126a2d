#pragma once

#include <cstddef>
#include <functional>
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

// A figure with its 95 % confidence interval.
struct Estimate {
  double value = 0, low = 0, high = 0;
};
bool overlap(const Estimate& a, const Estimate& b);

// What was measured in each repetition. Values of one repetition are neighbours in time and may
// depend on each other; repetitions are taken as independent.
using Repetitions = std::vector<std::vector<double>>;
using Statistic = std::function<double(std::vector<double>&)>;  // may reorder its argument

std::vector<double> pooled(const Repetitions& repetitions);

// The statistic of all values, and a percentile bootstrap in two stages (Davison and Hinkley,
// "Bootstrap Methods and their Application", 1997, 3.8): repetitions are drawn with replacement, and
// in each drawn one short runs of neighbouring values. The generator starts from a fixed seed: the
// same values give the same interval.
Estimate bootstrap(const Repetitions& repetitions, const Statistic& statistic);
Estimate bootstrap_percentile(const Repetitions& repetitions, double q);

// For values that stand for the same work in each repetition, all of one length: for each place the
// median over repetitions, and the mean of these medians. What disturbs one repetition for a while
// moves nothing. Intervals: repetitions alone are drawn.
Estimate bootstrap_typical(const Repetitions& repetitions);
// Of two such figures; a repetition of one belongs to the same repetition of the other and both are
// drawn together. No repetitions: 0.
Estimate bootstrap_ratio(const Repetitions& dividend, const Repetitions& divisor);

// The serial share of the work that explains the speed-up S on p workers (Karp and Flatt, CACM 33,
// 1990): (1/S - 1/p) / (1 - 1/p). 0 for one worker; below 0 for a speed-up above p.
double karp_flatt(double speed_up, int workers);

}  // namespace skerry::measure
