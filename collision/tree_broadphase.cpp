// The broadphase of choice: one tree of what may move (asleep or not), one of what is fixed. A step
// touches only what moved: sleeping and fixed bodies cost nothing but depth.
#include "collision/box_tree.h"
#include "collision/broadphase_kinds.h"
#include "collision/proxy_broadphase.h"

namespace skerry::collision {
namespace {

class TreeBroadphase final : public ProxyBroadphase {
 protected:
  void insert(ColliderIndex collider, const Aabb& box, bool fixed) override {
    tree(fixed).insert(collider, box);
  }
  void erase(ColliderIndex collider, bool fixed) override { tree(fixed).remove(collider); }
  void move(std::span<const ColliderIndex> moved, Task& task) override {
    jumped_.clear();
    filter_.run(
        task, static_cast<std::uint32_t>(moved.size()),
        [&](std::uint32_t i) {
          return !tree_of(moved[i]).update_in_place(moved[i], fat_bounds(moved[i]));
        },
        jumped_);
    for (const std::uint32_t i : jumped_) tree_of(moved[i]).update(moved[i], fat_bounds(moved[i]));
  }
  void settle(Task& task) override {
    moving_.refit(&task);
    fixed_.refit(&task);
  }
  void prepare_ahead(Task& task) override {
    moving_.build_ahead(task);
    fixed_.build_ahead(task);
  }
  void find(const Aabb& box, bool with_fixed, std::vector<ColliderIndex>& found) const override {
    const auto append = [&](std::uint32_t collider) { found.push_back(collider); };
    moving_.query(box, append);
    if (with_fixed) fixed_.query(box, append);
  }

 public:
  std::uint32_t built_ahead_count() const override {
    return moving_.built_ahead_count() + fixed_.built_ahead_count();
  }

 private:
  BoxTree& tree(bool fixed) { return fixed ? fixed_ : moving_; }
  BoxTree& tree_of(ColliderIndex collider) { return tree(is_fixed(collider)); }

  BoxTree moving_;
  BoxTree fixed_;
  jobs::RowFilter filter_;
  std::vector<std::uint32_t> jumped_;  // rows of the moved ones
};

}  // namespace

std::unique_ptr<Broadphase> make_tree_broadphase() { return std::make_unique<TreeBroadphase>(); }

}  // namespace skerry::collision
