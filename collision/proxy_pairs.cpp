// ProxyBroadphase: the pair list.
#include <algorithm>

#include "collision/proxy_broadphase.h"
#include "core/assert.h"
#include "core/growth.h"
#include "jobs/blocks.h"

namespace skerry::collision {
namespace {

using core::BodyIndex;
using core::ContactPair;
using core::ContactTable;

std::uint64_t ordered_key(std::uint32_t a, std::uint32_t b) {
  return a < b ? (std::uint64_t{a} << 32) | b : (std::uint64_t{b} << 32) | a;
}

bool by_key(const ContactPair& a, const ContactPair& b) { return a.key() < b.key(); }

// The least key that a pair of this owner could have.
std::uint64_t lowest_key(ColliderIndex owner) { return std::uint64_t{owner} << 32; }

// Pairs that one block works on: some 10 us.
constexpr std::uint32_t kRowGrain = 2048;

// How many of these, ascending, are below the value.
template <class T>
std::uint32_t rank_in(const std::vector<T>& sorted, T value) {
  return static_cast<std::uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), value) -
                                    sorted.begin());
}

template <class T>
void resize(std::vector<T>& buffer, std::size_t count) {
  core::make_room(buffer, count);
  buffer.resize(count);
}

// Of a pair of which nobody is awake, and which has changed all the same. Whether it is one.
bool look_at_once(const core::Bodies& bodies, ContactPair& pair) {
  if ((bodies.flags[pair.body_a] | bodies.flags[pair.body_b]) & core::kAwake) return false;
  pair.flags |= core::kUnseen;
  return true;
}

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
  if (moved.begin == 0) prepare_ahead(task);  // first, as it takes longest
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
// pairs reads eight bytes of each: it is what a few movers among many sleepers cost.
void ProxyBroadphase::find_parted(const StepContext& step, Task& task) {
  parted_.clear();
  if (moved_.empty()) return;
  filter_.run(
      task, static_cast<std::uint32_t>(partner_.size()),
      [&](std::uint32_t row) {
        return (marks_[owner_[row]] | marks_[partner_[row]]) != 0 && !stays(step, row);
      },
      parted_);
}

bool ProxyBroadphase::stays(const StepContext& step, std::uint32_t row) {
  const ColliderIndex a = owner_[row], b = partner_[row];
  if (!overlap(fat_[a], fat_[b])) return false;
  if (!((marks_[a] | marks_[b]) & kTouched)) return true;
  if (!may_pair(step, proxies_[a], proxies_[b])) return false;
  core::ContactPair& pair = step.contacts->pairs[row];
  step.contacts->apart_until[pair.first_manifold] = 0;
  if (look_at_once(*step.bodies, pair)) unseen_.store(true, std::memory_order_relaxed);
  return true;
}

void ProxyBroadphase::sort_keys(Task& task) {
  jobs::run_blocks(task, static_cast<std::uint32_t>(workers_.size()),
                   [&](std::uint32_t block, std::uint32_t) {
                     std::vector<std::uint64_t>& keys = workers_[block].keys;
                     std::sort(keys.begin(), keys.end());
                   });
}

// About as many old or new pairs in each block; an owner's pairs are all in one.
void ProxyBroadphase::cut_merge() {
  cuts_.assign(1, 0);
  for (std::size_t row = kRowGrain; row < owner_.size(); row += kRowGrain)
    cuts_.push_back(owner_[row]);
  for (const WorkerBuffers& worker : workers_)
    for (std::size_t i = kRowGrain; i < worker.keys.size(); i += kRowGrain)
      cuts_.push_back(static_cast<ColliderIndex>(worker.keys[i] >> 32));
  std::sort(cuts_.begin(), cuts_.end());
  cuts_.erase(std::unique(cuts_.begin(), cuts_.end()), cuts_.end());
  cuts_.push_back(core::kNone);
  merge_blocks_.clear();
  for (const ColliderIndex cut : cuts_) {
    MergeBlock block;
    block.owner = cut;
    block.row = rank_in(owner_, cut);
    block.parted = rank_in(parted_, block.row);
    for (const WorkerBuffers& worker : workers_)
      block.added += rank_in(worker.keys, lowest_key(cut));
    merge_blocks_.push_back(block);
  }
}

