#include "scenes/load.h"

#include <algorithm>
#include <stdexcept>

#include "scenes/catalogue.h"
#include "scenes/json_document.h"
#include "scenes/near_names.h"

namespace skerry::scenes {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSchemaFile = "scene.schema.json";

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::vector<std::string> known_names() {
  std::vector<std::string> names;
  for (const CatalogueEntry& entry : catalogue()) names.emplace_back(entry.name);
  for (const fs::path& file : shipped_scenes()) names.push_back(file.stem().string());
  return names;
}

[[noreturn]] void fail_unknown_scene(const std::string& name) {
  if (name.ends_with(".json") || name.find('/') != std::string::npos) {
    fail_no_file(name);
  }
  throw std::out_of_range("unknown scene '" + name + "'" + did_you_mean(name, known_names()) +
                          "; `skerry scenes` lists them");
}

}  // namespace

std::filesystem::path data_directory() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  // Builds are a few levels below the root (build/release/skerry, build/dev/tests/apps/...).
  fs::path at = program.parent_path();
  for (int level = 0; level < 6 && at.has_relative_path(); ++level, at = at.parent_path()) {
    for (const char* place : {"share/skerry/scenes", "scenes/data"}) {
      if (is_file(at / place / kSchemaFile)) return at / place;
    }
  }
  return {};
}

std::vector<std::filesystem::path> shipped_scenes() {
  std::vector<fs::path> files;
  const fs::path directory = data_directory();
  if (directory.empty()) return files;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const fs::path& path = entry.path();
    if (path.extension() == ".json" && path.filename() != kSchemaFile) files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

SceneDesc load_scene(const std::string& name, const ReadOptions& options) {
  if (find_entry(name)) return make_scene(name, options.seed.value_or(kDefaultSeed));
  if (is_file(name)) return read_scene_file(name, options);
  const fs::path directory = data_directory();
  if (!directory.empty() && name.find('/') == std::string::npos) {
    for (const std::string& file : {name, name + ".json"}) {
      if (is_file(directory / file)) return read_scene_file(directory / file, options);
    }
  }
  fail_unknown_scene(name);
}

}  // namespace skerry::scenes
