// The stage table: what follows from it, and that the documents say the same.
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "pipeline/stages.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

using pipeline::Per;

const char* name_of(jobs::Domain domain) {
  switch (static_cast<Per>(domain)) {
    case Per::step:
      return "step";
    case Per::body:
      return "body";
    case Per::moved_collider:
      return "moved_collider";
    case Per::pair:
      return "pair";
    case Per::island_group:
      return "island_group";
    case Per::fast_pair:
      return "fast_pair";
  }
  return "?";
}

// "name per" of every row of the table in ARCHITECTURE.md.
std::vector<std::string> documented_stages() {
  std::ifstream file(source_dir() / "ARCHITECTURE.md");
  std::vector<std::string> rows;
  bool in_table = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("<!-- stages:")) in_table = true;
    if (in_table && line.empty()) break;
    if (!in_table || !line.starts_with("| `")) continue;
    const std::size_t name_end = line.find('`', 3);
    const std::size_t per_begin = line.find("| ", name_end) + 2;
    const std::size_t per_end = line.find(" |", per_begin);
    rows.push_back(line.substr(3, name_end - 3) + " " +
                   line.substr(per_begin, per_end - per_begin));
  }
  return rows;
}

TEST(StageTable, is_the_one_that_the_architecture_document_shows) {
  std::vector<std::string> rows;
  const jobs::TaskGraph graph = pipeline::describe_step();
  for (const jobs::Stage& stage : graph.stages()) {
    rows.push_back(std::string(stage.name) + " " + name_of(stage.domain));
  }
  EXPECT_EQ(rows, documented_stages());
}

TEST(StageTable, chains_the_stages_of_an_island_group_and_nothing_else) {
  const jobs::TaskGraph graph = pipeline::describe_step();
  std::vector<std::string> chained;
  for (std::uint32_t i = 0; i < graph.stages().size(); ++i) {
    if (graph.follows_per_item(i)) chained.emplace_back(graph.stages()[i].name);
  }
  EXPECT_EQ(chained, (std::vector<std::string>{"finalise_bodies", "write_transforms"}));
}

}  // namespace
}  // namespace skerry::test
