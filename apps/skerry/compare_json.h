// results.json: docs/cli.md tells what is in it, docs/results.schema.json exactly.
#pragma once

#include <string>
#include <vector>

#include "apps/measure/compare.h"
#include "apps/measure/scheduling_cost.h"
#include "apps/skerry/json_output.h"

namespace skerry::app {

inline constexpr int kResultsVersion = 2;

Json to_json(const measure::SceneComparison& comparison);
Json to_json(const measure::SchedulingCost& cost);
Json to_json(const measure::CompareOptions& options);

// A timeline of results.json in the trace event format.
Json to_trace(const Json& timeline, const std::string& scene);

}  // namespace skerry::app
