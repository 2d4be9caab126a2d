#include "tests/collision/broadphase_scene.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace skerry::collision {

using core::ContactPair;
using core::kNone;
using core::ShapeType;

BodyIndex BroadphaseScene::add_body(std::uint32_t type, const Vec3& position) {
  const BodyIndex body = core::take_row(bodies);
  bodies.flags[body] |= type | (type != 0 ? core::kAwake : 0u);
  bodies.pose[body].center = position;
  bodies.awake_stale = true;
  return body;
}

ColliderIndex BroadphaseScene::add_collider(BodyIndex body, Collider collider) {
  collider.alive = true;
  collider.body = body;
  collider.next_in_body = bodies.first_collider[body];
  ColliderIndex index;
  if (!colliders.free_rows.empty()) {
    index = colliders.free_rows.back();
    colliders.free_rows.pop_back();
    colliders.rows[index] = collider;
  } else {
    index = static_cast<ColliderIndex>(colliders.rows.size());
    colliders.rows.push_back(collider);
  }
  bodies.first_collider[body] = index;
  for (Side& side : sides) side.broadphase->add(bodies, colliders, body);
  return index;
}

void BroadphaseScene::remove_body(BodyIndex body) {
  for (ColliderIndex c = bodies.first_collider[body]; c != kNone;) {
    for (Side& side : sides) {
      side.broadphase->remove(c);
      drop_pairs_of(side.contacts, c);
    }
    const ColliderIndex next = colliders.rows[c].next_in_body;
    colliders.rows[c].alive = false;
    colliders.free_rows.push_back(c);
    c = next;
  }
  core::free_row(bodies, body);
  bodies.awake_stale = true;
}

void BroadphaseScene::touch_body(BodyIndex body) {
  for (Side& side : sides) side.broadphase->touch(bodies, colliders, body);
}

StepContext BroadphaseScene::context(Side& side) {
  StepContext step;
  step.dt = kDt;
  step.worker_count = side.workers;
  step.bodies = &bodies;
  step.colliders = &colliders;
  step.contacts = &side.contacts;
  step.joints = &joints;
  step.broadphase = side.broadphase.get();
  return step;
}

void BroadphaseScene::step() {
  core::refresh_awake(bodies);
  for (Side& side : sides) {
    const StepContext context_of_side = context(side);
    const auto chunks = [&](std::uint32_t count, auto&& kernel) {
      // One chunk per worker, last first: order must not matter.
      const std::uint32_t chunk = count / side.workers + 1;
      for (std::uint32_t w = side.workers; w-- > 0;) {
        StubTask task(w);
        const std::uint32_t begin = std::min(count, w * chunk),
                            end = std::min(count, begin + chunk);
        if (begin < end) kernel(context_of_side, IndexRange{begin, end}, task);
      }
    };
    StubTask task;
    chunks(static_cast<std::uint32_t>(bodies.awake.size()), update_bounds);
    refit_broadphase(context_of_side, {0, 1}, task);
    moved = side.broadphase->moved_count();
    chunks(moved, query_pairs);
    merge_pairs(context_of_side, {0, 1}, task);
  }
}

bool BroadphaseScene::may_pair(const Collider& a, const Collider& b) const {
  const auto type = [&](const Collider& c) {
    return bodies.flags[c.body] & (core::kDynamic | core::kKinematic);
  };
  if (a.body == b.body) return false;
  if (!core::filters_meet(a.filter, b.filter)) return false;
  if (bodies.is(a.body, core::kQuarantined) || bodies.is(b.body, core::kQuarantined)) return false;
  const std::uint64_t key =
      (std::uint64_t{std::min(a.body, b.body)} << 32) | std::max(a.body, b.body);
  if (std::ranges::count(joints.no_collide, key)) return false;
  if (type(a) == core::kDynamic || type(b) == core::kDynamic) return true;
  return (a.sensor || b.sensor) && (type(a) == core::kKinematic || type(b) == core::kKinematic);
}

std::vector<std::uint64_t> BroadphaseScene::brute_force(const Side& side) const {
  std::vector<std::uint64_t> keys;
  std::vector<Aabb> fat;
  for (ColliderIndex c = 0; c < colliders.rows.size(); ++c)
    fat.push_back(colliders.rows[c].alive ? side.broadphase->fat_bounds(c) : Aabb{});
  for (ColliderIndex a = 0; a < colliders.rows.size(); ++a)
    for (ColliderIndex b = a + 1; b < colliders.rows.size(); ++b) {
      if (!colliders.rows[a].alive || !colliders.rows[b].alive) continue;
      if (!overlap(fat[a], fat[b])) continue;
      if (may_pair(colliders.rows[a], colliders.rows[b]))
        keys.push_back((std::uint64_t{a} << 32) | b);
    }
  return keys;
}

void BroadphaseScene::expect_sound(const Side& side) const {
  const core::ContactTable& table = side.contacts;
  std::vector<std::uint64_t> keys;
  std::set<std::uint32_t> manifolds;
  std::vector<std::uint32_t> awake, active_awake;
  for (std::uint32_t row = 0; row < table.pairs.size(); ++row) {
    const ContactPair& pair = table.pairs[row];
    keys.push_back(pair.key());
    const Collider &a = colliders.rows[pair.a], &b = colliders.rows[pair.b];
    ASSERT_EQ(pair.body_a, a.body);
    ASSERT_EQ(pair.body_b, b.body);
    const bool mesh = a.type == ShapeType::mesh || b.type == ShapeType::mesh;
    ASSERT_EQ(pair.manifold_capacity, mesh ? core::kMeshManifolds : 1u);
    ASSERT_EQ((pair.flags & core::kSensorPair) != 0, a.sensor || b.sensor);
    for (std::uint32_t m = 0; m < pair.manifold_capacity; ++m)
      ASSERT_TRUE(manifolds.insert(pair.first_manifold + m).second) << "a manifold of two pairs";
    if (bodies.is(pair.body_a, core::kAwake) || bodies.is(pair.body_b, core::kAwake))
      awake.push_back(row);
  }
  ASSERT_EQ(keys, brute_force(side));
  // Of sleepers, only what was touched or is new may be looked at.
  for (const std::uint32_t row : table.active)
    if (std::ranges::binary_search(awake, row)) active_awake.push_back(row);
  ASSERT_TRUE(std::ranges::is_sorted(table.active));
  ASSERT_EQ(active_awake, awake);
  expect_covered(side);
}

void BroadphaseScene::expect_covered(const Side& side) const {
  for (const BodyIndex body : bodies.awake)
    for (ColliderIndex c = bodies.first_collider[body]; c != kNone;
         c = colliders.rows[c].next_in_body) {
      const Aabb tight = tight_bounds(colliders.rows[c], bodies.pose[body]);
      const Aabb& fat = side.broadphase->fat_bounds(c);
      for (int axis = 0; axis < 3; ++axis) {
        // Far out the tight box moves in jumps of float's resolution; the shape does not.
        const double need =
            0.999 * double(kSpeculativeDistance) - std::abs(double(tight.min[axis])) * 0x1p-22;
        const double way = bodies.motion[body].linear[axis] * kDt;
        ASSERT_LE(double(fat.min[axis]), double(tight.min[axis]) - need + std::min(0.0, way));
        ASSERT_GE(double(fat.max[axis]), double(tight.max[axis]) + need + std::max(0.0, way));
      }
    }
}

Collider box_collider(float x, float y, float z) {
  Collider collider;
  collider.type = ShapeType::box;
  collider.size = {x, y, z};
  return collider;
}
}  // namespace skerry::collision
