#include "collision/box_tree.h"

#include <algorithm>
#include <atomic>

#include "collision/marks.h"
#include "core/assert.h"
#include "jobs/blocks.h"

namespace skerry::collision {
namespace {

constexpr unsigned kWidth = BoxNode::kWidth;
// Inserting one by one may make a chain; beyond this the tree is built anew, long before a query's
// stack is full.
constexpr unsigned kDeepest = kMaxDepth / 2;

// Rebuilding costs about as much as forty refits of all items; boxes that are half as large again
// cost more than that in queries within some tens of steps (bench/micro/broadphase_bench).
constexpr double kWornOut = 1.5;

double half_area(const Aabb& box) {
  const double x = double(box.max[0]) - double(box.min[0]),
               y = double(box.max[1]) - double(box.min[1]),
               z = double(box.max[2]) - double(box.min[2]);
  return x >= 0 ? x * y + y * z + z * x : 0;  // inverted: empty
}
Aabb joined(Aabb a, const Aabb& b) {
  grow(a, b);
  return a;
}
bool same(const Aabb& a, const Aabb& b) {
  bool equal = true;
  for (int axis = 0; axis < 3; ++axis)
    equal &= (a.min[axis] == b.min[axis]) & (a.max[axis] == b.max[axis]);
  return equal;
}
bool is_node(std::uint32_t child) { return (child & BoxNode::kItem) == 0; }

// The free lane of a node, or the one that grows least by taking the box.
unsigned best_lane(const BoxNode& node, const Aabb& box) {
  unsigned best = 0;
  double least = 0;
  for (unsigned lane = 0; lane < kWidth; ++lane) {
    if (node.child[lane] == BoxNode::kEmpty) return lane;
    const Aabb old = lane_box(node, lane);
    const double growth = half_area(joined(old, box)) - half_area(old);
    if (lane == 0 || growth < least) {
      least = growth;
      best = lane;
    }
  }
  return best;
}

}  // namespace

void BoxTree::insert(std::uint32_t item, const Aabb& box) {
  if (item >= slot_.size()) {
    slot_.resize(item + 1, kNowhere);
    box_.resize(item + 1);
  }
  SKERRY_ASSERT(slot_[item] == kNowhere, "an item is put into a tree twice");
  slot_[item] = kPending | static_cast<std::uint32_t>(pending_.size());
  pending_.push_back({box, item});
  box_[item] = box;
  if (built_) newcomers_.push_back(item);
  ++size_;
  ++changes_;
}

void BoxTree::remove(std::uint32_t item) {
  const std::uint32_t slot = slot_[item];
  SKERRY_ASSERT(slot != kNowhere, "an item is taken from a tree that does not hold it");
  slot_[item] = kNowhere;
  --size_;
  ++changes_;
  if (slot & kPending) {
    const std::uint32_t row = slot & ~kPending;
    pending_[row] = pending_.back();
    pending_.pop_back();
    if (row < pending_.size()) slot_[pending_[row].item] = kPending | row;
    return;
  }
  set_lane(nodes_[slot / kWidth], slot % kWidth, empty_box(), BoxNode::kEmpty);
  mark_dirty(slot / kWidth);
}

void BoxTree::update(std::uint32_t item, const Aabb& box) {
  if (update_in_place(item, box)) return;
  const std::uint32_t slot = slot_[item];
  if (slot & kPending) {
    box_[item] = pending_[slot & ~kPending].box = box;
    return;
  }
  remove(item);  // its old neighbours are far away
  insert(item, box);
}

bool BoxTree::update_in_place(std::uint32_t item, const Aabb& box) {
  const std::uint32_t slot = slot_[item];
  if (slot & kPending) return false;
  BoxNode& node = nodes_[slot / kWidth];
  if (!overlap(box_[item], box)) return false;
  set_lane(node, slot % kWidth, box, item | BoxNode::kItem);
  box_[item] = box;
  std::atomic_ref(dirty_[slot / kWidth]).store(1, std::memory_order_relaxed);
  return true;
}

void BoxTree::refit(Task* task) {
  const bool at_once = task == nullptr;
  if (many(at_once ? changes_ : pending_.size()) || !place_pending()) return rebuild(task);
  if (built_) adopt(task);
  refit_dirty(task);
  worn_ = inner_area_ > kWornOut * built_area_ || many(changes_);
  if (worn_ && at_once) rebuild(task);
}

// False if the tree has no room for one of them.
bool BoxTree::place_pending() {
  while (!pending_.empty()) {
    if (!place(pending_.back())) return false;
    pending_.pop_back();
  }
  return true;
}

void BoxTree::refit_dirty(Task* task) {
  dirty_nodes_.clear();
  for_marked(dirty_, [&](std::uint32_t node) { dirty_nodes_.push_back(node); });
  if (dirty_nodes_.empty()) return;
  if (dirty_nodes_.size() > nodes_.size() / 4)
    refit_all(task);
  else
    for (const std::uint32_t node : dirty_nodes_) refit_upward(node);
  for (const std::uint32_t node : dirty_nodes_) dirty_[node] = 0;
}

// False if the tree is (or would get) too deep.
bool BoxTree::place(const BuildItem& item) {
  if (nodes_.empty()) return false;
  std::uint32_t index = 0;
  for (unsigned depth = 0; depth < kDeepest; ++depth) {
    const unsigned lane = best_lane(nodes_[index], item.box);
    const std::uint32_t child = nodes_[index].child[lane];
    if (child == BoxNode::kEmpty) {
      set_item(index, lane, item);
      return true;
    }
    const Aabb old = lane_box(nodes_[index], lane);
    if (is_node(child)) {
      set_child(index, lane, joined(old, item.box), child);
      index = child;
      continue;
    }
    // A lane with an item becomes a node with both.
    const auto added = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back(empty_node());
    parent_.push_back(index * kWidth + lane);
    dirty_.push_back(0);
    set_item(added, 0, {old, child & ~BoxNode::kItem});
    set_item(added, 1, item);
    inner_area_ += half_area(old);  // the lane counts as inner from now on
    set_child(index, lane, joined(old, item.box), added);
    return true;
  }
  return false;
}

void BoxTree::set_item(std::uint32_t node, unsigned lane, const BuildItem& item) {
  set_lane(nodes_[node], lane, item.box, item.item | BoxNode::kItem);
  slot_[item.item] = node * kWidth + lane;
}

void BoxTree::set_child(std::uint32_t node, unsigned lane, const Aabb& box, std::uint32_t child) {
  inner_area_ += half_area(box) - half_area(lane_box(nodes_[node], lane));
  set_lane(nodes_[node], lane, box, child);
}

void BoxTree::refit_upward(std::uint32_t node) {
  while (node != 0) {
    const std::uint32_t slot = parent_[node];
    const Aabb box = node_box(nodes_[node]);
    if (same(box, lane_box(nodes_[slot / kWidth], slot % kWidth))) return;
    set_child(slot / kWidth, slot % kWidth, box, node);
    node = slot / kWidth;
  }
}

// First the nodes without nodes below, side by side; the rest, an eighth of all, from the last to the
// first. Areas are summed up in the same order by any workers.
void BoxTree::refit_all(Task* task) {
  constexpr std::uint32_t kGrain = 512;
  const auto count = static_cast<std::uint32_t>(nodes_.size());
  const std::uint32_t blocks = jobs::blocks_of(count, kGrain);
  inner_.resize(count);
  refit_blocks_.resize(blocks);
  jobs::run_blocks(task, blocks, [&](std::uint32_t block, std::uint32_t) {
    const IndexRange range = jobs::items_of(block, kGrain, count);
    RefitBlock& out = refit_blocks_[block] = {};
    for (std::uint32_t node = range.begin; node < range.end; ++node) {
      if (node == 0) continue;
      if (std::any_of(nodes_[node].child, nodes_[node].child + kWidth, is_node))
        inner_[range.begin + out.inner++] = node;
      else
        out.area += hand_up(node);
    }
  });
  inner_area_ = 0;
  for (std::uint32_t block = blocks; block-- > 0;) {
    inner_area_ += refit_blocks_[block].area;
    for (std::uint32_t i = refit_blocks_[block].inner; i-- > 0;)
      inner_area_ += hand_up(inner_[block * kGrain + i]);
  }
}

// Writes a node's box into its parent; returns half its surface.
double BoxTree::hand_up(std::uint32_t node) {
  const std::uint32_t slot = parent_[node];
  const Aabb box = node_box(nodes_[node]);
  set_box(nodes_[slot / kWidth], slot % kWidth, box);
  return half_area(box);
}

void BoxTree::rebuild(Task* task) {
  build(task);
  for (const BuildItem& item : pending_) slot_[item.item] = 0;  // in the build: adopt says where
  pending_.clear();
  adopt(task);
}

void BoxTree::build_ahead(Task& task) {
  if (!worn_ || built_) return;
  build(&task);
  ++built_ahead_count_;
}

// With those that are pending.
void BoxTree::build(Task* task) {
  build_items_.clear();
  for (const BoxNode& node : nodes_)
    for (unsigned lane = 0; lane < kWidth; ++lane)
      if (node.child[lane] != BoxNode::kEmpty && !is_node(node.child[lane]))
        build_items_.push_back({lane_box(node, lane), node.child[lane] & ~BoxNode::kItem});
  build_items_.insert(build_items_.end(), pending_.begin(), pending_.end());
  SKERRY_ASSERT(build_items_.size() == size_, "a tree has lost items");
  builder_.build(build_items_, task);
  newcomers_.clear();
  changes_ = 0;
  built_ = true;
}

// Takes the new tree in place of the old one, which holds the items as they are now.
void BoxTree::adopt(Task* task) {
  nodes_.swap(builder_.nodes());
  parent_.swap(builder_.parents());
  const auto count = static_cast<std::uint32_t>(nodes_.size());
  constexpr std::uint32_t kGrain = 128;
  const auto adopt_block = [&](std::uint32_t block, std::uint32_t) {
    const IndexRange range = jobs::items_of(block, kGrain, count);
    for (std::uint32_t node = range.begin; node < range.end; ++node) adopt_node(node);
  };
  jobs::run_blocks(task, jobs::blocks_of(count, kGrain), adopt_block);
  dirty_.assign(nodes_.size(), 0);
  refit_all(task);
  built_area_ = inner_area_;
  worn_ = built_ = false;
  ++rebuild_count_;
  for (const std::uint32_t item : newcomers_) {
    if ((slot_[item] & kPending) || holds(item)) continue;  // gone, listed twice, or in the build
    slot_[item] = kPending | static_cast<std::uint32_t>(pending_.size());
    pending_.push_back({box_[item], item});
  }
  if (!place_pending()) rebuild(task);
}

// Items that went after the build leave their lanes empty.
void BoxTree::adopt_node(std::uint32_t node) {
  for (unsigned lane = 0; lane < kWidth; ++lane) {
    const std::uint32_t child = nodes_[node].child[lane];
    if (child == BoxNode::kEmpty || is_node(child)) continue;
    const std::uint32_t item = child & ~BoxNode::kItem;
    if (slot_[item] == kNowhere) {
      set_lane(nodes_[node], lane, empty_box(), BoxNode::kEmpty);
      continue;
    }
    set_lane(nodes_[node], lane, box_[item], child);
    slot_[item] = node * kWidth + lane;
  }
}

bool BoxTree::holds(std::uint32_t item) const {
  const std::uint32_t slot = slot_[item];
  return slot / kWidth < nodes_.size() &&
         nodes_[slot / kWidth].child[slot % kWidth] == (item | BoxNode::kItem);
}

}  // namespace skerry::collision
