// Continuous collision: which bodies are fast, and what they may meet.
#include <algorithm>
#include <cmath>

#include "collision/broadphase.h"
#include "collision/continuous_scratch.h"
#include "collision/time_of_impact.h"
#include "core/growth.h"
#include "core/rounding.h"

namespace skerry::collision {
namespace {

using core::Bodies;
using core::BodyIndex;
using core::Collider;
using core::ContactPair;
using core::FastBodies;
using core::FastPair;
using core::FastStart;
using core::ShapeType;

// Faster kinematic bodies are foreseen by contacts alone: they cannot stop.
bool is_fast_kinematic(const StepContext& step, BodyIndex body) {
  return step.bodies->is(body, core::kKinematic | core::kAwake) &&
         core::moves_fast(*step.bodies, body, step.dt);
}

bool may_meet(const StepContext& step, BodyIndex a, BodyIndex b) {
  return !is_fast_kinematic(step, a) && !is_fast_kinematic(step, b);
}

bool kinematic_may_cross(const StepContext& step, BodyIndex body) {
  return step.settings->continuous && is_fast_kinematic(step, body);
}

// Of a pair that the broadphase foresaw.
bool is_fast_pair(const StepContext& step, const ContactPair& pair) {
  const std::vector<std::uint32_t>& flags = step.bodies->flags;
  const bool fast = (flags[pair.body_a] | flags[pair.body_b]) & core::kFast;
  if (!(pair.flags & core::kSensorPair)) return fast && may_meet(step, pair.body_a, pair.body_b);
  if (pair.flags & core::kBegun) return false;  // its overlap at one pose a step says enough
  return fast || kinematic_may_cross(step, pair.body_a) || kinematic_may_cross(step, pair.body_b);
}

// The box of the ball about a body that holds its shapes.
Reach reach_of(const StepContext& step, BodyIndex body) {
  const Bodies& bodies = *step.bodies;
  const Vec3& center = bodies.pose[body].center;
  const double radius = bodies.mass[body].radius * (1 + 1e-6);
  if (!bodies.is(body, core::kAwake))
    return {center - Vec3::Constant(radius), center + Vec3::Constant(radius)};
  const Vec3& velocity = bodies.motion[body].linear;
  const bool fast = is_fast(bodies, body);
  const FastStart* const start = fast ? &step.fast->start[body] : nullptr;
  const Vec3 from = fast ? start->pose.center : Vec3(center - velocity * step.dt);
  // A parabola leaves the line between its ends by an eighth of what its speed changes.
  const double bent = fast ? 0.125 * step.dt * (velocity - start->motion.linear).norm() : 0;
  const Vec3 slack = Vec3::Constant(radius + bent);
  return {from.cwiseMin(center) - slack, from.cwiseMax(center) + slack};
}

void reach_of_awake(const StepContext& step, Task& task) {
  std::vector<Reach>& reach = step.continuous->reach;
  const std::vector<BodyIndex>& awake = step.bodies->awake;
  const auto count = static_cast<std::uint32_t>(awake.size());
  constexpr std::uint32_t kGrain = 512;
  if (reach.size() < step.bodies->rows()) reach.resize(step.bodies->rows());
  jobs::run_blocks(task, jobs::blocks_of(count, kGrain), [&](std::uint32_t block, std::uint32_t) {
    const IndexRange range = jobs::items_of(block, kGrain, count);
    for (std::uint32_t i = range.begin; i < range.end; ++i)
      reach[awake[i]] = reach_of(step, awake[i]);
  });
}

bool may_reach(const StepContext& step, const ContactPair& pair) {
  const std::vector<Reach>& reach = step.continuous->reach;
  for (const ColliderIndex collider : {pair.a, pair.b})
    if (step.colliders->rows[collider].type == ShapeType::plane) return true;
  const auto of = [&](BodyIndex body) {
    return step.bodies->is(body, core::kAwake) ? reach[body] : reach_of(step, body);
  };
  const Reach a = of(pair.body_a), b = of(pair.body_b);
  const double touch = kTouchReach;
  return ((a.low.array() <= b.high.array() + touch) && (b.low.array() <= a.high.array() + touch))
      .all();
}

void list_active_pairs(const StepContext& step, Task& task) {
  ContinuousScratch& scratch = *step.continuous;
  const core::ContactTable& contacts = *step.contacts;
  std::vector<FastPair>& pairs = step.fast->pairs;
  reach_of_awake(step, task);
  scratch.rows.clear();
  scratch.filter.run(
      task, static_cast<std::uint32_t>(contacts.active.size()),
      [&](std::uint32_t i) {
        const ContactPair& pair = contacts.pairs[contacts.active[i]];
        return is_fast_pair(step, pair) && may_reach(step, pair);
      },
      scratch.rows);
  const auto count = static_cast<std::uint32_t>(scratch.rows.size());
  core::make_room(pairs, count);
  pairs.resize(count);
  constexpr std::uint32_t kGrain = 1024;
  jobs::run_blocks(task, jobs::blocks_of(count, kGrain), [&](std::uint32_t block, std::uint32_t) {
    const IndexRange range = jobs::items_of(block, kGrain, count);
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const std::uint32_t row = contacts.active[scratch.rows[i]];
      const ContactPair& pair = contacts.pairs[row];
      const bool sensor = pair.flags & core::kSensorPair;
      pairs[i] = {pair.a, pair.b, pair.body_a, pair.body_b, kNever, sensor, row};
    }
  });
}

Aabb box_over_step(const StepContext& step, ColliderIndex collider, BodyIndex body) {
  const Collider& row = step.colliders->rows[collider];
  const Aabb from = tight_bounds(row, step.fast->start[body].pose);
  Aabb box = tight_bounds(row, step.bodies->pose[body]);
  const double turn = step.fast->start[body].angle;
  const double reach = double(step.bodies->mass[body].turn_radius);
  // Between its ends an arc leaves the box of the two by less than its height.
  const auto bulge = core::rounded_to_float(reach * std::min(2.0, 0.125 * turn * turn));
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::min(box.min[axis], from.min[axis]) - bulge;
    box.max[axis] = std::max(box.max[axis], from.max[axis]) + bulge;
  }
  return box;
}

