#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include <skerry/jobs/task_graph.h>

namespace skerry::jobs {
namespace {

constexpr Domain kBody = 1;
constexpr Domain kIsland = 2;
constexpr std::uint64_t kBounds = 1, kPairs = 2, kContacts = 4, kVelocities = 8, kPoses = 16,
                        kSettings = 32;

void nothing(void*, IndexRange, Task&) {}
std::uint32_t ten(void*) { return 10; }

Stage stage(const char* name, Domain domain, std::uint64_t reads, std::uint64_t writes,
            std::uint32_t chunk = 1) {
  return {.name = name,
          .domain = domain,
          .kernel = nothing,
          .count = domain == kOnce ? nullptr : ten,
          .chunk = chunk,
          .reads = reads,
          .writes = writes};
}

std::vector<std::uint32_t> list(std::span<const std::uint32_t> values) {
  return {values.begin(), values.end()};
}

using Indices = std::vector<std::uint32_t>;

TEST(TaskGraph, stages_conflict_when_one_writes_what_the_other_touches) {
  TaskGraph graph;
  graph.stage(stage("write", kOnce, 0, kPoses));
  graph.stage(stage("read", kOnce, kPoses, 0));
  graph.stage(stage("read too", kOnce, kPoses, 0));
  graph.stage(stage("write again", kOnce, 0, kPoses));
  graph.stage(stage("elsewhere", kOnce, kPairs, kBounds));
  EXPECT_TRUE(graph.depends(1, 0));
  EXPECT_TRUE(graph.depends(2, 0));
  EXPECT_FALSE(graph.depends(2, 1)) << "two readers";
  EXPECT_TRUE(graph.depends(3, 1)) << "a writer after a reader";
  EXPECT_TRUE(graph.depends(3, 0)) << "two writers";
  EXPECT_FALSE(graph.depends(4, 3));
  EXPECT_FALSE(graph.depends(0, 1)) << "order is stage order";
}

TEST(TaskGraph, waits_are_direct_conflicts_less_those_implied_by_others) {
  TaskGraph graph;
  graph.stage(stage("a", kOnce, 0, kPoses));
  graph.stage(stage("b", kOnce, kPoses, kBounds));
  graph.stage(stage("c", kOnce, kPoses | kBounds, kPairs));
  graph.stage(stage("d", kOnce, kPoses, kContacts));
  EXPECT_EQ(list(graph.successors(0)), (Indices{1, 3}));
  EXPECT_EQ(list(graph.successors(1)), (Indices{2}));
  EXPECT_EQ(graph.wait_count(0), 0u);
  EXPECT_EQ(graph.wait_count(2), 1u);
  EXPECT_EQ(graph.wait_count(3), 1u);
}

TEST(TaskGraph, same_domain_over_partitioned_data_follows_per_item) {
  TaskGraph graph;
  graph.partition(kIsland, kContacts | kVelocities);
  graph.stage(stage("collide", kIsland, kPoses, kContacts));
  graph.stage(stage("solve", kIsland, kContacts, kVelocities));
  graph.stage(stage("move", kIsland, kVelocities, kPoses));
  EXPECT_TRUE(graph.follows_per_item(1));
  EXPECT_FALSE(graph.follows_per_item(0)) << "nothing goes before it";
  EXPECT_FALSE(graph.follows_per_item(2)) << "collide reads the poses of other items";
  EXPECT_EQ(list(graph.chain(0)), (Indices{0, 1}));
  EXPECT_EQ(list(graph.chain(2)), (Indices{2}));
}

TEST(TaskGraph, chains_grow_as_long_as_the_data_is_partitioned) {
  TaskGraph graph;
  graph.partition(kIsland, kContacts | kVelocities | kPoses);
  graph.stage(stage("collide", kIsland, kPoses, kContacts));
  graph.stage(stage("solve", kIsland, kContacts, kVelocities));
  graph.stage(stage("move", kIsland, kVelocities, kPoses));
  graph.stage(stage("publish", kOnce, kPoses, kBounds));
  EXPECT_EQ(list(graph.chain(0)), (Indices{0, 1, 2}));
  EXPECT_EQ(graph.chain_head(2), 0u);
  EXPECT_FALSE(graph.follows_per_item(3));
  EXPECT_EQ(list(graph.successors(2)), (Indices{3}));
  EXPECT_TRUE(graph.successors(0).empty());
}

TEST(TaskGraph, different_domain_or_chunk_does_not_follow_per_item) {
  TaskGraph graph;
  graph.partition(kIsland, kContacts | kVelocities);
  graph.partition(kBody, kContacts | kVelocities);
  graph.stage(stage("collide", kIsland, 0, kContacts));
  graph.stage(stage("by body", kBody, kContacts, kVelocities));
  graph.stage(stage("other chunk", kBody, kVelocities, kPoses, 2));
  EXPECT_FALSE(graph.follows_per_item(1));
  EXPECT_FALSE(graph.follows_per_item(2));
}

TEST(TaskGraph, a_wait_of_its_own_breaks_the_chain) {
  TaskGraph graph;
  graph.partition(kIsland, kContacts | kVelocities);
  graph.stage(stage("settings", kOnce, 0, kSettings));
  graph.stage(stage("collide", kIsland, 0, kContacts));
  graph.stage(stage("solve", kIsland, kContacts | kSettings, kVelocities));
  EXPECT_FALSE(graph.follows_per_item(2)) << "collide does not wait for settings";
}

TEST(TaskGraph, a_wait_that_the_chain_has_done_keeps_it) {
  TaskGraph graph;
  graph.partition(kIsland, kContacts | kVelocities);
  graph.stage(stage("settings", kOnce, 0, kSettings));
  graph.stage(stage("bounds", kBody, kSettings, kBounds));
  graph.stage(stage("collide", kIsland, kBounds, kContacts));
  graph.stage(stage("solve", kIsland, kContacts | kSettings, kVelocities));
  EXPECT_TRUE(graph.follows_per_item(3));
  EXPECT_EQ(graph.wait_count(2), 1u);
}

TEST(TaskGraph, a_stage_between_that_is_waited_for_breaks_the_chain) {
  TaskGraph graph;
  graph.partition(kIsland, kContacts | kVelocities);
  graph.stage(stage("collide", kIsland, 0, kContacts));
  graph.stage(stage("settings", kOnce, 0, kSettings));
  graph.stage(stage("solve", kIsland, kContacts | kSettings, kVelocities));
  EXPECT_FALSE(graph.follows_per_item(2));
  EXPECT_EQ(graph.wait_count(2), 2u);
}

TEST(TaskGraph, two_stages_may_follow_the_same_one) {
  TaskGraph graph;
  graph.partition(kIsland, kContacts | kVelocities | kPoses | kBounds);
  graph.stage(stage("a", kIsland, 0, kContacts));
  graph.stage(stage("b", kIsland, kContacts, kVelocities));
  graph.stage(stage("c", kIsland, kContacts, kPoses));
  graph.stage(stage("d", kIsland, kVelocities | kPoses, kBounds));
  EXPECT_EQ(list(graph.chain(0)), (Indices{0, 1, 2, 3}));
}

TEST(TaskGraph, partition_may_be_declared_after_the_stages) {
  TaskGraph graph;
  graph.stage(stage("collide", kIsland, 0, kContacts));
  graph.stage(stage("solve", kIsland, kContacts, kVelocities));
  EXPECT_FALSE(graph.follows_per_item(1));
  graph.partition(kIsland, kContacts);
  EXPECT_TRUE(graph.follows_per_item(1));
}

TEST(TaskGraph, wrong_stages_are_refused_by_name) {
  TaskGraph graph;
  Stage good = stage("good", kIsland, 0, 0);
  Stage bad = good;
  bad.kernel = nullptr;
  EXPECT_THROW(graph.stage(bad), std::invalid_argument);
  bad = good;
  bad.count = nullptr;
  EXPECT_THROW(graph.stage(bad), std::invalid_argument);
  bad = good;
  bad.chunk = 0;
  try {
    graph.stage(bad);
    ADD_FAILURE() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "stage 'good' has chunks of 0 items");
  }
  EXPECT_TRUE(graph.stages().empty());
}

}  // namespace
}  // namespace skerry::jobs
