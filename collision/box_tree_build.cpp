#include "collision/box_tree_build.h"

#include <algorithm>
#include <cmath>

namespace skerry::collision {
namespace {

float twice_center(const Aabb& box, int axis) { return box.min[axis] + box.max[axis]; }

int longest_axis(std::span<const BuildItem> items) {
  float low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) low[axis] = high[axis] = twice_center(items[0].box, axis);
  for (const BuildItem& item : items)
    for (int axis = 0; axis < 3; ++axis) {
      const float center = twice_center(item.box, axis);
      low[axis] = std::min(low[axis], center);
      high[axis] = std::max(high[axis], center);
    }
  int longest = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
  return longest;
}

// Items below one child: the smallest power of eight that leaves at most eight children.
std::uint32_t part_of(std::uint32_t count) {
  std::uint32_t part = 1;
  while (part * BoxNode::kWidth < count) part *= BoxNode::kWidth;
  return part;
}

}  // namespace

void TreeBuild::begin(std::span<BuildItem> items) {
  items_ = items;
  nodes_.clear();
  parent_.clear();
  used_.clear();
  splits_.clear();
  if (items.empty()) return;
  const auto count = static_cast<std::uint32_t>(items.size());
  splits_.push_back({0, count, part_of(count), add_node(0)});
}

void TreeBuild::run(double part) {
  // An item takes part in about log2 n splits.
  const auto items = static_cast<double>(items_.size());
  double left = part * items * std::log2(items + 1);
  while (!splits_.empty() && left > 0) {
    const Split split = splits_.back();
    splits_.pop_back();
    if (split.count > split.part) {
      divide(split);
      left -= split.count;
    } else {
      add_child(split);
    }
  }
}

std::uint32_t TreeBuild::add_node(std::uint32_t parent) {
  nodes_.push_back(empty_node());
  parent_.push_back(parent);
  used_.push_back(0);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

void TreeBuild::divide(const Split& split) {
  const std::uint32_t parts = (split.count + split.part - 1) / split.part;
  const std::uint32_t half = parts / 2 * split.part;
  const std::span<BuildItem> items = items_.subspan(split.first, split.count);
  const int axis = longest_axis(items);
  std::nth_element(items.begin(), items.begin() + half, items.end(),
                   [axis](const BuildItem& a, const BuildItem& b) {
                     const float ca = twice_center(a.box, axis), cb = twice_center(b.box, axis);
                     return ca < cb || (ca == cb && a.item < b.item);
                   });
  splits_.push_back({split.first + half, split.count - half, split.part, split.node});
  splits_.push_back({split.first, half, split.part, split.node});
}

void TreeBuild::add_child(const Split& split) {
  const unsigned lane = used_[split.node]++;
  if (split.count == 1) {
    const BuildItem& item = items_[split.first];
    set_lane(nodes_[split.node], lane, item.box, item.item | BoxNode::kItem);
    return;
  }
  const std::uint32_t child = add_node(split.node * BoxNode::kWidth + lane);
  nodes_[split.node].child[lane] = child;
  splits_.push_back({split.first, split.count, part_of(split.count), child});
}

void build_nodes(std::span<BuildItem> items, std::vector<BoxNode>& nodes) {
  TreeBuild build;
  build.begin(items);
  while (!build.complete()) build.run(1);
  nodes.swap(build.nodes());
  for (std::size_t node = nodes.size(); node-- > 1;) {
    const std::uint32_t slot = build.parents()[node];
    set_lane(nodes[slot / BoxNode::kWidth], slot % BoxNode::kWidth, node_box(nodes[node]),
             static_cast<std::uint32_t>(node));
  }
}

}  // namespace skerry::collision