template <class Visit>
void for_colliders(const StepContext& step, BodyIndex body, const Visit& visit) {
  for (ColliderIndex c = step.bodies->first_collider[body]; c != core::kNone;
       c = step.colliders->rows[c].next_in_body)
    visit(c);
}

// Fat boxes foresee flights that forces bend by no more than a contact's reach.
bool was_foreseen(const StepContext& step, BodyIndex body) {
  const FastStart& start = step.fast->start[body];
  const core::BodyMotion& motion = step.bodies->motion[body];
  const double turn_radius = double(step.bodies->mass[body].turn_radius);
  const double change =
      (motion.linear - start.motion.linear).norm() +
      turn_radius * std::max(0.0, motion.angular.norm() - start.motion.angular.norm());
  return start.flight == core::FastFlight::free && change * step.dt <= double(kSpeculativeDistance);
}

// Colliders of bodies that impacts have thrown out of their fat boxes, from the left to the right.
void list_thrown(const StepContext& step, Task& task) {
  ContinuousScratch& scratch = *step.continuous;
  const std::vector<BodyIndex>& bodies = step.fast->bodies;
  const auto count = static_cast<std::uint32_t>(bodies.size());
  constexpr std::uint32_t kGrain = 256;
  for (FastScratch& worker : scratch.workers) worker.thrown.clear();
  jobs::run_blocks(task, jobs::blocks_of(count, kGrain),
                   [&](std::uint32_t block, std::uint32_t worker) {
                     const IndexRange range = jobs::items_of(block, kGrain, count);
                     for (std::uint32_t i = range.begin; i < range.end; ++i) {
                       if (was_foreseen(step, bodies[i])) continue;
                       for_colliders(step, bodies[i], [&](ColliderIndex c) {
                         const Aabb box = box_over_step(step, c, bodies[i]);
                         if (!is_inside(box, step.broadphase->fat_bounds(c)))
                           scratch.workers[worker].thrown.push_back({box, c});
                       });
                     }
                   });
  std::vector<ThrownBox>& thrown = scratch.thrown;
  thrown.clear();
  for (const FastScratch& worker : scratch.workers)
    thrown.insert(thrown.end(), worker.thrown.begin(), worker.thrown.end());
  std::sort(thrown.begin(), thrown.end(), [](const ThrownBox& a, const ThrownBox& b) {
    return a.box.min[0] != b.box.min[0] ? a.box.min[0] < b.box.min[0] : a.collider < b.collider;
  });
}

bool joined(const StepContext& step, BodyIndex a, BodyIndex b) {
  const auto& keys = step.joints->no_collide;
  const std::uint64_t low = std::min(a, b), high = std::max(a, b);
  return !keys.empty() && std::binary_search(keys.begin(), keys.end(), (low << 32) | high);
}

bool is_sensor_pair(const StepContext& step, ColliderIndex a, ColliderIndex b) {
  return step.colliders->rows[a].sensor || step.colliders->rows[b].sensor;
}

