// What the stages of continuous collision share.
#pragma once

#include <vector>

#include "collision/bounds.h"
#include "collision/continuous.h"
#include "collision/time_of_impact.h"
#include "jobs/blocks.h"

namespace skerry::collision {

// A meeting of two fast bodies, or of a fast one with a slow one, in the order in which meetings are
// taken.
struct Meeting {
  double time;
  std::uint32_t pair;     // row of FastBodies::pairs
  std::uint32_t version;  // of that pair: an old one no longer counts
  bool operator<(const Meeting& other) const {
    if (time != other.time) return time < other.time;
    return pair != other.pair ? pair < other.pair : version < other.version;
  }
};

// From which parts of the step on the bodies of a pair stand still.
struct Ends {
  double a = 1, b = 1;
  bool operator==(const Ends&) const = default;
};

// When a pair would first meet if its bodies ended there.
struct ForeseenImpact {
  std::uint32_t pair;
  Ends ends;
  double time;
};

// When a body will stop, as far as can be told, and the pair that stops it.
struct ForeseenStop {
  double time = kNever;
  std::uint32_t pair = core::kNone;
};

// m: far above touch_gap() of bodies that collide.
inline constexpr double kTouchReach = 1e-3;

// Where a body may have been during a step, wherever it was stopped.
struct Reach {
  Vec3 low, high;  // m
};

// A collider that has left its fat box, with where it has been.
struct ThrownBox {
  Aabb box;
  ColliderIndex collider;
};

struct alignas(64) FastScratch {  // of one worker
  std::vector<std::uint32_t> triangles;
  std::vector<ColliderIndex> found;
  std::vector<ThrownBox> thrown;
  std::vector<std::uint64_t> keys;  // (a, b) of pairs that the broadphase did not foresee
};

class ContinuousScratch {
 public:
  explicit ContinuousScratch(std::uint32_t worker_count) : workers(worker_count) {}

  std::vector<FastScratch> workers;
  // Of find_fast.
  jobs::RowFilter filter;
  std::vector<Reach> reach;         // [body rows]; of awake bodies
  std::vector<std::uint32_t> rows;  // into ContactTable::active
  std::vector<ThrownBox> thrown;
  std::vector<std::uint64_t> keys, more_keys;
  std::vector<core::FastPair> merged;
  // Of stop_fast.
  std::vector<Meeting> meetings;         // a heap, earliest first
  std::vector<std::uint32_t> version;    // [pairs]
  std::vector<core::BodyIndex> members;  // FastBodies::bodies, then slow ones that have joints
  std::vector<std::uint32_t> rank;       // [body rows] of a member, in `members`
  std::vector<std::uint32_t> joined;     // [members] the next of those that joints hold together
  std::vector<std::uint32_t> ring;       // [members] towards one that stands for all of its ring
  std::vector<std::uint32_t> first_of;   // [fast bodies + 1] into of_body
  std::vector<std::uint32_t> of_body;    // pairs of two fast ones, of each body, ascending
  std::vector<Meeting> in_order;
  std::vector<ForeseenStop> stop;          // [fast bodies]
  std::vector<ForeseenImpact> foreseen;    // by pair
  std::vector<std::uint32_t> foreseen_of;  // [pairs + 1] into foreseen
};

// When the two first meet (part of the step), or kNever. Any number of threads at once.
double impact_of_pair(const StepContext& step, const core::FastPair& pair, const Ends& ends,
                      std::vector<std::uint32_t>& triangles);

inline bool is_fast(const core::Bodies& bodies, core::BodyIndex body) {
  return bodies.is(body, core::kFast);
}

}  // namespace skerry::collision
