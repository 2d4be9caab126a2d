// Finds a scene by what a user types.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scenes/scene_file.h"

namespace skerry::scenes {

// A built-in name, a file, or the name of a shipped scene file with or without ".json". Throws
// SceneError for a bad file and std::out_of_range, with a sentence, if there is no such scene.
SceneDesc load_scene(const std::string& name, const ReadOptions& options = {});

// The shipped scene files: beside the sources for a program in a build directory, in
// share/skerry/scenes for an installed one. Empty if neither is there.
std::filesystem::path data_directory();

// Its scene files, by name.
std::vector<std::filesystem::path> shipped_scenes();

}  // namespace skerry::scenes
