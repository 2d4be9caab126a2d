// The two parts of a comparison.
#pragma once

#include "apps/measure/compare.h"

namespace skerry::measure {

WorldSettings base_settings(const scenes::SceneDesc& scene, const CompareOptions& options,
                            double dt);

// Repetitions that count, given which were disturbed: the quiet ones if they are at least three and
// more than half, else all.
std::vector<bool> repetitions_that_count(const std::vector<bool>& disturbed);

void measure_throughput(const scenes::SceneDesc& scene, const CompareOptions& options,
                        SceneComparison& result, const Watcher& watcher);
void measure_frames(const scenes::SceneDesc& scene, const CompareOptions& options, HostLoad& host,
                    SceneComparison& result, const Watcher& watcher);

}  // namespace skerry::measure
