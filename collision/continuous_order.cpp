// Continuous collision: who stops when.
#include <algorithm>
#include <numeric>
#include <utility>

#include "collision/continuous_scratch.h"
#include "core/growth.h"

namespace skerry::collision {

using core::BodyIndex;
using core::FastBodies;
using core::FastPair;

namespace {

// Takes meetings in order of time.
class Impacts {
 public:
  explicit Impacts(const StepContext& step)
      : step_(step), fast_(*step.fast), scratch_(*step.continuous) {}

  void run(Task& task) {
    collect();
    if (scratch_.meetings.empty()) return;
    rank_bodies();
    join_bodies();
    list_by_body();
    foresee(task);
    while (!scratch_.meetings.empty()) take(next());
    std::sort(fast_.stopped.begin(), fast_.stopped.end());
  }

 private:
  static bool later(const Meeting& a, const Meeting& b) { return b < a; }

  void collect() {
    scratch_.meetings.clear();
    scratch_.version.assign(fast_.pairs.size(), 0);
    for (std::uint32_t i = 0; i < fast_.pairs.size(); ++i)
      if (!fast_.pairs[i].sensor && fast_.pairs[i].touch <= 1) push(i);
  }

  void rank_bodies() {
    std::vector<std::uint32_t>& rank = scratch_.rank;
    if (rank.size() < step_.bodies->rows()) rank.resize(step_.bodies->rows());
    for (std::uint32_t i = 0; i < fast_.bodies.size(); ++i) rank[fast_.bodies[i]] = i;
  }

  // Makes a ring of the bodies that joints with locks hold together, slow ones too; each fast one is
  // alone at first.
  void join_bodies() {
    std::vector<std::uint32_t>&next = scratch_.joined, &root = scratch_.ring;
    scratch_.members = fast_.bodies;
    core::make_room(next, fast_.bodies.size());
    next.resize(fast_.bodies.size());
    std::iota(next.begin(), next.end(), 0u);
    root = next;
    for (const core::Joint& joint : step_.joints->rows) {
      if (!joint.alive || joint.lock_count == 0) continue;
      if (!may_go_back(joint.a) || !may_go_back(joint.b)) continue;
      const std::uint32_t a = member(joint.a), b = member(joint.b);
      const std::uint32_t ring_a = ring_of(a), ring_b = ring_of(b);
      if (ring_a == ring_b) continue;
      root[ring_b] = ring_a;
      std::swap(next[a], next[b]);
    }
  }
  bool may_go_back(BodyIndex body) const {
    if (body == core::kNone || step_.bodies->is(body, core::kQuarantined)) return false;
    return step_.bodies->is(body, core::kDynamic | core::kAwake);
  }
  std::uint32_t member(BodyIndex body) {
    std::vector<BodyIndex>& members = scratch_.members;
    const std::uint32_t rank = scratch_.rank[body];
    if (rank < members.size() && members[rank] == body) return rank;
    const auto last = static_cast<std::uint32_t>(members.size());
    scratch_.rank[body] = last;
    members.push_back(body);
    scratch_.joined.push_back(last);
    scratch_.ring.push_back(last);
    fast_.part[body] = 1;
    return last;
  }
  std::uint32_t ring_of(std::uint32_t rank) {
    std::vector<std::uint32_t>& root = scratch_.ring;
    while (root[rank] != rank) rank = root[rank] = root[root[rank]];
    return rank;
  }

  void list_by_body() {
    std::vector<std::uint32_t>&first = scratch_.first_of, &rank = scratch_.rank;
    core::refill(first, fast_.bodies.size() + 1, 0u);
    for (const FastPair& pair : fast_.pairs) {
      if (!both_fast(pair)) continue;
      ++first[rank[pair.body_a]];
      ++first[rank[pair.body_b]];
    }
    std::uint32_t sum = 0;
    for (std::uint32_t& end : first) end = sum += end;
    core::make_room(scratch_.of_body, sum);
    scratch_.of_body.resize(sum);
    for (auto i = static_cast<std::uint32_t>(fast_.pairs.size()); i-- > 0;) {
      const FastPair& pair = fast_.pairs[i];
      if (!both_fast(pair)) continue;
      scratch_.of_body[--first[rank[pair.body_a]]] = i;
      scratch_.of_body[--first[rank[pair.body_b]]] = i;
    }
  }
  bool both_fast(const FastPair& pair) const {
    return !pair.sensor && is_fast(pair.body_a) && is_fast(pair.body_b);
  }

  void push(std::uint32_t pair) {
    scratch_.meetings.push_back({fast_.pairs[pair].touch, pair, scratch_.version[pair]});
    std::push_heap(scratch_.meetings.begin(), scratch_.meetings.end(), later);
  }
  Meeting next() {
    std::pop_heap(scratch_.meetings.begin(), scratch_.meetings.end(), later);
    const Meeting meeting = scratch_.meetings.back();
    scratch_.meetings.pop_back();
    return meeting;
  }

  void take(const Meeting& meeting) {
    if (meeting.version != scratch_.version[meeting.pair]) return;
    const FastPair& pair = fast_.pairs[meeting.pair];
    for (const BodyIndex body : {pair.body_a, pair.body_b})
      if (is_fast(body) && fast_.part[body] > meeting.time) stop(body, meeting);
  }

