// What the figures of a comparison say, in plain sentences.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace skerry::measure {

struct SceneComparison;
struct FrameRow;

// Which mode to use at one host load, by this rule: among the modes that hold the frame rate, the one
// whose input becomes visible soonest; if none holds it, the one that misses least. Ties are modes
// whose intervals overlap with the best one's.
struct LoadVerdict {
  double host_ms = 0;
  std::vector<std::string> holding;  // modes that hold the rate
  std::size_t modes = 0;
  std::vector<std::string> best;  // one, or those that cannot be told apart, by figure
  double input_ms = 0;            // of the first of `best`: p95
  // Of the modes that hold the rate, if it is another one: whose frames are shortest (p95), told
  // apart from the best's.
  std::optional<std::string> shortest = std::nullopt;
  double shortest_frame_ms = 0, best_frame_ms = 0;
  double shortest_input_ms = 0;
};
std::vector<LoadVerdict> load_verdicts(const SceneComparison& comparison);

bool holds_rate(const FrameRow& row);

// The hash sentence first, then steps, then frames and crossovers.
std::vector<std::string> verdict_of(const SceneComparison& comparison);

}  // namespace skerry::measure