// Lists a block's new pairs, merged from what the workers found, and those that leave.
void ProxyBroadphase::prepare_merge(const StepContext& step, std::uint32_t block) {
  const MergeBlock &begin = merge_blocks_[block], &end = merge_blocks_[block + 1];
  for (std::uint32_t i = begin.parted; i < end.parted; ++i)
    parted_pairs_[i] = step.contacts->pairs[parted_[i]];
  std::uint32_t to = begin.added;
  for (const WorkerBuffers& worker : workers_) {
    const std::uint32_t last = rank_in(worker.keys, lowest_key(end.owner));
    for (std::uint32_t i = rank_in(worker.keys, lowest_key(begin.owner)); i < last; ++i)
      added_pairs_[to++] = make_pair(step, worker.keys[i]);
  }
  const auto first = added_pairs_.begin() + begin.added, past = added_pairs_.begin() + end.added;
  if (workers_.size() > 1) std::sort(first, past, by_key);
  SKERRY_ASSERT(std::adjacent_find(first, past,
                                   [](const ContactPair& a, const ContactPair& b) {
                                     return a.key() == b.key();
                                   }) == past,
                "a new pair was found twice");
}

ContactPair ProxyBroadphase::make_pair(const StepContext& step, std::uint64_t key) const {
  ContactPair pair;
  pair.a = static_cast<ColliderIndex>(key >> 32);
  pair.b = static_cast<ColliderIndex>(key);
  const Proxy &a = proxies_[pair.a], &b = proxies_[pair.b];
  pair.body_a = a.body;
  pair.body_b = b.body;
  if ((a.flags | b.flags) & kIsMesh) pair.manifold_capacity = core::kMeshManifolds;
  if ((a.flags | b.flags) & kIsSensor) pair.flags |= core::kSensorPair;
  look_at_once(*step.bodies, pair);
  return pair;
}

void ProxyBroadphase::exchange_manifolds(ContactTable& table) {
  for (const ContactPair& pair : parted_pairs_) {
    core::give_manifolds(table, pair.first_manifold, pair.manifold_capacity);
    if (pair.flags & (core::kTouching | core::kBegun)) table.ended.push_back(pair);
  }
  for (ContactPair& pair : added_pairs_) {
    pair.first_manifold = core::take_manifolds(table, pair.manifold_capacity);
    if ((proxies_[pair.a].flags | proxies_[pair.b].flags) & kIsHull)
      core::take_memory(table, pair.first_manifold);
    if (pair.flags & core::kUnseen) unseen_.store(true, std::memory_order_relaxed);
  }
}

void ProxyBroadphase::merge(const ContactTable& table, std::uint32_t block) {
  const MergeBlock &begin = merge_blocks_[block], &end = merge_blocks_[block + 1];
  std::uint32_t row = begin.row, to = begin.merged();
  std::uint32_t parted = begin.parted, added = begin.added;
  while (row < end.row || added < end.added) {
    // A run of rows that stay, up to one that leaves or to where a new pair goes.
    const std::uint32_t stop = parted < end.parted ? parted_[parted] : end.row;
    std::uint32_t last = stop;
    if (added < end.added) {
      const std::uint64_t key = added_pairs_[added].key();
      for (last = row; last < stop && (lowest_key(owner_[last]) | partner_[last]) < key;) ++last;
    }
    std::copy(table.pairs.begin() + row, table.pairs.begin() + last, next_pairs_.begin() + to);
    std::copy(owner_.begin() + row, owner_.begin() + last, next_owner_.begin() + to);
    std::copy(partner_.begin() + row, partner_.begin() + last, next_partner_.begin() + to);
    to += last - row;
    row = last;
    if (row == stop && parted < end.parted) {
      ++row;
      ++parted;
    } else if (added < end.added) {
      const ContactPair& pair = added_pairs_[added++];
      next_pairs_[to] = pair;
      next_owner_[to] = pair.a;
      next_partner_[to++] = pair.b;
    }
  }
  for (row = begin.row; row < end.row; ++row) partners_[owner_[row]] = {};
  index_owners(next_owner_, {begin.merged(), end.merged()});
}

