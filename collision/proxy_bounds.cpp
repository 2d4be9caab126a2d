// ProxyBroadphase: fat boxes and who moved.
#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/height_field.h"
#include "collision/marks.h"
#include "collision/motion_bounds.h"
#include "collision/proxy_broadphase.h"
#include "core/assert.h"
#include "core/rounding.h"

namespace skerry::collision {
namespace {

using core::BodyIndex;
using core::Collider;
using core::kNone;
using core::ShapeType;

// Margin of a fat box, as a part of the body's size, and its limits. 0.05 m instead of 0.1 m for
// unit bodies changes neither falling nor mixing by more than the noise.
constexpr float kMarginPart = 0.1f;
constexpr float kLeastMargin = 0.01f;  // m; above kSpeculativeDistance
constexpr float kMostMargin = 0.1f;    // m
// Steps of motion that a fat box foresees; beyond the first no more than the body's size, so that
// fast bodies do not sweep up pairs.
constexpr double kForeseenSteps = 4;

// Upper bound of how far a step's spin moves a point, over the reach; the 1-norm spares a root.
double spin(const core::BodyMotion& motion, double dt) { return sum_of_sizes(motion.angular) * dt; }

// See twice_chord.
double turn(const Quat& q, const double p[4]) {
  const double now[4] = {q.w(), q.x(), q.y(), q.z()};
  return twice_chord(now, p);
}

float down(double value) {
  const auto v = core::rounded_to_float(value);
  return v - (std::abs(v) * 0x1p-23f + std::numeric_limits<float>::min());
}
float nudged_down(double value) {
  return std::isinf(value) ? core::rounded_to_float(value) : down(value);
}
float nudged_up(double value) { return -nudged_down(-value); }

float farthest_vertex(const std::vector<core::V3f>& vertices) {
  float most = 0;
  for (const core::V3f& vertex : vertices) most = std::max(most, core::dot(vertex, vertex));
  return std::sqrt(most);
}

// Farthest that a turn of the body can move a point of the shape, per radian.
float reach_of(const Collider& collider) {
  const float offset = core::length(collider.local_position);
  const core::V3f& size = collider.size;
  switch (collider.type) {
    case ShapeType::sphere:
      return offset;  // turns into itself
    case ShapeType::capsule:
      return offset + size.y;  // likewise about its ends
    case ShapeType::cylinder:
    case ShapeType::cone:
      return offset + std::sqrt(size.x * size.x + size.y * size.y);
    case ShapeType::box:
      return offset + core::length(size);
    case ShapeType::ellipsoid:
      return offset + std::max({size.x, size.y, size.z});
    case ShapeType::hull:
      return offset + farthest_vertex(collider.hull->vertices);
    case ShapeType::mesh:
      return offset + farthest_vertex(collider.mesh->vertices);
    case ShapeType::height_field:
      return offset + field_radius(*collider.field);
    case ShapeType::plane:
      return std::numeric_limits<float>::infinity();
  }
  return 0;
}

// Least distance from the centre to a plane across any direction that touches the hull from outside; of
// a hull that does not hold the centre, a lower bound.
float least_support(const core::HullGeometry& hull) {
  float least = std::numeric_limits<float>::max();
  for (const core::HullGeometry::Face& face : hull.faces) least = std::min(least, face.offset);
  return least >= 0 ? least : -farthest_vertex(hull.vertices);
}

// By how much turns can change how far the shape reaches along any direction: a ball that turns about
// another point by twice their distance, a long box by more than a cube.
float room_of(const Collider& collider) {
  const float off_centre = 2 * core::length(collider.local_position);
  const core::V3f& size = collider.size;
  const float least = std::min({size.x, size.y, size.z}), most = std::max({size.x, size.y, size.z});
  switch (collider.type) {
    case ShapeType::sphere:
      return off_centre;
    case ShapeType::capsule:
      return off_centre + size.y;
    case ShapeType::cylinder:
      return off_centre + std::sqrt(size.x * size.x + size.y * size.y) - std::min(size.x, size.y);
    case ShapeType::box:
      return off_centre + core::length(size) - least;
    case ShapeType::ellipsoid:
      return off_centre + most - least;
    case ShapeType::hull:
      return off_centre + farthest_vertex(collider.hull->vertices) - least_support(*collider.hull);
    default:
      return 2 * reach_of(collider);
  }
}

}  // namespace

template <class Visit>
void ProxyBroadphase::for_proxies_of(const core::Bodies& bodies, const core::Colliders& colliders,
                                     BodyIndex body, const Visit& visit) const {
  for (ColliderIndex collider = bodies.first_collider[body]; collider != kNone;
       collider = colliders.rows[collider].next_in_body)
    if (collider < proxies_.size() && (proxies_[collider].flags & kPresent)) visit(collider);
}

void ProxyBroadphase::describe(const core::Bodies& bodies, const core::Colliders& colliders,
                               ColliderIndex collider) {
  const Collider& row = colliders.rows[collider];
  Proxy& proxy = proxies_[collider];
  proxy = {kPresent, row.body, row.filter};
  if (bodies.flags[row.body] & core::kDynamic) proxy.flags |= kOfDynamic;
  if (bodies.flags[row.body] & core::kKinematic) proxy.flags |= kOfKinematic;
  if (row.sensor) proxy.flags |= kIsSensor;
  if (core::is_surface(row.type)) proxy.flags |= kIsMesh;
  if (row.type == core::ShapeType::hull) proxy.flags |= kIsHull;
  if (row.type == ShapeType::plane) proxy.flags |= kIsPlane;
  Leash& leash = leashes_[row.body];
  leash.reach = std::max(leash.reach, reach_of(row));
  leash.room = std::max(leash.room, nudged_up(double(room_of(row))));
}

void ProxyBroadphase::add(const core::Bodies& bodies, const core::Colliders& colliders,
                          BodyIndex body) {
  if (body >= leashes_.size()) {
    leashes_.resize(body + 1);
    travels_.grow(body + 1);
  }
  if (leashes_[body].proxies == 0) leashes_[body] = {};
  added_.clear();
  for (ColliderIndex collider = bodies.first_collider[body]; collider != kNone;
       collider = colliders.rows[collider].next_in_body) {
    if (collider >= proxies_.size()) {
      proxies_.resize(collider + 1);
      fat_.resize(collider + 1);
      marks_.resize(collider + 1, 0);
      partners_.resize(collider + 1);
    }
    if (proxies_[collider].flags & kPresent) continue;
    describe(bodies, colliders, collider);
    added_.push_back(collider);
  }
  leashes_[body].proxies += static_cast<std::uint32_t>(added_.size());
  touch_body(bodies, colliders, body);
  for (const ColliderIndex collider : added_) enter(collider);
}

void ProxyBroadphase::enter(ColliderIndex collider) {
  const Proxy& proxy = proxies_[collider];
  if (proxy.flags & kIsPlane)
    planes_.insert(std::lower_bound(planes_.begin(), planes_.end(), collider), collider);
  else
    insert(collider, fat_[collider], of_fixed(proxy));
}

void ProxyBroadphase::remove(ColliderIndex collider) {
  Proxy& proxy = proxies_[collider];
  SKERRY_ASSERT(proxy.flags & kPresent, "a collider is removed that was never added");
  if (proxy.flags & kIsPlane)
    planes_.erase(std::lower_bound(planes_.begin(), planes_.end(), collider));
  else
    erase(collider, of_fixed(proxy));
  --leashes_[proxy.body].proxies;
  proxy = {};
}

void ProxyBroadphase::touch(const core::Bodies& bodies, const core::Colliders& colliders,
                            BodyIndex body) {
  for_proxies_of(bodies, colliders, body, [&](ColliderIndex collider) {
    const Proxy& proxy = proxies_[collider];
    const bool was_fixed = of_fixed(proxy), was_plane = proxy.flags & kIsPlane;
    describe(bodies, colliders, collider);
    SKERRY_ASSERT(was_plane == ((proxy.flags & kIsPlane) != 0), "a plane stays a plane");
    if (was_plane || was_fixed == of_fixed(proxy)) return;
    erase(collider, was_fixed);
    insert(collider, fat_[collider], !was_fixed);
  });
  if (body < leashes_.size()) touch_body(bodies, colliders, body);
}

// New fat boxes for all shapes of a body: they share one leash.
void ProxyBroadphase::touch_body(const core::Bodies& bodies, const core::Colliders& colliders,
                                 BodyIndex body) {
  set_leash(bodies, body, last_dt_);
  travels_.forget(body);
  for_proxies_of(bodies, colliders, body, [&](ColliderIndex collider) {
    fat_[collider] = fattened(bodies, colliders.rows[collider], body);
    marks_[collider] |= kTouched;
  });
}

// Starts a new leash at the body's present pose.
void ProxyBroadphase::set_leash(const core::Bodies& bodies, BodyIndex body, double dt) {
  Leash& leash = leashes_[body];
  const core::BodyPose& pose = bodies.pose[body];
  const core::BodyMotion& motion = bodies.motion[body];
  const Quat& q = pose.orientation;
  const double orientation[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy_n(orientation, 4, leash.orientation);
  const bool fixed = !(bodies.flags[body] & (core::kDynamic | core::kKinematic));
  const double reach = double(leash.reach);
  const double most = std::min(reach, 1e6);
  const double margin = double(std::clamp(kMarginPart * leash.reach, kLeastMargin, kMostMargin));
  const double turning =
      std::min(spin(motion, dt) * most * kForeseenSteps, std::min(double(leash.room), 2 * most));
  for (int axis = 0; axis < 3; ++axis) {
    leash.center[axis] = pose.center[axis];
    const double once = std::abs(motion.linear[axis]) * dt;
    const double foreseen = once + std::min((kForeseenSteps - 1) * once, std::max(most, margin));
    const double slack = margin + turning;
    leash.low[axis] =
        fixed ? 0 : core::rounded_to_float(slack + (motion.linear[axis] < 0 ? foreseen : 0));
    leash.high[axis] =
        fixed ? 0 : core::rounded_to_float(slack + (motion.linear[axis] > 0 ? foreseen : 0));
  }
  leash.least = fixed ? 0 : core::rounded_to_float(margin + turning);
}

Aabb ProxyBroadphase::fattened(const core::Bodies& bodies, const Collider& collider,
                               BodyIndex body) const {
  const Leash& leash = leashes_[body];
  Aabb box = tight_bounds(collider, bodies.pose[body]);
  for (int axis = 0; axis < 3; ++axis) {
    if (leash.low[axis] > 0)
      box.min[axis] = nudged_down(double(box.min[axis]) - double(leash.low[axis]));
    if (leash.high[axis] > 0)
      box.max[axis] = nudged_up(double(box.max[axis]) + double(leash.high[axis]));
  }
  return box;
}

// The hot path: a body at rest costs the first half of this and no more.
bool ProxyBroadphase::holds(const Leash& leash, const core::BodyPose& pose,
                            const core::BodyMotion& motion, double dt) {
  const double reach = double(leash.reach);
  const double turned = (turn(pose.orientation, leash.orientation) + spin(motion, dt)) * reach;
  const double gone[3] = {pose.center.x() - leash.center[0], pose.center.y() - leash.center[1],
                          pose.center.z() - leash.center[2]};
  const double farthest = sum_of_sizes(gone[0], gone[1], gone[2]) +
                          (double(kSpeculativeDistance) + turned) +
                          sum_of_sizes(motion.linear) * dt;
  if (farthest <= double(leash.least)) return true;
  const double free = double(kSpeculativeDistance) + std::min(turned, double(leash.room));
  return holds_along(leash, pose, motion, dt, free);
}

// The same axis by axis; `free` is the way that turning and speculation may take in any direction.
bool ProxyBroadphase::holds_along(const Leash& leash, const core::BodyPose& pose,
                                  const core::BodyMotion& motion, double dt, double free) {
  bool hold = true;
  for (int axis = 0; axis < 3; ++axis) {
    const double gone = pose.center[axis] - leash.center[axis];
    const double next = gone + motion.linear[axis] * dt;
    const double low = (gone < next ? gone : next) - free;
    const double high = (gone > next ? gone : next) + free;
    hold &= (low >= -double(leash.low[axis])) & (high <= double(leash.high[axis]));
  }
  return hold;
}

void ProxyBroadphase::update_bounds(const StepContext& step, IndexRange awake_bodies, Task&) {
  const core::Bodies& bodies = *step.bodies;
  for (std::uint32_t i = awake_bodies.begin; i < awake_bodies.end; ++i) {
    const BodyIndex body = bodies.awake[i];
    if (body >= leashes_.size() || leashes_[body].proxies == 0) continue;
    travels_.update(body, bodies.pose[body], bodies.motion[body], double(leashes_[body].reach),
                    step.dt);
    if (holds(leashes_[body], bodies.pose[body], bodies.motion[body], step.dt)) continue;
    // A body that has left by its translation alone needs no exact test.
    const bool may_be_inside = holds_along(leashes_[body], bodies.pose[body], bodies.motion[body],
                                           step.dt, double(kSpeculativeDistance));
    if (!may_be_inside || !still_inside(step, body)) enlarge(step, body);
  }
}

// The exact test: the shapes' tight boxes, swept over the step, against their fat boxes. If they
// are inside, the leash is laid anew from here with what slack is left.
bool ProxyBroadphase::still_inside(const StepContext& step, BodyIndex body) {
  const core::Bodies& bodies = *step.bodies;
  const core::BodyMotion& motion = bodies.motion[body];
  Leash& leash = leashes_[body];
  const double reach = double(leash.reach);
  const double turned = spin(motion, step.dt) * reach;
  const double free = double(kSpeculativeDistance) + std::min(turned, double(leash.room));
  float low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) low[axis] = high[axis] = std::numeric_limits<float>::max();
  bool in = true;
  for_proxies_of(bodies, *step.colliders, body, [&](ColliderIndex collider) {
    const Aabb tight = tight_bounds(step.colliders->rows[collider], bodies.pose[body]);
    const Aabb& fat = fat_[collider];
    Aabb swept = tight;
    for (int axis = 0; axis < 3; ++axis) {
      const double way = motion.linear[axis] * step.dt;
      swept.min[axis] = nudged_down(double(tight.min[axis]) - free + (way < 0 ? way : 0));
      swept.max[axis] = nudged_up(double(tight.max[axis]) + free + (way > 0 ? way : 0));
      // Infinite sides of planes leave any slack; std::min passes over their NaN.
      low[axis] = std::min(low[axis], tight.min[axis] - fat.min[axis]);
      high[axis] = std::min(high[axis], fat.max[axis] - tight.max[axis]);
    }
    in = in && is_inside(swept, fat);
  });
  if (!in) return false;
  const Quat& q = bodies.pose[body].orientation;
  const double orientation[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy_n(orientation, 4, leash.orientation);
  for (int axis = 0; axis < 3; ++axis) {
    leash.center[axis] = bodies.pose[body].center[axis];
    leash.low[axis] = low[axis];
    leash.high[axis] = high[axis];
  }
  leash.least = std::min({low[0], low[1], low[2], high[0], high[1], high[2]});
  return true;
}

void ProxyBroadphase::enlarge(const StepContext& step, BodyIndex body) {
  set_leash(*step.bodies, body, step.dt);
  for_proxies_of(*step.bodies, *step.colliders, body, [&](ColliderIndex collider) {
    fat_[collider] = fattened(*step.bodies, step.colliders->rows[collider], body);
    marks_[collider] |= kMoved;
  });
}

void ProxyBroadphase::refit(const StepContext& step, Task& task) {
  last_dt_ = step.dt > 0 ? step.dt : last_dt_;
  if (workers_.size() < step.worker_count) workers_.resize(step.worker_count);
  touch_rejoined(step);
  touch_quarantined(step);
  gather_moved();
  proxies_touched_ = moved_.size();
  for (WorkerBuffers& worker : workers_) worker.found = 0;
  move(bounded_, task);
  settle(task);
  if (partner_.size() != step.contacts->pairs.size()) {  // dropped since the last step
    index_pairs(*step.contacts);
    list_stale_ = true;
  }
}

// Bodies that a joint has begun or ceased to keep from colliding.
void ProxyBroadphase::touch_rejoined(const StepContext& step) {
  const std::vector<std::uint64_t>& now = step.joints->no_collide;
  if (now == last_no_collide_) return;
  std::vector<std::uint64_t> changed;
  std::set_symmetric_difference(now.begin(), now.end(), last_no_collide_.begin(),
                                last_no_collide_.end(), std::back_inserter(changed));
  for (const std::uint64_t key : changed) {
    const auto body = static_cast<BodyIndex>(key >> 32);
    if (body >= step.bodies->rows()) continue;
    for_proxies_of(*step.bodies, *step.colliders, body,
                   [&](ColliderIndex collider) { marks_[collider] |= kTouched; });
  }
  last_no_collide_ = now;
}

// Bodies that fell out of the awake list because they were quarantined lose their pairs.
void ProxyBroadphase::touch_quarantined(const StepContext& step) {
  const core::Bodies& bodies = *step.bodies;
  if (last_awake_ == bodies.awake) return;
  for (const BodyIndex body : last_awake_)
    if (body < bodies.rows() && bodies.is(body, core::kAlive | core::kQuarantined))
      for_proxies_of(bodies, *step.colliders, body,
                     [&](ColliderIndex collider) { marks_[collider] |= kTouched; });
}

void ProxyBroadphase::gather_moved() {
  moved_.clear();
  bounded_.clear();
  for_marked(marks_, [&](ColliderIndex collider) {
    const std::uint32_t flags = proxies_[collider].flags;
    if (!(flags & kPresent)) {
      marks_[collider] = 0;
      return;
    }
    moved_.push_back(collider);
    if (!(flags & kIsPlane)) bounded_.push_back(collider);
  });
}

std::uint64_t ProxyBroadphase::proxies_touched() const {
  std::uint64_t sum = proxies_touched_;
  for (const WorkerBuffers& worker : workers_) sum += worker.found;
  return sum;
}

}  // namespace skerry::collision
