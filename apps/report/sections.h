#pragma once

#include <string>

#include "apps/report/report.h"

namespace skerry::report {

// All about one scene. `colours`: the legend of the modes.
std::string scene_section(const Json& scene, const std::string& colours);

}  // namespace skerry::report
