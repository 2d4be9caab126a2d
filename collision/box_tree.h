// A bounding-volume tree whose items come, go and move.
//
//   Structure  eight-wide nodes (BoxNode), built over medians. Moved items change their lane and
//              the boxes above it; new ones take a free lane near them. When the boxes have grown
//              by half, or a quarter of the items have come or gone, the tree is built anew: at once,
//              or beside queries that the old one still serves.
//   Results    queries are exact over the items' boxes, so the shape of the tree (and when it is
//              rebuilt) never shows in them, but for their order.
//   Threads    queries may run side by side; changes may not run beside anything, unless said
//              otherwise.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/box_lanes.h"
#include "collision/box_tree_build.h"

namespace skerry::collision {

class BoxTree {
 public:
  // Changes take effect at the next refit().
  void insert(std::uint32_t item, const Aabb& box);
  void remove(std::uint32_t item);
  void update(std::uint32_t item, const Aabb& box);
  // The same, for different items on any number of threads at once. False, and nothing done, if the
  // item is new or has jumped away from its neighbours: it needs update().
  bool update_in_place(std::uint32_t item, const Aabb& box);

  // Brings the tree up to date with the changes since the last refit. Costs nothing if there are
  // none. With a task its workers share the work, and a worn tree is left to build_ahead.
  void refit(Task* task = nullptr);
  // Builds the tree that the next refit takes, if this one is worn. May run beside queries.
  void build_ahead(Task& task);

  // Calls found(item) for the items whose box meets this one.
  template <class Found>
  void query(const Aabb& box, const Found& found) const {
    walk(
        nodes_, [&](const BoxNode& node) { return overlap_lanes(node, box); }, found);
  }
  template <class Found>
  void query(const Ray& ray, const Found& found) const {
    walk(
        nodes_, [&](const BoxNode& node) { return ray_lanes(node, ray); }, found);
  }

  const std::vector<BoxNode>& nodes() const { return nodes_; }
  std::uint32_t size() const { return size_; }
  std::uint32_t rebuild_count() const { return rebuild_count_; }
  std::uint32_t built_ahead_count() const { return built_ahead_count_; }

 private:
  static constexpr std::uint32_t kNowhere = 0xffffffffu;
  static constexpr std::uint32_t kPending = 0x80000000u;  // bit of a slot: index into pending_

  bool many(std::size_t changes) const { return changes > size_ / 4 + 64; }
  void mark_dirty(std::uint32_t node) { dirty_[node] = 1; }
  bool place_pending();
  bool place(const BuildItem& item);
  void set_item(std::uint32_t node, unsigned lane, const BuildItem& item);
  void set_child(std::uint32_t node, unsigned lane, const Aabb& box, std::uint32_t child);
  void refit_dirty(Task* task);
  void refit_upward(std::uint32_t node);
  void refit_all(Task* task);
  double hand_up(std::uint32_t node);
  void rebuild(Task* task);
  void build(Task* task);
  void adopt(Task* task);
  void adopt_node(std::uint32_t node);
  bool holds(std::uint32_t item) const;

  std::vector<BoxNode> nodes_;         // parents before their children
  std::vector<std::uint32_t> parent_;  // [node] slot in the parent: node * 8 + lane
  std::vector<std::uint8_t> dirty_;    // [node] a lane has changed since the last refit
  std::vector<std::uint32_t> dirty_nodes_;
  std::vector<std::uint32_t> slot_;  // [item] node * 8 + lane, or kPending | row, or kNowhere
  std::vector<Aabb> box_;            // [item]
  std::vector<BuildItem> pending_;   // inserted since the last refit
  std::uint32_t size_ = 0;
  std::uint32_t changes_ = 0;  // inserted and removed since the last build
  std::uint32_t rebuild_count_ = 0;
  std::uint32_t built_ahead_count_ = 0;  // of these, by build_ahead
  struct RefitBlock {
    double area = 0;          // m^2, of its nodes without nodes below, as for inner_area_
    std::uint32_t inner = 0;  // its other nodes
  };
  std::vector<RefitBlock> refit_blocks_;
  std::vector<std::uint32_t> inner_;  // each block's at its beginning
  double inner_area_ = 0;  // m^2, sum of half the surfaces of all inner boxes: what queries cost
  double built_area_ = 0;  // the same after the last build

  // A new tree, over the items as they were when it was built, and who has come since.
  TreeBuilder builder_;
  std::vector<BuildItem> build_items_;
  std::vector<std::uint32_t> newcomers_;
  bool worn_ = false;   // to be built anew
  bool built_ = false;  // there is a new tree
};

}  // namespace skerry::collision
