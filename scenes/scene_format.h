// The fields of every kind of object in a scene file. The reader accepts these and no others; a test
// keeps data/scene.schema.json equal to them.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "scenes/json_document.h"

namespace skerry::scenes {

inline constexpr int kSceneFormatVersion = 1;

struct ObjectSpec {
  std::string_view name;  // of the definition in the schema
  std::vector<std::string_view> required;
  std::vector<std::string_view> optional;
};

std::span<const ObjectSpec> object_specs();

// Throws SceneError unless the node is an object with all the required fields of the kind and no
// unknown ones.
void check_object(const JsonNode& node, std::string_view kind);

}  // namespace skerry::scenes
