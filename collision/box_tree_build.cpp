#include "collision/box_tree_build.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "jobs/blocks.h"

namespace skerry::collision {
namespace {

constexpr std::uint32_t kWidth = BoxNode::kWidth;
constexpr std::uint32_t kBuckets = 64;
// So few are parted at their median at once, without counting buckets.
constexpr std::size_t kFew = 32;

// Items that one block prepares, and of a branch that one block builds: some 100 us.
constexpr std::uint32_t kPrepareGrain = 8192, kBranchGrain = 2048;

// Items below one child: the smallest power of eight that leaves at most eight children.
std::uint32_t part_of(std::uint32_t count) {
  std::uint64_t part = 1;
  while (part * kWidth < count) part *= kWidth;
  return static_cast<std::uint32_t>(part);
}

// Nodes of a tree over so many items.
std::uint32_t nodes_over(std::uint32_t count) {
  std::uint32_t nodes = 1;
  for (std::uint32_t part = part_of(count); part > 1; part = part_of(count)) {
    nodes += count / part * ((part - 1) / (kWidth - 1));  // below full children
    count %= part;
    if (count == 0) break;
    ++nodes;
  }
  return nodes;
}

}  // namespace

void TreeBuilder::build(std::span<const BuildItem> items, Task* task) {
  items_ = items;
  const auto count = static_cast<std::uint32_t>(items.size());
  nodes_.resize(count == 0 ? 0 : nodes_over(count));
  parent_.resize(nodes_.size());
  centers_.resize(count);
  spare_.resize(count);
  if (count == 0) return;
  nodes_[0] = empty_node();
  parent_[0] = 0;
  const Branch root = {{0, count}, part_of(count), 0, 0, 1};
  jobs::run_blocks(task, jobs::blocks_of(count, kPrepareGrain),
                   [&](std::uint32_t block, std::uint32_t) {
                     prepare(jobs::items_of(block, kPrepareGrain, count));
                   });
  if (task == nullptr) return finish(root);
  part_to_grain(root, *task);
  jobs::run_blocks(*task, static_cast<std::uint32_t>(branches_.size()),
                   [&](std::uint32_t block, std::uint32_t) { finish(branches_[block]); });
}

void TreeBuilder::prepare(IndexRange rows) {
  for (std::uint32_t row = rows.begin; row < rows.end; ++row) {
    const Aabb& box = items_[row].box;
    centers_[row] = {{box.min[0] + box.max[0], box.min[1] + box.max[1], box.min[2] + box.max[2]},
                     row};
  }
}

// All branches of a level at once, until each is work for one block.
void TreeBuilder::part_to_grain(const Branch& root, Task& task) {
  branches_.assign(1, root);
  const auto is_large = [](const Branch& branch) { return branch.items.size() > kBranchGrain; };
  while (std::any_of(branches_.begin(), branches_.end(), is_large)) {
    parted_.assign(2 * branches_.size(), {});
    jobs::run_blocks(task, static_cast<std::uint32_t>(branches_.size()),
                     [&](std::uint32_t block, std::uint32_t) {
                       Branch branch = branches_[block];
                       if (!is_large(branch)) {
                         parted_[2 * block] = branch;
                         return;
                       }
                       while (branch.items.size() <= branch.part) branch = enter(branch);
                       std::tie(parted_[2 * block], parted_[2 * block + 1]) = halves(branch);
                     });
    branches_.clear();
    for (const Branch& branch : parted_)
      if (branch.items.size() > 0) branches_.push_back(branch);
  }
}

void TreeBuilder::finish(const Branch& branch) {
  const std::uint32_t count = branch.items.size();
  if (branch.part == 1) {
    for (std::uint32_t lane = 0; lane < count; ++lane) {
      const BuildItem& item = items_[centers_[branch.items.begin + lane].row];
      set_lane(nodes_[branch.node], lane, item.box, item.item | BoxNode::kItem);
    }
  } else if (count <= branch.part) {
    finish(enter(branch));
  } else {
    const auto [low, high] = halves(branch);
    finish(low);
    finish(high);
  }
}

// Makes the one child of a branch that has no more; what is left is the child's children.
TreeBuilder::Branch TreeBuilder::enter(const Branch& branch) {
  const std::uint32_t child = branch.next_node;
  nodes_[child] = empty_node();
  parent_[child] = branch.node * kWidth + branch.lane;
  nodes_[branch.node].child[branch.lane] = child;
  return {branch.items, part_of(branch.items.size()), child, 0, child + 1};
}

std::pair<TreeBuilder::Branch, TreeBuilder::Branch> TreeBuilder::halves(const Branch& branch) {
  const std::uint32_t part = branch.part;
  const std::uint32_t parts = (branch.items.size() + part - 1) / part / 2;
  const std::uint32_t middle = branch.items.begin + parts * part;
  part_at(branch.items, middle);
  Branch low = branch, high = branch;
  low.items.end = high.items.begin = middle;
  high.lane += parts;
  high.next_node += parts * nodes_over(part);
  return {low, high};
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
void TreeBuilder::part_at(IndexRange rows, std::uint32_t nth) {
  const std::span centers = std::span(centers_).subspan(rows.begin, rows.size());
  const std::span spare = std::span(spare_).subspan(rows.begin, rows.size());
  nth -= rows.begin;
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
    std::copy(centers.begin(), centers.end(), spare.begin());
    std::uint32_t to[3] = {0, first, past};  // of those in lower buckets, this one, and higher ones
    for (const Center& center : spare) {
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
