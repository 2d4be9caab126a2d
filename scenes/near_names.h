#pragma once

#include <span>
#include <string>
#include <string_view>

namespace skerry::scenes {

// ` (did you mean "radius"?)`, or nothing if no name is near enough to be a slip of the pen.
std::string did_you_mean(std::string_view name, std::span<const std::string> known);

}  // namespace skerry::scenes
