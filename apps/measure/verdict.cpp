#include "apps/measure/verdict.h"

#include <algorithm>
#include <cstdio>

#include "apps/measure/compare.h"

namespace skerry::measure {
namespace {

// A frame rate is held if at most 1 frame in 50 ends late: fewer cannot be told from noise.
constexpr double kMissedAllowed = 0.02;
// Differences below this are not worth a sentence.
constexpr double kNoise = 0.05;

std::string number(double value, int digits) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.*f", digits, value);
  return buffer;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

std::string about_hashes(const SceneComparison& comparison) {
  for (const ThroughputRow& row : comparison.throughput) {
    if (!row.first_difference) continue;
    return std::string(to_string(row.mode)) + " DIFFERS from serial, first at step " +
           std::to_string(*row.first_difference) + ": its figures do not count.";
  }
  if (!comparison.frame_differences.empty()) {
    return std::string(to_string(comparison.frame_differences.front())) +
           " DIFFERS from serial after the frame loop: its figures do not count.";
  }
  return "All modes made the same bits at every step.";
}

std::string about_throughput(const SceneComparison& comparison) {
  const auto best = std::max_element(
      comparison.throughput.begin(), comparison.throughput.end(),
      [](const ThroughputRow& a, const ThroughputRow& b) { return a.speed_up < b.speed_up; });
  if (best->speed_up < 1 + kNoise)
    return "No mode steps faster than serial: more threads do not pay here.";
  return std::string(to_string(best->mode)) + " steps fastest: " + number(best->speed_up, 2) +
         " times serial with " + std::to_string(best->workers) + " workers.";
}

bool holds_rate(const FrameRow& row) {
  const auto frames = static_cast<double>(row.samples.frames());
  return frames > 0 && static_cast<double>(row.samples.missed) <= kMissedAllowed * frames;
}

std::string about_frames(const SceneComparison& comparison, double host_ms) {
  std::vector<std::string> holding;
  const FrameRow* smoothest = nullptr;
  const FrameRow* freshest = nullptr;
  double best_p99 = 0;
  double best_age = 0;
  std::size_t rows = 0;
  for (const FrameRow& row : comparison.frames) {
    if (row.host_ms != host_ms) continue;
    ++rows;
    if (!holds_rate(row)) continue;
    holding.emplace_back(to_string(row.mode));
    const double p99 = summarize(row.samples.latency_ms).p99;
    const double age = median(row.samples.state_age_ms);
    if (!smoothest || p99 < best_p99) smoothest = &row, best_p99 = p99;
    if (!freshest || age < best_age) freshest = &row, best_age = age;
  }
  if (rows == 0) return "";
  std::string text =
      "With " + number(host_ms, host_ms < 1 && host_ms > 0 ? 1 : 0) + " ms of host work ";
  if (holding.empty()) return text + "no mode holds " + number(1 / comparison.dt, 0) + " Hz.";
  text +=
      (holding.size() == rows ? "every mode holds "
                              : joined(holding) + " hold" + (holding.size() == 1 ? "s " : " ")) +
      number(1 / comparison.dt, 0) + " Hz; shortest frames: " + to_string(smoothest->mode) +
      " (p99 " + number(best_p99, 1) + " ms), freshest picture: " + to_string(freshest->mode) +
      " (" + number(best_age, 1) + " ms old).";
  return text;
}

}  // namespace

std::vector<std::string> verdict_of(const SceneComparison& comparison) {
  std::vector<std::string> sentences;
  if (comparison.reps == 0) return {"Stopped before one repetition was complete."};
  sentences.push_back(about_hashes(comparison));
  sentences.push_back(about_throughput(comparison));
  std::vector<double> loads;
  for (const FrameRow& row : comparison.frames) {
    if (std::find(loads.begin(), loads.end(), row.host_ms) == loads.end())
      loads.push_back(row.host_ms);
  }
  for (const double host_ms : loads) sentences.push_back(about_frames(comparison, host_ms));
  return sentences;
}

}  // namespace skerry::measure
