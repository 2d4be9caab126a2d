#include <memory>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

#include "collision/broadphase_kinds.h"
#include "collision/proxy_broadphase.h"

namespace skerry::collision {
namespace {

// FCL takes boxes within about 1e-14 for equal and then keeps the old one, so it gets them with a
// rim; our own test on the candidates is the exact one.
constexpr double kRim = 1e-6;  // m

class BoxObject final : public fcl::CollisionObjectd {
 public:
  BoxObject() : fcl::CollisionObjectd(std::make_shared<fcl::Sphered>(1.0)) {}

  void set(ColliderIndex index, const Aabb& box) {
    collider = index;
    exact = box;
    aabb.min_ =
        fcl::Vector3d(double(box.min[0]), double(box.min[1]), double(box.min[2])).array() - kRim;
    aabb.max_ =
        fcl::Vector3d(double(box.max[0]), double(box.max[1]), double(box.max[2])).array() + kRim;
  }

  ColliderIndex collider = 0;
  Aabb exact;
};

struct Query {
  const Aabb* box;
  std::vector<ColliderIndex>* found;
};

bool keep_overlapping(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data) {
  const Query& query = *static_cast<Query*>(data);
  for (const fcl::CollisionObjectd* object : {a, b}) {
    const auto* candidate = static_cast<const BoxObject*>(object);
    if (candidate->collider != core::kNone && overlap(candidate->exact, *query.box))
      query.found->push_back(candidate->collider);
  }
  return false;  // go on
}

class FclBroadphase final : public ProxyBroadphase {
 protected:
  void insert(ColliderIndex collider, const Aabb& box, bool fixed) override {
    if (collider >= objects_.size()) objects_.resize(collider + 1);
    objects_[collider] = std::make_unique<BoxObject>();
    objects_[collider]->set(collider, box);
    tree(fixed).registerObject(objects_[collider].get());
  }
  void erase(ColliderIndex collider, bool fixed) override {
    tree(fixed).unregisterObject(objects_[collider].get());
    objects_[collider] = nullptr;
  }
  void move(std::span<const ColliderIndex> moved, Task&) override {
    for (const ColliderIndex collider : moved)
      move_one(collider, fat_bounds(collider), is_fixed(collider));
  }

  void settle(Task&) override {
    update(moving_, changed_);
    update(fixed_, changed_fixed_);
  }
  void find(const Aabb& box, bool with_fixed, std::vector<ColliderIndex>& found) const override {
    // Collision objects compute their bounds when made, and so may not share a geometry between
    // threads.
    thread_local BoxObject object;
    object.set(core::kNone, box);
    Query query{&box, &found};
    moving_.collide(&object, &query, keep_overlapping);
    if (with_fixed) fixed_.collide(&object, &query, keep_overlapping);
  }

 private:
  void move_one(ColliderIndex collider, const Aabb& box, bool fixed) {
    objects_[collider]->set(collider, box);
    (fixed ? changed_fixed_ : changed_).push_back(objects_[collider].get());
  }

  using Tree = fcl::DynamicAABBTreeCollisionManagerd;
  Tree& tree(bool fixed) { return fixed ? fixed_ : moving_; }

  static void update(Tree& tree, std::vector<fcl::CollisionObjectd*>& changed) {
    if (changed.empty())
      tree.setup();
    else
      tree.update(changed);
    changed.clear();
  }

  std::vector<std::unique_ptr<BoxObject>> objects_;  // [collider]
  Tree moving_, fixed_;
  std::vector<fcl::CollisionObjectd*> changed_, changed_fixed_;
};

}  // namespace

std::unique_ptr<Broadphase> make_fcl_broadphase() { return std::make_unique<FclBroadphase>(); }

}  // namespace skerry::collision
