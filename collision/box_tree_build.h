// Builds eight-wide trees over boxes.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "collision/bounds.h"
#include "collision/box_node.h"

namespace skerry::collision {

struct BuildItem {
  Aabb box;
  std::uint32_t item;  // below BoxNode::kItem
};

// Builds trees, and keeps its memory from one to the next. Splits at medians of the longest axis of the
// centres, so that all nodes but the last of a level are full; a parent comes before its children.
// O(n log n).
class TreeBuilder {
 public:
  // With a task its workers share the work, to the same tree.
  void build(std::span<const BuildItem> items, Task* task = nullptr);
  // All but the boxes of inner nodes, which are empty.
  std::vector<BoxNode>& nodes() { return nodes_; }
  // Of each node: slot in its parent, node * 8 + lane.
  std::vector<std::uint32_t>& parents() { return parent_; }

 private:
  struct Center {
    float twice[3];  // m, an item's centre times 2
    std::uint32_t row;
  };
  // Where centres lie.
  struct Extent {
    float low[3], high[3];
  };
  // Children of a node that are still to be made, of `part` items each: how many nodes that takes
  // is known from the number of items, so branches are built side by side.
  struct Branch {
    IndexRange items;             // rows of centers_
    std::uint32_t part = 0;       // 1: the items themselves
    std::uint32_t node = 0;       // the parent
    std::uint32_t lane = 0;       // of the first child
    std::uint32_t next_node = 0;  // of the first child
  };

  void prepare(IndexRange rows);
  void part_to_grain(const Branch& root, Task& task);
  void finish(const Branch& branch);
  Branch enter(const Branch& branch);
  std::pair<Branch, Branch> halves(const Branch& branch);
  void part_at(IndexRange rows, std::uint32_t nth);
  static Extent extent_of(std::span<const Center> centers);

  std::span<const BuildItem> items_;
  std::vector<BoxNode> nodes_;
  std::vector<std::uint32_t> parent_;
  std::vector<Center> centers_, spare_;
  std::vector<Branch> branches_, parted_;
};

// Replaces `nodes` by a tree over the items, with all boxes.
void build_nodes(std::span<const BuildItem> items, std::vector<BoxNode>& nodes);

inline Aabb empty_box() {
  constexpr float kInf = __builtin_inff();
  return {{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}};
}
inline void grow(Aabb& box, const Aabb& other) {
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = other.min[axis] < box.min[axis] ? other.min[axis] : box.min[axis];
    box.max[axis] = other.max[axis] > box.max[axis] ? other.max[axis] : box.max[axis];
  }
}
inline void set_box(BoxNode& node, unsigned lane, const Aabb& box) {
  for (int axis = 0; axis < 3; ++axis) {
    node.min[axis][lane] = box.min[axis];
    node.max[axis][lane] = box.max[axis];
  }
}
inline void set_lane(BoxNode& node, unsigned lane, const Aabb& box, std::uint32_t child) {
  set_box(node, lane, box);
  node.child[lane] = child;
}
inline Aabb lane_box(const BoxNode& node, unsigned lane) {
  return {{node.min[0][lane], node.min[1][lane], node.min[2][lane]},
          {node.max[0][lane], node.max[1][lane], node.max[2][lane]}};
}
inline BoxNode empty_node() {
  BoxNode node;
  for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane)
    set_lane(node, lane, empty_box(), BoxNode::kEmpty);
  return node;
}
// Box around all lanes.
inline Aabb node_box(const BoxNode& node) {
  Aabb box = empty_box();
  for (unsigned lane = 0; lane < BoxNode::kWidth; ++lane) grow(box, lane_box(node, lane));
  return box;
}

}  // namespace skerry::collision
