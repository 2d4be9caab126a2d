// The include table of the rooms, checked on every #include line of the source tree.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <utility>

#include "tests/architecture/include_rules.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

TEST(Architecture, every_include_obeys_the_room_table) {
  const auto files = source_files(source_dir());
  ASSERT_FALSE(files.empty()) << "no sources under " << source_dir();
  for (const std::string& file : files) {
    for (const Include& include : includes_of(source_dir(), file)) {
      const std::string what = violation(include);
      if (!what.empty()) ADD_FAILURE() << file << ':' << include.line << ": " << what;
    }
  }
}

TEST(Architecture, every_header_is_guarded) {
  for (const std::string& file : source_files(source_dir())) {
    // Highway's per-target headers (-inl.h) are included once per target on purpose.
    if (!file.ends_with(".h") || file.ends_with("-inl.h")) continue;
    std::ostringstream text;
    text << std::ifstream(source_dir() / file).rdbuf();
    EXPECT_NE(text.str().find("#pragma once"), std::string::npos) << file << ":1: no #pragma once";
  }
}

TEST(Architecture, no_file_opens_private_members) {
  const std::string forbidden = std::string("#define ") + "private";
  for (const std::string& file : source_files(source_dir())) {
    std::ifstream input(source_dir() / file);
    std::string text;
    for (int line = 1; std::getline(input, text); ++line) {
      EXPECT_FALSE(text.starts_with(forbidden)) << file << ':' << line << ": " << text;
    }
  }
}

// The checker itself: what it must let through, and what it must catch.
using FileAndInclude = std::pair<const char*, std::string>;

std::string verdict(const FileAndInclude& pair) {
  const auto& [file, text] = pair;
  return violation({file, 1, text.substr(1, text.size() - 2), text[0] == '"'});
}

TEST(Architecture, rules_allow_what_the_rooms_need) {
  const FileAndInclude allowed[] = {
      {"include/skerry/world.h", "<skerry/ids.h>"},
      {"include/skerry/world.h", "<Eigen/Geometry>"},
      {"core/bodies.h", "<vector>"},
      {"core/bodies.h", "\"core/vec.h\""},
      {"jobs/tbb_executor.cpp", "<tbb/task_arena.h>"},
      {"jobs/tbb_executor.cpp", "<oneapi/tbb/task_arena.h>"},
      {"jobs/fork_join.cpp", "\"core/assert.h\""},
      {"collision/fcl_distance.cpp", "<fcl/narrowphase/distance.h>"},
      {"collision/fcl_distance.h", "<fcl/fcl.h>"},
      {"collision/box_box_simd.cpp", "<hwy/highway.h>"},
      {"solver/islands.cpp", "\"core/contacts.h\""},
      {"pipeline/step.cpp", "\"collision/find_pairs.h\""},
      {"pipeline/snapshot.cpp", "<zstd.h>"},
      {"scenes/pyramid.cpp", "<skerry/world.h>"},
      {"apps/skerry/main.cpp", "\"scenes/catalogue.h\""},
      {"apps/skerry/main.cpp", "<CLI/CLI.hpp>"},
      {"bench/micro/islands.cpp", "\"solver/islands.h\""},
      {"tests/solver/islands_test.cpp", "\"solver/islands.h\""},
  };
  for (const auto& pair : allowed) {
    EXPECT_EQ(verdict(pair), "") << pair.first << " includes " << pair.second;
  }
}

TEST(Architecture, rules_catch_what_breaks_the_table) {
  const FileAndInclude forbidden[] = {
      {"include/skerry/world.h", "\"core/bodies.h\""},
      {"include/skerry/world.h", "<tbb/task_arena.h>"},
      {"include/skerry/world.h", "\"skerry/ids.h\""},
      {"include/skerry/jobs/executor.h", "<skerry/world.h>"},
      {"core/bodies.h", "\"vec.h\""},
      {"core/arena.h", "<mutex>"},
      {"core/bodies.h", "\"jobs/team.h\""},
      {"jobs/fork_join.cpp", "<tbb/task_arena.h>"},
      {"jobs/tbb_executor.h", "<tbb/task_arena.h>"},
      {"jobs/fork_join.cpp", "\"core/contacts.h\""},
      {"jobs/fork_join.cpp", "<skerry/shapes.h>"},
      {"collision/box_box.cpp", "<fcl/fcl.h>"},
      {"collision/box_box.cpp", "<thread>"},
      {"collision/box_box.cpp", "\"jobs/fork_join_executor.h\""},
      {"collision/box_box.cpp", "\"solver/islands.h\""},
      {"solver/islands.cpp", "\"collision/box_box.h\""},
      {"pipeline/step.cpp", "\"collision/fcl_distance.h\""},
      {"pipeline/step.cpp", "\"scenes/pyramid.h\""},
      {"scenes/pyramid.cpp", "\"core/bodies.h\""},
      {"apps/skerry/main.cpp", "\"pipeline/step.h\""},
      {"apps/embed_jobs_only/main.cpp", "<skerry/skerry.h>"},
      {"bench/modes/main.cpp", "\"core/hash.h\""},
  };
  for (const auto& pair : forbidden) {
    EXPECT_NE(verdict(pair), "") << pair.first << " includes " << pair.second;
  }
}

}  // namespace
}  // namespace skerry::test
