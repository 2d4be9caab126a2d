// As much of JSON Schema 2020-12 as data/scene.schema.json uses.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace skerry::test {

// The first violation, with its place; empty if the value is valid. Throws std::runtime_error for a
// keyword that is not known here, so that the schema cannot outgrow the checker in silence.
std::string schema_violation(const nlohmann::json& schema, const nlohmann::json& value);

}  // namespace skerry::test
