// Values of a scene file with their units and limits checked. All throw SceneError naming the place.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <skerry/types.h>

#include "scenes/json_document.h"

namespace skerry::scenes {

double read_number(const JsonNode& node);
double read_positive(const JsonNode& node);
double read_not_negative(const JsonNode& node);
double read_within(const JsonNode& node, double low, double high);
// Whole number in [low, high]; high at most 2^53.
std::int64_t read_integer(const JsonNode& node, std::int64_t low, std::int64_t high);
bool read_bool(const JsonNode& node);
const std::string& read_string(const JsonNode& node);
// A string that names something: not empty, no control characters.
const std::string& read_name(const JsonNode& node);

Vec3 read_vec3(const JsonNode& node);
Vec3 read_positive3(const JsonNode& node);
// One number for all three or a list of three.
Vec3 read_scale(const JsonNode& node);
Vec3 read_amplitude(const JsonNode& node);  // the same, zero allowed
Vec3 read_direction(const JsonNode& node);  // normalised; not zero
std::array<bool, 3> read_bool3(const JsonNode& node);
// [x, y, z, w] (normalised), {"axis", "degrees"} or {"euler_degrees"}.
Quat read_orientation(const JsonNode& node);

const std::vector<const JsonNode*>& read_list(const JsonNode& node, std::size_t least);

// One of the choices; otherwise an error that names the nearest.
std::size_t read_choice(const JsonNode& node, std::span<const std::string_view> choices);

// Calls `use` with the member if the object has it.
template <class Use>
void if_given(const JsonNode& object, std::string_view member, Use&& use) {
  if (const JsonNode* node = object.find(member)) use(*node);
}

}  // namespace skerry::scenes
