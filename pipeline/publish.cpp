#include "pipeline/publish.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "pipeline/joint_edits.h"
#include "pipeline/world_data.h"
#include "solver/stop_at_impact.h"

namespace skerry::pipeline {
namespace {

using core::BodyIndex;
using core::ContactPair;

ContactEvent event_of(const WorldData& world, const ContactPair& pair, ContactEventKind kind) {
  ContactEvent event;
  event.kind = kind;
  event.sensor = pair.flags & core::kSensorPair;
  event.a = world.bodies.id(pair.body_a);
  event.b = world.bodies.id(pair.body_b);
  event.shape_a = world.colliders.rows[pair.a].shape_in_body;
  event.shape_b = world.colliders.rows[pair.b].shape_in_body;
  return event;
}

// Point, normal and impulse from the pair's manifolds; a to b in the order of the collider rows.
void add_contact(const WorldData& world, const ContactPair& pair, ContactEvent& event) {
  Vec3 sum = Vec3::Zero();
  int points = 0;
  for (std::uint32_t m = 0; m < pair.manifold_count; ++m) {
    const core::Manifold& manifold = world.contacts.manifolds[pair.first_manifold + m];
    if (m == 0) event.normal = core::to_double(manifold.normal);
    for (std::uint32_t i = 0; i < manifold.point_count; ++i, ++points) {
      sum += core::to_double(manifold.points[i].position);
    }
    event.impulse += double(manifold.total_impulse);
    event.approach_speed = std::max(event.approach_speed, double(manifold.approach_speed));
  }
  if (points > 0) event.point = world.bodies.pose[pair.body_a].center + sum / points;
}

// Users see the body with the lower index first.
void put_lower_body_first(ContactEvent& event) {
  if (event.a.index < event.b.index) return;
  std::swap(event.a, event.b);
  std::swap(event.shape_a, event.shape_b);
  event.normal = -event.normal;
}

void add_event(const WorldData& world, const ContactPair& pair, ContactEventKind kind,
               std::vector<ContactEvent>& events) {
  ContactEvent event = event_of(world, pair, kind);
  if (kind != ContactEventKind::end && !event.sensor) add_contact(world, pair, event);
  put_lower_body_first(event);
  events.push_back(event);
}

// Of one pair: what ended was there before what began.
int rank(ContactEventKind kind) {
  return kind == ContactEventKind::end ? -1 : static_cast<int>(kind);
}

auto order_of(const ContactEvent& e) {
  return std::tuple(e.a, e.b, e.shape_a, e.shape_b, rank(e.kind));
}

// Whether shapes that contacts foresee to touch do: pressed on each other, or overlap.
bool are_in_touch(const WorldData& world, const ContactPair& pair) {
  constexpr float kTouch = 1e-4f;  // m; what rests without load is that exact
  if (pair.flags & core::kSensorPair) return true;
  for (std::uint32_t m = 0; m < pair.manifold_count; ++m) {
    const core::Manifold& manifold = world.contacts.manifolds[pair.first_manifold + m];
    if (manifold.total_impulse > 0) return true;
    for (std::uint32_t i = 0; i < manifold.point_count; ++i)
      if (manifold.points[i].separation <= kTouch) return true;
  }
  return false;
}

bool is_awake(const WorldData& world, const ContactPair& pair) {
  return (world.bodies.flags[pair.body_a] | world.bodies.flags[pair.body_b]) & core::kAwake;
}

void add_hit(WorldData& world, const ContactPair& pair) {
  if (pair.flags & core::kSensorPair) return;
  add_event(world, pair, ContactEventKind::hit, world.events);
  const ContactEvent& hit = world.events.back();
  if (!(hit.impulse > 0 && hit.approach_speed > world.settings.hit_speed)) world.events.pop_back();
}

// Of a pair that touches as it did, only those who hear of every step have news.
bool has_news(const WorldData& world, const ContactPair& pair, bool every_step) {
  const bool touching = pair.flags & core::kTouching, begun = pair.flags & core::kBegun;
  if (touching != begun) return begun || are_in_touch(world, pair);
  return begun & every_step;
}

// Of a pair that has news.
void tell(WorldData& world, ContactPair& pair) {
  if (!(pair.flags & core::kBegun)) {
    add_event(world, pair, ContactEventKind::begin, world.events);
    pair.flags |= core::kBegun;
  } else if (!(pair.flags & core::kTouching)) {
    add_event(world, pair, ContactEventKind::end, world.events);
    pair.flags &= ~std::uint32_t{core::kBegun};
    return;
  } else if (world.settings.persist_events && is_awake(world, pair)) {
    add_event(world, pair, ContactEventKind::persist, world.events);
  }
  if (std::isfinite(world.settings.hit_speed)) add_hit(world, pair);
}

void tell_contacts(WorldData& world, jobs::Task& task) {
  std::vector<ContactPair>& pairs = world.contacts.pairs;
  const std::vector<std::uint32_t>& active = world.contacts.active;
  const bool every_step = world.settings.persist_events || std::isfinite(world.settings.hit_speed);
  world.news.clear();
  world.news_filter.run(
      task, static_cast<std::uint32_t>(active.size()),
      [&](std::uint32_t i) { return has_news(world, pairs[active[i]], every_step); }, world.news);
  for (const std::uint32_t i : world.news) tell(world, pairs[active[i]]);
}

// Sensors that were met between the step's poses. The next step sees whether they still are.
void tell_crossings(WorldData& world) {
  std::vector<ContactPair>& pairs = world.contacts.pairs;
  for (const core::FastPair& crossed : world.fast.crossed) {
    ContactPair seen;
    seen.a = crossed.a;
    seen.b = crossed.b;
    seen.body_a = crossed.body_a;
    seen.body_b = crossed.body_b;
    seen.flags = core::kSensorPair;
    const auto at = std::lower_bound(
        pairs.begin(), pairs.end(), seen.key(),
        [](const ContactPair& pair, std::uint64_t key) { return pair.key() < key; });
    const bool listed = at != pairs.end() && at->key() == seen.key();
    if (listed && (at->flags & core::kBegun)) continue;
    add_event(world, seen, ContactEventKind::begin, world.events);
    if (listed)
      at->flags |= core::kTouching | core::kBegun;
    else  // thrown beyond what the broadphase foresaw
      add_event(world, seen, ContactEventKind::end, world.pending_end_events);
  }
}

void write_events(WorldData& world, jobs::Task& task) {
  world.events.clear();
  std::swap(world.events, world.pending_end_events);
  collect_end_events(world, world.events);
  tell_contacts(world, task);
  tell_crossings(world);
  std::sort(world.events.begin(), world.events.end(),
            [](const auto& a, const auto& b) { return order_of(a) < order_of(b); });
}

void write_changed(WorldData& world) {
  world.changed.clear();
  for (const BodyIndex body : world.bodies.awake) {
    if (world.bodies.is(body, core::kChanged)) world.changed.push_back(world.row_of[body]);
  }
}

void write_transform(WorldData& world, BodyIndex body) {
  world.transforms[world.row_of[body]] = core::body_frame(world.bodies, body);
}

}  // namespace

void write_transforms(WorldData& world, jobs::IndexRange groups, jobs::Task&) {
  for_each_simulated(world, groups, [&](BodyIndex body) { write_transform(world, body); });
}

void stop_fast(WorldData& world, jobs::IndexRange, jobs::Task& task) {
  collision::order_impacts(world.context, task);
  solver::stop_at_impacts(world.context);
  for (const BodyIndex body : world.fast.moved) write_transform(world, body);
}

void collect_end_events(WorldData& world, std::vector<ContactEvent>& events) {
  for (const ContactPair& pair : world.contacts.ended) {
    if (pair.flags & core::kBegun) add_event(world, pair, ContactEventKind::end, events);
  }
  world.contacts.ended.clear();
}

void publish(WorldData& world, jobs::IndexRange, jobs::Task& task) {
  take_broken_joints(world);
  write_events(world, task);
  write_changed(world);
  world.snapshots.publish(world.step_count + 1, world.time + world.context.dt, world.ids,
                          world.transforms);
  world.queries.publish(world);
}

}  // namespace skerry::pipeline
