// Trees of boxes against a look at every box.
#include "collision/box_tree.h"

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/collision/broadphase_scene.h"
#include "tests/support/rounds.h"

namespace skerry::collision {
namespace {

// The tree holds these items and no others; the first query is for all of them.
template <class RandomBox>
void expect_items(const BoxTree& tree, const std::map<std::uint32_t, Aabb>& boxes, int queries,
                  const RandomBox& random_box) {
  ASSERT_EQ(tree.size(), boxes.size());
  for (int q = 0; q < queries; ++q) {
    Aabb box = random_box();
    if (q == 0) box = {{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}};
    std::set<std::uint32_t> found;
    tree.query(box, [&](std::uint32_t item) { ASSERT_TRUE(found.insert(item).second); });
    for (const auto& [item, item_box] : boxes)
      ASSERT_EQ(found.contains(item), overlap(item_box, box)) << "item " << item;
  }
}

TEST(BoxTree, keeps_its_items_through_random_changes) {
  std::mt19937 random(41);
  std::uniform_real_distribution<float> place(-50, 50), size(0, 2), small(-0.5f, 0.5f);
  BoxTree tree;
  std::map<std::uint32_t, Aabb> boxes;
  const auto random_box = [&] {
    Aabb box;
    for (int axis = 0; axis < 3; ++axis) {
      box.min[axis] = place(random);
      box.max[axis] = box.min[axis] + size(random);
    }
    return box;
  };
  for (int round = 0; round < 400; ++round) {
    for (unsigned i = 0; i < random() % 12; ++i) {
      const std::uint32_t item = random() % 700;
      if (!boxes.contains(item)) tree.insert(item, boxes[item] = random_box());
    }
    for (auto it = boxes.begin(); it != boxes.end();) {
      const auto dice = random() % 100;
      if (dice == 0) {
        tree.remove(it->first);
        it = boxes.erase(it);
        continue;
      }
      if (dice < 20) {
        const float by = small(random);
        for (int axis = 0; axis < 3; ++axis) {
          it->second.min[axis] += by;
          it->second.max[axis] += by;
        }
        tree.update(it->first, it->second);
      } else if (dice == 20) {
        tree.update(it->first, it->second = random_box());
      }
      ++it;
    }
    tree.refit();
    ASSERT_NO_FATAL_FAILURE(expect_items(tree, boxes, 10, random_box)) << "round " << round;
  }
  EXPECT_LT(tree.rebuild_count(), 150u);  // of 400 refits with a sixth of the items changed in each
}

// Items come, go, jump and drift between a build and the refit that takes the new tree; some steps ask
// nothing, so that no tree is built in them.
void live_with_trees_built_ahead(std::uint32_t items, int rounds, std::uint32_t least_rebuilds) {
  std::mt19937 random(43 + items);
  std::uniform_real_distribution<float> place(-50, 50), small(-1, 1);
  BoxTree tree;
  StubTask task;
  std::map<std::uint32_t, Aabb> boxes;
  const auto random_box = [&] {
    Aabb box;
    for (int axis = 0; axis < 3; ++axis) {
      box.min[axis] = place(random);
      box.max[axis] = box.min[axis] + 2;
    }
    return box;
  };
  const auto add = [&](std::uint32_t item) {
    if (!boxes.contains(item)) tree.insert(item, boxes[item] = random_box());
  };
  for (std::uint32_t item = 0; item < items; ++item) add(item);
  for (int round = 0; round < rounds; ++round) {
    for (std::uint32_t i = 0; i < 2 + items / 128; ++i) add(random() % (items + items / 4));
    for (auto it = boxes.begin(); it != boxes.end();) {
      const auto [item, old] = *it;
      const auto dice = random() % 256;
      if (dice < 2) {
        tree.remove(item);
        it = boxes.erase(it);
        if (dice == 0) add(item);  // the same item, elsewhere
        continue;
      }
      Aabb& box = it++->second;
      if (dice == 2) tree.update(item, box = random_box());
      if (dice < 3 || dice >= 64) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const float by = small(random);
        box.min[axis] += by;
        box.max[axis] += by;
      }
      if (!tree.update_in_place(item, box)) tree.update(item, box);
    }
    if (round == rounds / 2)  // all go, and as many come
      for (const auto& [item, box] : std::exchange(boxes, {})) {
        tree.remove(item);
        if (item % 2 == 0) add(item);
      }
    tree.refit(&task);
    ASSERT_NO_FATAL_FAILURE(expect_items(tree, boxes, 3, random_box)) << "round " << round;
    if (random() % 4 != 0) tree.build_ahead(task);
  }
  EXPECT_GT(tree.rebuild_count(), least_rebuilds);
}

TEST(BoxTree, keeps_its_items_while_it_is_built_ahead) {
  live_with_trees_built_ahead(40, 600, 5);
  live_with_trees_built_ahead(400, 400, 10);
  live_with_trees_built_ahead(5000, test::rounds(200), 1);
}

// Equal centres, one far item, a line, infinite extents: what buckets are no help for.
TEST(BoxTree, is_built_of_items_however_they_lie) {
  std::mt19937 random(44);
  std::uniform_real_distribution<float> place(-50, 50);
  constexpr float kMost = 3e38f;
  for (int kind = 0; kind < 5; ++kind) {
    BoxTree tree;
    std::vector<Aabb> boxes;
    for (std::uint32_t item = 0; item < 3000; ++item) {
      float center[3] = {place(random), place(random), place(random)};
      if (kind == 0) std::fill_n(center, 3, 7.0f);
      if (kind == 1 && item == 5) center[0] = 1e30f;
      if (kind == 2) center[1] = center[2] = 0;
      if (kind == 3 && item < 2) center[2] = item == 0 ? kMost : -kMost;
      if (kind == 4) center[0] *= 1e-43f;
      Aabb box;
      for (int axis = 0; axis < 3; ++axis) {
        box.min[axis] = center[axis] - 1;
        box.max[axis] = center[axis] + 1;
      }
      boxes.push_back(box);
      tree.insert(item, box);
    }
    tree.refit();
    EXPECT_EQ(tree.rebuild_count(), 1u);
    for (int q = 0; q < 20; ++q) {
      const Aabb& box = boxes[random() % boxes.size()];
      std::set<std::uint32_t> found;
      tree.query(box, [&](std::uint32_t item) { ASSERT_TRUE(found.insert(item).second); });
      for (std::uint32_t item = 0; item < boxes.size(); ++item)
        ASSERT_EQ(found.contains(item), overlap(boxes[item], box)) << "kind " << kind;
    }
  }
}

TEST(BoxTree, equal_boxes_added_one_by_one_stay_within_the_depth_of_a_query) {
  BoxTree tree;
  const Aabb box{{0, 0, 0}, {1, 1, 1}};
  for (std::uint32_t item = 0; item < 3000; ++item) {
    tree.insert(item, box);
    tree.refit();
  }
  std::uint32_t found = 0;
  tree.query(box, [&](std::uint32_t) { ++found; });
  EXPECT_EQ(found, 3000u);
}

}  // namespace
}  // namespace skerry::collision
