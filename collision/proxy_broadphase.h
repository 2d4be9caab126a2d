// What all kinds of broadphase share: fat boxes, which of them moved, and the pair list. A kind adds
// only the structure that finds the boxes which meet a box.
#pragma once

#include <atomic>
#include <span>
#include <vector>

#include "collision/broadphase.h"
#include "jobs/blocks.h"

namespace skerry::collision {

class ProxyBroadphase : public Broadphase {
 public:
  void add(const core::Bodies& bodies, const core::Colliders& colliders,
           core::BodyIndex body) final;
  void remove(ColliderIndex collider) final;
  void touch(const core::Bodies& bodies, const core::Colliders& colliders,
             core::BodyIndex body) final;
  const Aabb& fat_bounds(ColliderIndex collider) const final { return fat_[collider]; }
  void collect(const Aabb& box, std::vector<ColliderIndex>& found) const final;
  bool is_pair(ColliderIndex a, ColliderIndex b) const final;
  Travels& travels() final { return travels_; }

  void update_bounds(const StepContext& step, IndexRange awake_bodies, Task& task) final;
  void refit(const StepContext& step, Task& task) final;
  std::uint32_t moved_count() const final { return static_cast<std::uint32_t>(moved_.size()); }
  std::uint64_t proxies_touched() const final;
  void query_pairs(const StepContext& step, IndexRange moved, Task& task) final;
  void merge_pairs(const StepContext& step, Task& task) final;

 protected:
  // -- The structure. It holds bounded proxies only; `fixed` ones are those of fixed bodies.
  virtual void insert(ColliderIndex collider, const Aabb& box, bool fixed) = 0;
  virtual void erase(ColliderIndex collider, bool fixed) = 0;
  // New boxes (fat_bounds) of these, ascending.
  virtual void move(std::span<const ColliderIndex> moved, Task& task) = 0;
  // After the changes of a step, before its queries.
  virtual void settle(Task& task) = 0;
  // Work for later steps, once beside the queries of each step that has some.
  virtual void prepare_ahead(Task&) {}
  // Appends those whose box meets this one, in any order. Any number of threads at once.
  virtual void find(const Aabb& box, bool with_fixed, std::vector<ColliderIndex>& found) const = 0;
  bool is_fixed(ColliderIndex collider) const { return of_fixed(proxies_[collider]); }

 private:
  enum ProxyFlag : std::uint32_t {
    kPresent = 1u << 0,
    kOfDynamic = 1u << 1,
    kOfKinematic = 1u << 2,
    kIsSensor = 1u << 3,
    kIsMesh = 1u << 4,
    kIsPlane = 1u << 5,  // unbounded: outside the structure, tested against everything
    kIsHull = 1u << 6,
  };
  enum Mark : std::uint8_t {
    kMoved = 1,
    kTouched = 2,  // more than the box may have changed: its pairs are checked against all rules
  };

  struct Proxy {
    std::uint32_t flags = 0;
    core::BodyIndex body = core::kNone;
    Filter filter;
  };

  // Where a body was when its fat boxes were made, and how far it may go from there: while its
  // centre stays within [-low, +high] of `center`, turning included, the fat boxes hold.
  struct alignas(64) Leash {
    double center[3] = {};
    double orientation[4] = {1, 0, 0, 0};
    float reach = 0;  // m, farthest that a turn of one radian moves a point of a shape
    float least = 0;  // m, of low and high: the first cache line decides for a body at rest
    float low[3] = {}, high[3] = {};  // m
    float room = 0;  // m, by which turns however long can change the sides of a shape's tight box
    std::uint32_t proxies = 0;
  };

  struct WorkerBuffers {
    std::vector<std::uint64_t> keys;  // pairs found
    std::vector<ColliderIndex> candidates;
    std::uint64_t found = 0;  // candidates of this step
  };

  static bool of_fixed(const Proxy& proxy) { return !(proxy.flags & (kOfDynamic | kOfKinematic)); }
  static bool holds(const Leash& leash, const core::BodyPose& pose, const core::BodyMotion& motion,
                    double dt);
  static bool holds_along(const Leash& leash, const core::BodyPose& pose,
                          const core::BodyMotion& motion, double dt, double free);

