#include "collision/box_tree_build.h"

#include <algorithm>

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

class Builder {
 public:
  explicit Builder(std::vector<BoxNode>& nodes) : nodes_(nodes) {}

  // Adds a node over the items with all below it; returns its box.
  Aabb add_node(std::span<BuildItem> items) {
    const auto index = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back(empty_node());
    // Items below one child: the smallest power of eight that leaves at most eight children.
    std::size_t part = 1;
    while (part * BoxNode::kWidth < items.size()) part *= BoxNode::kWidth;
    unsigned lane = 0;
    add_children(items, part, index, lane);
    return node_box(nodes_[index]);
  }

 private:
  void add_children(std::span<BuildItem> items, std::size_t part, std::uint32_t parent,
                    unsigned& lane) {
    const std::size_t parts = (items.size() + part - 1) / part;
    if (parts > 1) {
      const std::size_t middle = parts / 2 * part;
      const int axis = longest_axis(items);
      std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle),
                       items.end(), [axis](const BuildItem& a, const BuildItem& b) {
                         const float ca = twice_center(a.box, axis), cb = twice_center(b.box, axis);
                         return ca < cb || (ca == cb && a.item < b.item);
                       });
      add_children(items.first(middle), part, parent, lane);
      add_children(items.subspan(middle), part, parent, lane);
      return;
    }
    if (items.size() == 1) {
      set_lane(nodes_[parent], lane++, items[0].box, items[0].item | BoxNode::kItem);
      return;
    }
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    const Aabb box = add_node(items);  // may move nodes_
    set_lane(nodes_[parent], lane++, box, child);
  }

  std::vector<BoxNode>& nodes_;
};

}  // namespace

void build_nodes(std::span<BuildItem> items, std::vector<BoxNode>& nodes) {
  nodes.clear();
  if (!items.empty()) Builder(nodes).add_node(items);
}

}  // namespace skerry::collision
