// ProxyBroadphase: the pair list.
#include <algorithm>

#include "collision/proxy_broadphase.h"
#include "core/assert.h"
#include "core/growth.h"

namespace skerry::collision {
namespace {

using core::BodyIndex;
using core::ContactPair;
using core::ContactTable;

std::uint64_t ordered_key(std::uint32_t a, std::uint32_t b) {
  return a < b ? (std::uint64_t{a} << 32) | b : (std::uint64_t{b} << 32) | a;
}

bool by_key(const ContactPair& a, const ContactPair& b) { return a.key() < b.key(); }

}  // namespace

void ProxyBroadphase::collect(const Aabb& box, std::vector<ColliderIndex>& found) const {
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  find(box, true, found);
  for (const ColliderIndex plane : planes_)
    if (overlap(fat_[plane], box)) found.push_back(plane);
  std::sort(found.begin() + first, found.end());
}

// Every rule but the boxes'.
bool ProxyBroadphase::may_pair(const StepContext& step, const Proxy& a, const Proxy& b) const {
  if (a.body == b.body) return false;
  const std::uint32_t either = a.flags | b.flags;
  if (!(either & kOfDynamic) && !((either & kIsSensor) && (either & kOfKinematic))) return false;
  if (!core::filters_meet(a.filter, b.filter)) return false;
  if ((step.bodies->flags[a.body] | step.bodies->flags[b.body]) & core::kQuarantined) return false;
  const std::vector<std::uint64_t>& joined = step.joints->no_collide;
  return joined.empty() ||
         !std::binary_search(joined.begin(), joined.end(), ordered_key(a.body, b.body));
}

bool ProxyBroadphase::is_pair(ColliderIndex a, ColliderIndex b) const {
  if (a > b) std::swap(a, b);
  const auto begin = partner_.begin() + partners_[a].begin,
             end = partner_.begin() + partners_[a].end;
  if (end - begin > 16) return std::binary_search(begin, end, b);
  return std::find(begin, end, b) != end;
}

void ProxyBroadphase::query_pairs(const StepContext& step, IndexRange moved, Task& task) {
  SKERRY_ASSERT(task.worker() < workers_.size(), "StepContext::worker_count is too small");
  WorkerBuffers& buffers = workers_[task.worker()];
  for (std::uint32_t i = moved.begin; i < moved.end; ++i) query_one(step, moved_[i], buffers);
}

void ProxyBroadphase::query_one(const StepContext& step, ColliderIndex collider,
                                WorkerBuffers& buffers) const {
  const Proxy& self = proxies_[collider];
  const Aabb& box = fat_[collider];
  std::vector<ColliderIndex>& candidates = buffers.candidates;
  candidates.clear();
  find(box, !of_fixed(self), candidates);
  for (const ColliderIndex plane : planes_)
    if (overlap(fat_[plane], box)) candidates.push_back(plane);
  for (const ColliderIndex other : candidates) {
    // Of two that moved, the lower one reports.
    if (other == collider || (marks_[other] && other < collider)) continue;
    if (is_pair(collider, other) || !may_pair(step, self, proxies_[other])) continue;
    buffers.keys.push_back(ordered_key(collider, other));
  }
  buffers.found += candidates.size();
}

// Pairs of moved colliders whose boxes have parted, or that a rule now forbids. The pass over all
// pairs reads four bytes of each: it is what a few movers among many sleepers cost.
void ProxyBroadphase::find_parted(const StepContext& step) {
  parted_.clear();
  if (moved_.empty()) return;
  const auto end = static_cast<std::uint32_t>(partner_.size());
  core::make_room(parted_, end + 1);
  parted_.resize(end + 1);
  std::uint32_t count = 0;
  for (std::uint32_t row = 0; row < end; ++row) {
    parted_[count] = row;
    count += marks_[partner_[row]] != 0;
  }
  parted_.resize(count);
  for (const ColliderIndex a : moved_)
    for (std::uint32_t row = partners_[a].begin; row < partners_[a].end; ++row)
      if (!marks_[partner_[row]]) parted_.push_back(row);
  std::sort(parted_.begin(), parted_.end());
  std::erase_if(parted_,
                [&](std::uint32_t row) { return stays(step, row, step.contacts->pairs[row].a); });
}

bool ProxyBroadphase::stays(const StepContext& step, std::uint32_t row, ColliderIndex a) {
  const ColliderIndex b = partner_[row];
  if (!overlap(fat_[a], fat_[b])) return false;
  if (!((marks_[a] | marks_[b]) & kTouched)) return true;
  if (!may_pair(step, proxies_[a], proxies_[b])) return false;
  look_at_once(step, step.contacts->pairs[row]);
  return true;
}

// A pair of which nobody is awake, and which has changed all the same.
void ProxyBroadphase::look_at_once(const StepContext& step, ContactPair& pair) {
  const std::vector<std::uint32_t>& flags = step.bodies->flags;
  if ((flags[pair.body_a] | flags[pair.body_b]) & core::kAwake) return;
  pair.flags |= core::kUnseen;
  unseen_ = true;
}

void ProxyBroadphase::gather_new() {
  new_keys_.clear();
  for (WorkerBuffers& worker : workers_) {
    new_keys_.insert(new_keys_.end(), worker.keys.begin(), worker.keys.end());
    worker.keys.clear();
  }
  std::sort(new_keys_.begin(), new_keys_.end());
  SKERRY_ASSERT(std::adjacent_find(new_keys_.begin(), new_keys_.end()) == new_keys_.end(),
                "a new pair was found twice");
}

ContactPair ProxyBroadphase::make_pair(const StepContext& step, std::uint64_t key) {
  ContactPair pair;
  pair.a = static_cast<ColliderIndex>(key >> 32);
  pair.b = static_cast<ColliderIndex>(key);
  const Proxy &a = proxies_[pair.a], &b = proxies_[pair.b];
  pair.body_a = a.body;
  pair.body_b = b.body;
  if ((a.flags | b.flags) & kIsMesh) pair.manifold_capacity = core::kMeshManifolds;
  if ((a.flags | b.flags) & kIsSensor) pair.flags |= core::kSensorPair;
  pair.first_manifold = core::take_manifolds(*step.contacts, pair.manifold_capacity);
  core::set_materials(*step.contacts, pair, step.colliders->rows[pair.a],
                      step.colliders->rows[pair.b]);
  look_at_once(step, pair);
  return pair;
}

void ProxyBroadphase::remove_parted(ContactTable& table) {
  if (parted_.empty()) return;
  std::uint32_t kept = parted_[0];
  std::size_t next = 0;
  for (std::uint32_t row = kept; row < table.pairs.size(); ++row) {
    const ContactPair& pair = table.pairs[row];
    if (next < parted_.size() && parted_[next] == row) {
      ++next;
      core::give_manifolds(table, pair.first_manifold, pair.manifold_capacity);
      if (pair.flags & (core::kTouching | core::kBegun)) table.ended.push_back(pair);
    } else {
      table.pairs[kept++] = pair;
    }
  }
  table.pairs.resize(kept);
}

// Merges from the back, so that rows below the first new pair stay where they are.
void ProxyBroadphase::insert_new(const StepContext& step, ContactTable& table) {
  new_pairs_.clear();
  for (const std::uint64_t key : new_keys_) new_pairs_.push_back(make_pair(step, key));
  std::size_t old = table.pairs.size(), added = new_pairs_.size(), to = old + added;
  table.pairs.resize(to);
  while (added > 0) {
    const bool keep = old > 0 && by_key(new_pairs_[added - 1], table.pairs[old - 1]);
    table.pairs[--to] = keep ? table.pairs[--old] : new_pairs_[--added];
  }
}

// Costs what there are pairs, however many colliders have none.
void ProxyBroadphase::index_pairs(const ContactTable& table) {
  for (const ColliderIndex owner : owners_) partners_[owner] = {};
  proxies_touched_ += owners_.size();
  owners_.clear();
  partner_.clear();
  for (const ContactPair& pair : table.pairs) {
    const auto row = static_cast<std::uint32_t>(partner_.size());
    if (owners_.empty() || owners_.back() != pair.a) {
      owners_.push_back(pair.a);
      partners_[pair.a].begin = row;
    }
    partners_[pair.a].end = row + 1;
    partner_.push_back(pair.b);
  }
  proxies_touched_ += owners_.size();
}

// The pair list holds no pair of two bodies that cannot react, so one awake body is enough. Returns
// whether some are listed for this step only.
bool ProxyBroadphase::list_active(const StepContext& step) {
  ContactTable& table = *step.contacts;
  const std::vector<std::uint32_t>& flags = step.bodies->flags;
  table.active.clear();
  bool for_once = false;
  for (std::uint32_t row = 0; row < table.pairs.size(); ++row) {
    ContactPair& pair = table.pairs[row];
    const bool awake = (flags[pair.body_a] | flags[pair.body_b]) & core::kAwake;
    if (!awake && !(pair.flags & core::kUnseen)) continue;
    for_once |= !awake;
    pair.flags &= ~std::uint32_t{core::kUnseen};
    table.active.push_back(row);
  }
  return for_once;
}

void ProxyBroadphase::merge_pairs(const StepContext& step) {
  ContactTable& table = *step.contacts;
  find_parted(step);
  gather_new();
  const bool changed = !parted_.empty() || !new_keys_.empty();
  if (changed) {
    remove_parted(table);
    insert_new(step, table);
    index_pairs(table);
  }
  // Keys of pairs that were dropped between steps came before.
  if (!std::is_sorted(table.ended.begin(), table.ended.end(), by_key))
    std::sort(table.ended.begin(), table.ended.end(), by_key);
  for (const ColliderIndex collider : moved_) marks_[collider] = 0;

  const bool awake_changed = last_awake_ != step.bodies->awake;
  if (awake_changed) last_awake_ = step.bodies->awake;
  if (changed || awake_changed || list_stale_ || unseen_) list_stale_ = list_active(step);
  unseen_ = false;
}

}  // namespace skerry::collision