  void describe(const core::Bodies& bodies, const core::Colliders& colliders,
                ColliderIndex collider);
  void enter(ColliderIndex collider);
  template <class Visit>
  void for_proxies_of(const core::Bodies& bodies, const core::Colliders& colliders,
                      core::BodyIndex body, const Visit& visit) const;
  void touch_body(const core::Bodies& bodies, const core::Colliders& colliders,
                  core::BodyIndex body);

  void set_leash(const core::Bodies& bodies, core::BodyIndex body, double dt);
  Aabb fattened(const core::Bodies& bodies, const core::Collider& collider,
                core::BodyIndex body) const;
  bool still_inside(const StepContext& step, core::BodyIndex body);
  void enlarge(const StepContext& step, core::BodyIndex body);

  void touch_rejoined(const StepContext& step);
  void touch_quarantined(const StepContext& step);
  void gather_moved();

  bool may_pair(const StepContext& step, const Proxy& a, const Proxy& b) const;
  void query_one(const StepContext& step, ColliderIndex collider, WorkerBuffers& buffers) const;

  void find_parted(const StepContext& step, Task& task);
  bool stays(const StepContext& step, std::uint32_t row);
  void sort_keys(Task& task);
  void cut_merge();
  void prepare_merge(const StepContext& step, std::uint32_t block);
  core::ContactPair make_pair(const StepContext& step, std::uint64_t key) const;
  void exchange_manifolds(core::ContactTable& table);
  void merge(const core::ContactTable& table, std::uint32_t block);
  void index_pairs(const core::ContactTable& table);
  void index_owners(const std::vector<ColliderIndex>& owner, IndexRange rows);
  bool list_active(const StepContext& step, Task& task);

  std::vector<Aabb> fat_;              // [collider]
  std::vector<Proxy> proxies_;         // [collider]
  std::vector<std::uint8_t> marks_;    // [collider]
  std::vector<ColliderIndex> planes_;  // ascending
  std::vector<Leash> leashes_;         // [body]
  Travels travels_;
  double last_dt_ = 1.0 / 60;  // s, for fat boxes made between steps

  std::vector<ColliderIndex> added_;    // by the call in progress
  std::vector<ColliderIndex> moved_;    // in this step; ascending
  std::vector<ColliderIndex> bounded_;  // of these, those in the structure
  std::vector<core::BodyIndex> last_awake_;
  std::vector<std::uint64_t> last_no_collide_;

  // The pair table's keys, compact: the higher partners of a collider are a range of partner_.
  struct PartnerRange {
    std::uint32_t begin = 0, end = 0;
  };
  std::vector<PartnerRange> partners_;  // [collider]
  std::vector<ColliderIndex> owner_;    // [pair] the lower collider
  std::vector<ColliderIndex> partner_;  // [pair] the higher one

  // Of merge_pairs. What leaves and what comes is found in blocks; then the table is written anew
  // in blocks that have whole owners.
  struct MergeBlock {  // up to where the next one begins
    ColliderIndex owner = 0;
    std::uint32_t row = 0;                                         // of the table
    std::uint32_t parted = 0;                                      // into parted_
    std::uint32_t added = 0;                                       // into added_pairs_
    std::uint32_t merged() const { return row - parted + added; }  // row of the table to come
  };
  std::vector<WorkerBuffers> workers_;
  jobs::RowFilter filter_;
  std::vector<std::uint32_t> parted_;  // rows of the pair table, ascending
  std::vector<ColliderIndex> cuts_;
  std::vector<MergeBlock> merge_blocks_;  // and one past the last
  std::vector<core::ContactPair> parted_pairs_, added_pairs_;
  std::vector<core::ContactPair> next_pairs_;
  std::vector<ColliderIndex> next_owner_, next_partner_;
  std::atomic<bool> unseen_{false};  // a pair became kUnseen in this step
  bool list_stale_ = true;           // ContactTable::active does not fit the pairs
  std::uint64_t proxies_touched_ = 0;
};

}  // namespace skerry::collision