  // A body stops with those that joints hold to it: alone it would tear them.
  void stop(BodyIndex body, const Meeting& at) {
    const std::uint32_t first = scratch_.rank[body];
    std::uint32_t i = first;
    do {
      fast_.part[scratch_.members[i]] = at.time;
      i = scratch_.joined[i];
    } while (i != first);
    do {
      fast_.stopped.push_back(scratch_.members[i]);
      if (i < fast_.bodies.size()) meet_anew(i, at);
      i = scratch_.joined[i];
    } while (i != first);
  }

  // The pairs of a body that has stopped meet elsewhere, earlier or later, or not at all. Those of
  // `at` itself are done.
  void meet_anew(std::uint32_t rank, const Meeting& at) {
    for (std::uint32_t i = scratch_.first_of[rank]; i < scratch_.first_of[rank + 1]; ++i) {
      const std::uint32_t row = scratch_.of_body[i];
      if (row == at.pair) continue;
      FastPair& pair = fast_.pairs[row];
      ++scratch_.version[row];
      const double time = impact_of(row);
      pair.touch = std::max(time, at.time);
      if (pair.touch <= 1) push(row);
    }
  }

  // Bodies mostly stop where the first meetings of all say, and their pairs then mostly meet nothing
  // else. What such stops call for is found out by all workers before it is asked for.
  void foresee(Task& task) {
    foresee_stops();
    scratch_.foreseen.clear();
    scratch_.foreseen_of.assign(fast_.pairs.size() + 1, 0);
    for (std::uint32_t row = 0; row < fast_.pairs.size(); ++row) {
      scratch_.foreseen_of[row] = static_cast<std::uint32_t>(scratch_.foreseen.size());
      if (both_fast(fast_.pairs[row])) foresee_ends(row);
    }
    const auto count = static_cast<std::uint32_t>(scratch_.foreseen.size());
    scratch_.foreseen_of.back() = count;
    constexpr std::uint32_t kGrain = 16;
    jobs::run_blocks(task, jobs::blocks_of(count, kGrain),
                     [&](std::uint32_t block, std::uint32_t worker) {
                       const IndexRange range = jobs::items_of(block, kGrain, count);
                       for (std::uint32_t i = range.begin; i < range.end; ++i) {
                         ForeseenImpact& impact = scratch_.foreseen[i];
                         impact.time = impact_of_pair(step_, fast_.pairs[impact.pair], impact.ends,
                                                      scratch_.workers[worker].triangles);
                       }
                     });
  }

  // When bodies would stop if none of the first meetings changed by the others.
  void foresee_stops() {
    scratch_.stop.assign(fast_.bodies.size(), {});
    scratch_.in_order = scratch_.meetings;
    std::sort(scratch_.in_order.begin(), scratch_.in_order.end());
    for (const Meeting& meeting : scratch_.in_order) {
      const FastPair& pair = fast_.pairs[meeting.pair];
      ForeseenStop* const a = stop_of(pair.body_a);
      ForeseenStop* const b = stop_of(pair.body_b);
      if ((a != nullptr && a->time <= 1) || (b != nullptr && b->time <= 1)) continue;
      for (ForeseenStop* stop : {a, b})
        if (stop != nullptr) *stop = {meeting.time, meeting.pair};
    }
  }
  ForeseenStop* stop_of(BodyIndex body) {
    return is_fast(body) ? &scratch_.stop[scratch_.rank[body]] : nullptr;
  }

  // Where the pair's bodies will have stopped when it is asked about: one of them, then both.
  void foresee_ends(std::uint32_t row) {
    const FastPair& pair = fast_.pairs[row];
    const ForeseenStop &a = *stop_of(pair.body_a), &b = *stop_of(pair.body_b);
    const bool own = a.pair == row;
    if (own || (a.time > 1 && b.time > 1)) return;
    const bool a_first = a.time <= b.time;
    scratch_.foreseen.push_back({row, a_first ? Ends{a.time, 1} : Ends{1, b.time}, kNever});
    if (a.time <= 1 && b.time <= 1) scratch_.foreseen.push_back({row, {a.time, b.time}, kNever});
  }

  double impact_of(std::uint32_t row) {
    const FastPair& pair = fast_.pairs[row];
    const Ends ends{fast_.part[pair.body_a], fast_.part[pair.body_b]};
    for (std::uint32_t i = scratch_.foreseen_of[row]; i < scratch_.foreseen_of[row + 1]; ++i)
      if (scratch_.foreseen[i].ends == ends) return scratch_.foreseen[i].time;
    return impact_of_pair(step_, pair, ends, scratch_.workers[0].triangles);
  }

  bool is_fast(BodyIndex body) const { return collision::is_fast(*step_.bodies, body); }

  const StepContext& step_;
  FastBodies& fast_;
  ContinuousScratch& scratch_;
};

}  // namespace

void order_impacts(const StepContext& step, Task& task) {
  FastBodies& fast = *step.fast;
  if (fast.pairs.empty()) return;
  Impacts(step).run(task);
  const auto end_of = [&](BodyIndex body) {
    return is_fast(*step.bodies, body) ? fast.part[body] : 1;
  };
  for (FastPair& pair : fast.pairs) {
    if (!pair.sensor) continue;
    const Ends ends{end_of(pair.body_a), end_of(pair.body_b)};
    if (std::min(ends.a, ends.b) < std::min(pair.touch, 1.0))
      pair.touch = impact_of_pair(step, pair, ends, step.continuous->workers[0].triangles);
    if (pair.touch <= 1) fast.crossed.push_back(pair);
  }
}

}  // namespace skerry::collision