// A pair that the broadphase did not foresee.
void add_key(const StepContext& step, ColliderIndex a, ColliderIndex b,
             std::vector<std::uint64_t>& keys) {
  if (a > b) std::swap(a, b);
  const Collider &ca = step.colliders->rows[a], &cb = step.colliders->rows[b];
  if (ca.body == cb.body || !core::filters_meet(ca.filter, cb.filter)) return;
  const std::uint32_t flags = step.bodies->flags[ca.body] | step.bodies->flags[cb.body];
  if ((flags & core::kQuarantined) || joined(step, ca.body, cb.body)) return;
  if (!is_sensor_pair(step, a, b) && !may_meet(step, ca.body, cb.body)) return;
  if (step.broadphase->is_pair(a, b)) return;  // it is an active pair
  keys.push_back((std::uint64_t{a} << 32) | b);
}

// Thrown ones against whatever the tree knows near them, and against each other, whose boxes it
// knows no more.
void find_thrown_pairs(const StepContext& step, Task& task) {
  ContinuousScratch& scratch = *step.continuous;
  const std::vector<ThrownBox>& thrown = scratch.thrown;
  const auto count = static_cast<std::uint32_t>(thrown.size());
  constexpr std::uint32_t kGrain = 32;
  for (FastScratch& worker : scratch.workers) worker.keys.clear();
  jobs::run_blocks(
      task, jobs::blocks_of(count, kGrain), [&](std::uint32_t block, std::uint32_t worker) {
        auto& [triangles, found, own, keys] = scratch.workers[worker];
        const IndexRange range = jobs::items_of(block, kGrain, count);
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
          const ThrownBox& self = thrown[i];
          found.clear();
          step.broadphase->collect(self.box, found);
          for (const ColliderIndex other : found) add_key(step, self.collider, other, keys);
          for (std::uint32_t k = i + 1; k < count && thrown[k].box.min[0] <= self.box.max[0]; ++k)
            if (overlap(self.box, thrown[k].box))
              add_key(step, self.collider, thrown[k].collider, keys);
        }
      });
}

// The keys that the workers found, each once, ascending.
void gather_keys(ContinuousScratch& scratch, Task& task) {
  jobs::run_blocks(task, static_cast<std::uint32_t>(scratch.workers.size()),
                   [&](std::uint32_t block, std::uint32_t) {
                     std::vector<std::uint64_t>& keys = scratch.workers[block].keys;
                     std::sort(keys.begin(), keys.end());
                     keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
                   });
  scratch.keys.clear();
  for (const FastScratch& worker : scratch.workers) {
    if (worker.keys.empty()) continue;
    scratch.more_keys.clear();
    std::set_union(scratch.keys.begin(), scratch.keys.end(), worker.keys.begin(), worker.keys.end(),
                   std::back_inserter(scratch.more_keys));
    std::swap(scratch.keys, scratch.more_keys);
  }
}

FastPair pair_of(const StepContext& step, std::uint64_t key) {
  const auto a = static_cast<ColliderIndex>(key >> 32), b = static_cast<ColliderIndex>(key);
  return {a,
          b,
          step.colliders->rows[a].body,
          step.colliders->rows[b].body,
          kNever,
          is_sensor_pair(step, a, b)};
}

void merge_keys(const StepContext& step) {
  ContinuousScratch& scratch = *step.continuous;
  std::vector<FastPair>& pairs = step.fast->pairs;
  scratch.merged.clear();
  std::size_t next = 0;
  for (const std::uint64_t key : scratch.keys) {
    for (; next < pairs.size(); ++next) {
      if (((std::uint64_t{pairs[next].a} << 32) | pairs[next].b) > key) break;
      scratch.merged.push_back(pairs[next]);
    }
    scratch.merged.push_back(pair_of(step, key));
  }
  scratch.merged.insert(scratch.merged.end(), pairs.begin() + static_cast<std::ptrdiff_t>(next),
                        pairs.end());
  std::swap(pairs, scratch.merged);
}

}  // namespace

void find_fast(const StepContext& step, IndexRange, Task& task) {
  FastBodies& fast = *step.fast;
  const Bodies& bodies = *step.bodies;
  fast.bodies.clear();
  fast.pairs.clear();
  fast.stopped.clear();
  fast.crossed.clear();
  bool kinematic = false;
  for (const BodyIndex body : bodies.awake) {
    if (is_fast(bodies, body)) {
      fast.bodies.push_back(body);
      fast.part[body] = 1;
    }
    kinematic = kinematic || kinematic_may_cross(step, body);
  }
  if (fast.bodies.empty() && !kinematic) return;
  list_active_pairs(step, task);
  list_thrown(step, task);
  if (step.continuous->thrown.empty()) return;
  find_thrown_pairs(step, task);
  gather_keys(*step.continuous, task);
  merge_keys(step);
}

}  // namespace skerry::collision
