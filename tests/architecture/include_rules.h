#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace skerry::test {

struct Include {
  std::string file;  // from the root of the source tree: "solver/islands.cpp"
  int line;
  std::string path;  // "core/bodies.h", "skerry/world.h", "vector"
  bool quoted;       // "..." rather than <...>
};

// What is wrong with this include, as a sentence; empty when nothing is.
std::string violation(const Include& include);

std::vector<Include> includes_of(const std::filesystem::path& root, const std::string& file);

// .h and .cpp files of our folders, paths from root, sorted.
std::vector<std::string> source_files(const std::filesystem::path& root);

}  // namespace skerry::test
