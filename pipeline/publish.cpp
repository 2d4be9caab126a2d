#include "pipeline/publish.h"

#include <algorithm>
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

auto order_of(const ContactEvent& e) {
  return std::tuple(e.a.index, e.b.index, e.shape_a, e.shape_b, e.kind);
}

void write_events(WorldData& world) {
  world.events.clear();
  std::swap(world.events, world.pending_end_events);
  collect_end_events(world, world.events);
  for (const std::uint32_t row : world.contacts.active) {
    ContactPair& pair = world.contacts.pairs[row];
    const bool touching = pair.flags & core::kTouching;
    const bool before = pair.flags & core::kWasTouching;
    if (touching != before) {
      add_event(world, pair, touching ? ContactEventKind::begin : ContactEventKind::end,
                world.events);
      pair.flags ^= core::kWasTouching;
    } else if (touching && world.settings.persist_events) {
      add_event(world, pair, ContactEventKind::persist, world.events);
    }
  }
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
  world.transforms[world.row_of[body]] =
      core::body_frame(world.bodies.pose[body], world.bodies.mass[body].local_center);
}

}  // namespace

void write_transforms(WorldData& world, jobs::IndexRange groups, jobs::Task&) {
  for_each_simulated(world, groups, [&](BodyIndex body) { write_transform(world, body); });
}

void stop_fast(WorldData& world, jobs::IndexRange, jobs::Task&) {
  collision::order_impacts(world.context);
  for (const BodyIndex body : world.fast.stopped) {
    solver::stop_at_impact(world.context, body);
    write_transform(world, body);
  }
}

void collect_end_events(WorldData& world, std::vector<ContactEvent>& events) {
  for (const ContactPair& pair : world.contacts.ended) {
    if (pair.flags & core::kWasTouching) add_event(world, pair, ContactEventKind::end, events);
  }
  world.contacts.ended.clear();
}

void publish(WorldData& world, jobs::IndexRange, jobs::Task&) {
  take_broken_joints(world);
  write_events(world);
  write_changed(world);
  world.snapshots.publish(world.step_count + 1, world.time + world.context.dt, world.ids,
                          world.transforms);
  world.queries.publish(world);
}

}  // namespace skerry::pipeline
