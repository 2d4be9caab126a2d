// Scene files: docs/scene-format.md, data/scene.schema.json.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "scenes/scene.h"
#include "scenes/scene_error.h"

namespace skerry::scenes {

struct ReadOptions {
  std::optional<std::uint64_t> seed = std::nullopt;  // instead of the file's
};

// Reads and checks the whole scene, down to a trial build in a world of its own; throws SceneError.
// A scene that is returned can be built.
SceneDesc read_scene_file(const std::filesystem::path& file, const ReadOptions& options = {});

// The same from memory: `name` is for messages, mesh files are looked for in `directory`.
SceneDesc read_scene_text(const std::string& text, const std::string& name,
                          const std::filesystem::path& directory, const ReadOptions& options = {});

}  // namespace skerry::scenes