// `rows` hold all pairs of their owners.
void ProxyBroadphase::index_owners(const std::vector<ColliderIndex>& owner, IndexRange rows) {
  for (std::uint32_t row = rows.begin; row < rows.end;) {
    const ColliderIndex self = owner[row];
    PartnerRange& range = partners_[self];
    range.begin = row;
    while (row < rows.end && owner[row] == self) ++row;
    range.end = row;
  }
}

// Costs what there are pairs, however many colliders have none.
void ProxyBroadphase::index_pairs(const ContactTable& table) {
  for (const ColliderIndex owner : owner_) partners_[owner] = {};
  owner_.clear();
  partner_.clear();
  for (const ContactPair& pair : table.pairs) {
    owner_.push_back(pair.a);
    partner_.push_back(pair.b);
  }
  index_owners(owner_, {0, static_cast<std::uint32_t>(owner_.size())});
  proxies_touched_ += owner_.size();
}

// The pair list holds no pair of two bodies that cannot react, so one awake body is enough. Returns
// whether some are listed for this step only.
bool ProxyBroadphase::list_active(const StepContext& step, Task& task) {
  ContactTable& table = *step.contacts;
  const std::vector<std::uint32_t>& flags = step.bodies->flags;
  std::atomic<bool> for_once{false};
  table.active.clear();
  filter_.run(
      task, static_cast<std::uint32_t>(table.pairs.size()),
      [&](std::uint32_t row) {
        ContactPair& pair = table.pairs[row];
        const bool awake = (flags[pair.body_a] | flags[pair.body_b]) & core::kAwake;
        if (!awake && !(pair.flags & core::kUnseen)) return false;
        if (!awake) for_once.store(true, std::memory_order_relaxed);
        pair.flags &= ~std::uint32_t{core::kUnseen};
        return true;
      },
      table.active);
  return for_once.load(std::memory_order_relaxed);
}

void ProxyBroadphase::merge_pairs(const StepContext& step, Task& task) {
  ContactTable& table = *step.contacts;
  find_parted(step, task);
  std::size_t added = 0;
  for (const WorkerBuffers& worker : workers_) added += worker.keys.size();
  const bool changed = !parted_.empty() || added > 0;
  if (changed) {
    sort_keys(task);
    cut_merge();
    const auto blocks = static_cast<std::uint32_t>(merge_blocks_.size() - 1);
    resize(parted_pairs_, parted_.size());
    resize(added_pairs_, added);
    jobs::run_blocks(task, blocks,
                     [&](std::uint32_t block, std::uint32_t) { prepare_merge(step, block); });
    exchange_manifolds(table);
    const std::uint32_t rows = merge_blocks_.back().merged();
    proxies_touched_ += owner_.size() + rows;
    resize(next_pairs_, rows);
    resize(next_owner_, rows);
    resize(next_partner_, rows);
    jobs::run_blocks(task, blocks,
                     [&](std::uint32_t block, std::uint32_t) { merge(table, block); });
    std::swap(table.pairs, next_pairs_);
    std::swap(owner_, next_owner_);
    std::swap(partner_, next_partner_);
    for (WorkerBuffers& worker : workers_) worker.keys.clear();
  }
  // Keys of pairs that were dropped between steps came before.
  if (!std::is_sorted(table.ended.begin(), table.ended.end(), by_key))
    std::sort(table.ended.begin(), table.ended.end(), by_key);
  for (const ColliderIndex collider : moved_) marks_[collider] = 0;

  const bool awake_changed = last_awake_ != step.bodies->awake;
  if (awake_changed) last_awake_ = step.bodies->awake;
  if (changed || awake_changed || list_stale_ || unseen_.load(std::memory_order_relaxed))
    list_stale_ = list_active(step, task);
  unseen_.store(false, std::memory_order_relaxed);
}

}  // namespace skerry::collision
