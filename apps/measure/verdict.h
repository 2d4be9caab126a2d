// What the figures of a comparison say, in plain sentences.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace skerry::measure {

struct SceneComparison;
struct FrameRow;

// Whether 19 of 20 frames end before the next is due: told by the interval of the 95th percentile,
// which may reach to both sides. A loop that was given up lost it.
enum class FrameRate { held, edge, lost };
FrameRate frame_rate(const FrameRow& row, double dt);

// Which mode to use at one host load, by this rule: among the modes that hold the frame rate, the one
// whose input becomes visible soonest; if none holds it for sure, the same among those at its edge; if
// there is none, the one that misses least. Ties are modes whose intervals overlap with the best one's.
struct LoadVerdict {
  double host_ms = 0;
  std::vector<std::string> holding;  // modes that hold the rate
  std::vector<std::string> edge;     // modes that may hold it or not
  std::size_t modes = 0;
  std::vector<std::string> best;  // one, or those that cannot be told apart, by figure
  double input_ms = 0;            // of the first of `best`: p95
  // Of the modes that hold the rate, if it is another one: whose frames are shortest (p95), told
  // apart from the best's.
  std::optional<std::string> shortest = std::nullopt;
  double shortest_frame_ms = 0, best_frame_ms = 0;
  double shortest_input_ms = 0;
  // Of the modes at the edge, if others hold the rate: whose input is visible soonest (p95), told
  // apart from the best's.
  std::optional<std::string> sooner = std::nullopt;
  double sooner_input_ms = 0;
};
std::vector<LoadVerdict> load_verdicts(const SceneComparison& comparison);

// The hash sentence first, then steps, then frames and crossovers.
std::vector<std::string> verdict_of(const SceneComparison& comparison);

}  // namespace skerry::measure
