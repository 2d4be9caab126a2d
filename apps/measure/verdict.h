#pragma once

#include <string>
#include <vector>

namespace skerry::measure {

struct SceneComparison;

// What the figures of a comparison say, in plain sentences.
std::vector<std::string> verdict_of(const SceneComparison& comparison);

}  // namespace skerry::measure
