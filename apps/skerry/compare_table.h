#pragma once

#include <string>

#include "apps/measure/compare.h"

namespace skerry::app {

// The figures of a scene that fit a terminal, and the verdict, on standard output.
void print_comparison(const measure::SceneComparison& comparison);

// "trace_islands_job_system.json"
std::string trace_name(const std::string& scene, const std::string& label);

}  // namespace skerry::app
