// The built-in scenes by name.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "scenes/scene.h"

namespace skerry::scenes {

struct CatalogueEntry {
  const char* name;
  const char* description;
  SceneDesc (*make)(std::uint64_t seed);  // the same seed, the same scene, everywhere
};

std::span<const CatalogueEntry> catalogue();

// Null if there is none of that name.
const CatalogueEntry* find_entry(std::string_view name);

// Throws std::out_of_range, naming the scene and the nearest name there is.
SceneDesc make_scene(std::string_view name, std::uint64_t seed = kDefaultSeed);

}  // namespace skerry::scenes
