// The page that people read: one HTML file without any other file or the network.
#pragma once

#include <string>

#include "apps/report/results.h"

namespace skerry::report {

// From the contents of results.json (docs/results.schema.json). Throws Json::exception if a key is
// missing.
std::string html(const Json& results);

}  // namespace skerry::report
