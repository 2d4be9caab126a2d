// The page that people read: one HTML file without any other file or the network.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace skerry::report {

using Json = nlohmann::ordered_json;

// From the contents of results.json (docs/results.schema.json). Throws Json::exception if a key is
// missing.
std::string html(const Json& results);

}  // namespace skerry::report
