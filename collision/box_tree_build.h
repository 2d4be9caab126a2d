// Builds eight-wide trees over boxes.
#pragma once

#include <span>
#include <vector>

#include "collision/bounds.h"
#include "collision/box_node.h"

namespace skerry::collision {

struct BuildItem {
  Aabb box;
  std::uint32_t item;  // below BoxNode::kItem
};

// Builds a tree bit by bit, and the same one whatever the bits. Splits at medians of the longest axis
// of the centres, so that all nodes but the last of a level are full; a parent comes before its
// children. O(n log n).
class TreeBuild {
 public:
  // The items must stay where they are until the tree is complete; they are reordered.
  void begin(std::span<BuildItem> items);
  // Goes on until about `part` (0 to 1) of the work is done.
  void run(double part);
  bool complete() const { return splits_.empty(); }
  // All but the boxes of inner nodes, once it is complete.
  std::vector<BoxNode>& nodes() { return nodes_; }
  // Of each node: slot in its parent, node * 8 + lane.
  std::vector<std::uint32_t>& parents() { return parent_; }

 private:
  // Items that are to come below one node, in children of `part` items each.
  struct Split {
    std::uint32_t first, count, part, node;
  };
  std::uint32_t add_node(std::uint32_t parent);
  void divide(const Split& split);
  void add_child(const Split& split);

  std::span<BuildItem> items_;
  std::vector<BoxNode> nodes_;
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> used_;  // [node] lanes
  std::vector<Split> splits_;       // to be made; the last one first
};

// Replaces `nodes` by a tree over the items, which are reordered.
void build_nodes(std::span<BuildItem> items, std::vector<BoxNode>& nodes);

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
inline void set_lane(BoxNode& node, unsigned lane, const Aabb& box, std::uint32_t child) {
  for (int axis = 0; axis < 3; ++axis) {
    node.min[axis][lane] = box.min[axis];
    node.max[axis][lane] = box.max[axis];
  }
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
