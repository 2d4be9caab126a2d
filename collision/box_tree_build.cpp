#include "collision/box_tree_build.h"

#include <algorithm>
#include <cmath>

namespace skerry::collision {
namespace {

constexpr std::uint32_t kWidth = BoxNode::kWidth;
constexpr std::uint32_t kBuckets = 64;
// So few are parted at their median at once, without counting buckets.
constexpr std::size_t kFew = 32;

// Items below one child: the smallest power of eight that leaves at most eight children.
std::uint32_t part_of(std::size_t count) {
  std::uint32_t part = 1;
  while (std::size_t{part} * kWidth < count) part *= kWidth;
  return part;
}

}  // namespace

void TreeBuilder::build(std::span<const BuildItem> items) {
  items_ = items;
  nodes_.clear();
  parent_.clear();
  used_.clear();
  centers_.resize(items.size());
  spare_.resize(items.size());
  if (items.empty()) return;
  for (std::uint32_t row = 0; row < items.size(); ++row) {
    const Aabb& box = items[row].box;
    centers_[row] = {{box.min[0] + box.max[0], box.min[1] + box.max[1], box.min[2] + box.max[2]},
                     row};
  }
  fill(add_node(0), centers_);
}

std::uint32_t TreeBuilder::add_node(std::uint32_t parent) {
  nodes_.push_back(empty_node());
  parent_.push_back(parent);
  used_.push_back(0);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

void TreeBuilder::fill(std::uint32_t node, std::span<Center> below) {
  const std::uint32_t part = part_of(below.size());
  if (part > 1) return divide(node, below, part);
  for (const Center& center : below) {
    const BuildItem& item = items_[center.row];
    set_lane(nodes_[node], used_[node]++, item.box, item.item | BoxNode::kItem);
  }
}

// Makes children of `part` items each.
void TreeBuilder::divide(std::uint32_t node, std::span<Center> below, std::uint32_t part) {
  if (below.size() <= part) {
    const std::uint32_t lane = used_[node]++;
    const std::uint32_t child = add_node(node * kWidth + lane);
    nodes_[node].child[lane] = child;
    return fill(child, below);
  }
  const std::size_t parts = (below.size() + part - 1) / part;
  const std::size_t half = parts / 2 * part;
  part_at(below, half);
  divide(node, below.first(half), part);
  divide(node, below.subspan(half), part);
}

TreeBuilder::Extent TreeBuilder::extent_of(std::span<const Center> centers) {
  Extent extent;
  std::copy_n(centers[0].twice, 3, extent.low);
  std::copy_n(centers[0].twice, 3, extent.high);
  for (const Center& center : centers)
    for (int axis = 0; axis < 3; ++axis) {
      extent.low[axis] = std::min(extent.low[axis], center.twice[axis]);
      extent.high[axis] = std::max(extent.high[axis], center.twice[axis]);
    }
  return extent;
}

// What std::nth_element does, along the longest axis, but with few branches that are hard to foresee:
// all are counted in buckets, and only the bucket in question is looked into.
void TreeBuilder::part_at(std::span<Center> centers, std::size_t nth) {
  const Extent extent = extent_of(centers);
  int axis = 0;
  for (int other = 1; other < 3; ++other)
    if (extent.high[other] - extent.low[other] > extent.high[axis] - extent.low[axis]) axis = other;
  const float low = extent.low[axis], scale = float{kBuckets} / (extent.high[axis] - low);
  std::uint32_t first = 0, past = static_cast<std::uint32_t>(centers.size());
  if (past > kFew && scale > 0 && std::isfinite(scale)) {
    const auto bucket_of = [=](const Center& center) {
      const float along = (center.twice[axis] - low) * scale;
      return std::min(static_cast<std::uint32_t>(along), kBuckets - 1);
    };
    std::uint32_t counts[kBuckets] = {};
    for (const Center& center : centers) ++counts[bucket_of(center)];
    std::uint32_t bucket = 0;
    while (first + counts[bucket] <= nth) first += counts[bucket++];
    past = first + counts[bucket];
    std::copy(centers.begin(), centers.end(), spare_.begin());
    std::uint32_t to[3] = {0, first, past};  // of those in lower buckets, this one, and higher ones
    for (const Center& center : std::span(spare_).first(centers.size())) {
      const std::uint32_t own = bucket_of(center);
      centers[to[(own >= bucket) + (own > bucket)]++] = center;
    }
  }
  std::nth_element(centers.begin() + first, centers.begin() + static_cast<std::ptrdiff_t>(nth),
                   centers.begin() + past, [axis](const Center& a, const Center& b) {
                     const float ca = a.twice[axis], cb = b.twice[axis];
                     return ca < cb || (ca == cb && a.row < b.row);
                   });
}

void build_nodes(std::span<const BuildItem> items, std::vector<BoxNode>& nodes) {
  TreeBuilder builder;
  builder.build(items);
  nodes.swap(builder.nodes());
  for (std::size_t node = nodes.size(); node-- > 1;) {
    const std::uint32_t slot = builder.parents()[node];
    set_lane(nodes[slot / kWidth], slot % kWidth, node_box(nodes[node]),
             static_cast<std::uint32_t>(node));
  }
}

}  // namespace skerry::collision
