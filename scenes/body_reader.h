// Single bodies, shapes and materials of a scene file.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "scenes/json_document.h"
#include "scenes/scene.h"

namespace skerry::scenes {

// What the names in a file stand for.
struct SceneLibrary {
  std::map<std::string, SceneMaterial> materials;
  std::map<std::string, std::shared_ptr<const MeshData>> meshes;
  std::map<std::string, const JsonNode*> prefabs;
};

// The value of a name, or SceneError: `unknown material "ruber" (did you mean "rubber"?)`.
template <class Value>
const Value& look_up(const std::map<std::string, Value>& names, const JsonNode& node,
                     const std::string& what);

SceneMaterial read_material(const JsonNode& node);

// A "body" object, at its own pose.
BodyDesc read_body(const JsonNode& node, const SceneLibrary& library);

// "position" and "orientation" of an object, identity where not given.
Pose read_pose(const JsonNode& object);

[[noreturn]] void fail_unknown(const JsonNode& node, const std::string& what,
                               std::span<const std::string> known);

template <class Value>
const Value& look_up(const std::map<std::string, Value>& names, const JsonNode& node,
                     const std::string& what) {
  if (node.kind != JsonKind::string) node.refuse("the name of a " + what);
  const auto found = names.find(node.text);
  if (found != names.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [name, value] : names) known.push_back(name);
  fail_unknown(node, what, known);
}

}  // namespace skerry::scenes
