// Disjoint sets of bodies (union-find), joined by several workers at once.
#pragma once

#include <atomic>
#include <span>
#include <vector>

#include "core/bodies.h"

namespace skerry::solver {

// Forests in which every body hangs below a lower one, so that a set's root is its lowest member whatever
// the order of unions. Links by compare and swap, as in Anderson and Woll 1991, "Wait-free parallel
// algorithms for the union-find problem"; paths are halved as they are walked: a stale store still
// names a lower body of the same set. What was joined may be read once its writers are known to be done.
class DisjointSets {
 public:
  // Afterwards none of `bodies` is in a set. With `shared`, several workers may join them at once.
  void begin(std::uint32_t rows, std::span<const core::BodyIndex> bodies, bool shared) {
    shared_ = shared;
    if (parent_.size() < rows) parent_.resize(rows);
    for (const core::BodyIndex body : bodies) parent_[body] = core::kNone;
  }

  // Makes the body a set of its own if it is in none.
  void add(core::BodyIndex body) {
    if (parent(body) == core::kNone) link(body, core::kNone, body);
  }

  // Of two bodies that are in sets.
  void unite(core::BodyIndex a, core::BodyIndex b) {
    if (parent(a) == parent(b)) return;
    while (true) {
      a = root(a);
      b = root(b);
      if (a == b) return;
      if (a > b ? link(a, a, b) : link(b, b, a)) return;
    }
  }

  // A lower body of the same set; the body itself if it is the lowest; kNone if it is in no set.
  core::BodyIndex parent(core::BodyIndex body) const {
    return std::atomic_ref(parent_[body]).load(std::memory_order_relaxed);
  }

 private:
  bool link(core::BodyIndex body, core::BodyIndex from, core::BodyIndex to) {
    const std::atomic_ref parent(parent_[body]);
    if (shared_) return parent.compare_exchange_strong(from, to, std::memory_order_relaxed);
    parent.store(to, std::memory_order_relaxed);
    return true;
  }

  core::BodyIndex root(core::BodyIndex body) {
    for (core::BodyIndex up = parent(body); up != body; up = parent(body)) {
      const core::BodyIndex above = parent(up);
      if (above == up) return up;
      std::atomic_ref(parent_[body]).store(above, std::memory_order_relaxed);
      body = above;
    }
    return body;
  }

  mutable std::vector<core::BodyIndex> parent_;  // [rows]
  bool shared_ = false;
};

}  // namespace skerry::solver
