// results.json: docs/cli.md tells what is in it, docs/results.schema.json exactly.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/measure/compare.h"
#include "apps/measure/machine.h"
#include "apps/measure/scheduling_cost.h"
#include "apps/report/trace_events.h"

namespace skerry::report {

inline constexpr int kResultsVersion = 3;

// A document without scenes. `command` is shown as the way to reproduce it.
Json begin_results(const std::string& command, const measure::CompareOptions& options);
void add(Json& results, const measure::SceneComparison& comparison);
void add(Json& results, const measure::SchedulingCost& cost);

// report.html, results.json and a trace per timeline, into a directory that exists. Returns the
// number of traces; throws std::runtime_error for a file that cannot be written.
int write_files(const std::filesystem::path& directory, const Json& results);

Json to_json(const measure::Machine& machine);
Json to_json(const measure::Summary& summary);
Json to_json(const measure::SceneComparison& comparison);

std::string hash_text(std::uint64_t hash);  // "0x0123456789abcdef"

// A timeline of results.json in the trace event format (chrome://tracing, Perfetto, speedscope).
Json to_trace(const Json& timeline, const std::string& scene);

}  // namespace skerry::report
