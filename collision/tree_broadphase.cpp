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
  void move(ColliderIndex collider, const Aabb& box, bool fixed) override {
    tree(fixed).update(collider, box);
  }
  void settle() override {
    moving_.refit();
    fixed_.refit();
  }
  void find(const Aabb& box, bool with_fixed, std::vector<ColliderIndex>& found) const override {
    const auto append = [&](std::uint32_t collider) { found.push_back(collider); };
    moving_.query(box, append);
    if (with_fixed) fixed_.query(box, append);
  }

 private:
  BoxTree& tree(bool fixed) { return fixed ? fixed_ : moving_; }

  BoxTree moving_;
  BoxTree fixed_;
};

}  // namespace

std::unique_ptr<Broadphase> make_tree_broadphase() { return std::make_unique<TreeBroadphase>(); }

}  // namespace skerry::collision
