#include "solver/finalise.h"

#include <algorithm>
#include <functional>
#include <span>
#include <string>

#include "core/assert.h"
#include "core/rounding.h"
#include "solver/forces.h"

namespace skerry::solver {
namespace {

using core::Bodies;
using core::BodyIndex;
using core::BodyMotion;
using core::Island;
using core::Islands;
using core::Sleepers;
using core::StepContext;

double square(const Vec3& v) { return (v.x() * v.x() + v.y() * v.y()) + v.z() * v.z(); }

// A small ball turns fast where it rolls slowly: what counts then is how fast its surface moves.
bool is_slow(const BodyMotion& motion, const core::BodyMass& mass, const SleepSettings& sleep) {
  const double linear = sleep.linear_threshold * sleep.linear_threshold;
  const double turn = square(motion.angular);
  return square(motion.linear) < linear &&
         (turn < sleep.angular_threshold * sleep.angular_threshold ||
          (mass.radius > 0 && turn * (mass.radius * mass.radius) < linear));
}

// Whether gravity or a user's force acts on a body. Fields count as always acting.
bool is_pushed(const StepContext& step, BodyIndex body) {
  if (forces_vary(step)) return true;
  const ExternalForce force =
      external_force(step, body, step.time, Vec3::Zero(), Vec3::Zero(), Vec3::Zero());
  return !force.force.isZero(0) || !force.torque.isZero(0);
}

// Whether a body moves on for ever if nothing touches it.
bool drifts(const Bodies& bodies, BodyIndex body) {
  const BodyMotion& motion = bodies.motion[body];
  const core::BodyMass& mass = bodies.mass[body];
  return (mass.linear_damping == 0 && !motion.linear.isZero(0)) ||
         (mass.angular_damping == 0 && !motion.angular.isZero(0));
}

float still_time_after(const StepContext& step, BodyIndex body, bool free) {
  Bodies& bodies = *step.bodies;
  // A body set aside does not keep its neighbours awake.
  if (bodies.flags[body] & core::kQuarantined)
    return core::rounded_to_float(step.settings->sleep.time);
  if (!(bodies.flags[body] & core::kAllowSleep)) return 0;
  if (!is_slow(bodies.motion[body], bodies.mass[body], step.settings->sleep)) return 0;
  if (free && (drifts(bodies, body) || is_pushed(step, body))) return 0;
  if (bodies.still_time[body] == 0)
    bodies.still_energy[body] = core::kinetic_energy(bodies.motion[body], bodies.mass[body].mass);
  return bodies.still_time[body] + core::rounded_to_float(step.dt);
}

void finalise_body(const StepContext& step, BodyIndex body, bool free) {
  Bodies& bodies = *step.bodies;
  std::uint32_t& flags = bodies.flags[body];
  const bool moves = (flags & core::kAwake) && !(flags & core::kQuarantined);
  flags = moves ? flags | core::kChanged : flags & ~core::kChanged;
  if (flags & core::kDynamic) bodies.still_time[body] = still_time_after(step, body, free);
  if (flags & core::kForced) bodies.force[body] = {};
  flags &= ~(core::kForced | core::kReloaded);
}

std::span<const BodyIndex> members(const Islands& islands, const Island& island) {
  return {islands.bodies.data() + island.first_body, island.body_count};
}

void finalise_island(const StepContext& step, Island& island) {
  island.still_time = 3.4e38f;
  for (const BodyIndex body : members(*step.islands, island)) {
    finalise_body(step, body, false);
    island.still_time = std::min(island.still_time, step.bodies->still_time[body]);
  }
}

bool is_moving_kinematic(const Bodies& bodies, BodyIndex body) {
  return body != core::kNone && bodies.is(body, core::kKinematic | core::kAwake);
}

bool meets_moving_kinematic(const StepContext& step, const Island& island) {
  const Bodies& bodies = *step.bodies;
  for (std::uint32_t i = 0; i < island.contact_count; ++i) {
    const core::ContactRef ref = step.islands->contacts[island.first_contact + i];
    const core::ContactPair& pair = step.contacts->pairs[ref.pair];
    if (is_moving_kinematic(bodies, pair.body_a) || is_moving_kinematic(bodies, pair.body_b))
      return true;
  }
  for (std::uint32_t i = 0; i < island.joint_count; ++i) {
    const core::Joint& joint = step.joints->rows[step.islands->joints[island.first_joint + i]];
    if (is_moving_kinematic(bodies, joint.a) || is_moving_kinematic(bodies, joint.b)) return true;
  }
  return false;
}

bool is_held(const Bodies& bodies, BodyIndex a, BodyIndex b) {
  return a == core::kNone || b == core::kNone || !bodies.is(a, core::kDynamic) ||
         !bodies.is(b, core::kDynamic);
}

// Whether something that cannot move touches or holds the island.
bool is_supported(const StepContext& step, const Island& island) {
  const Bodies& bodies = *step.bodies;
  for (std::uint32_t i = 0; i < island.contact_count; ++i) {
    const core::ContactRef ref = step.islands->contacts[island.first_contact + i];
    const core::ContactPair& pair = step.contacts->pairs[ref.pair];
    if (is_held(bodies, pair.body_a, pair.body_b)) return true;
  }
  for (std::uint32_t i = 0; i < island.joint_count; ++i) {
    const core::Joint& joint = step.joints->rows[step.islands->joints[island.first_joint + i]];
    if (is_held(bodies, joint.a, joint.b)) return true;
  }
  return false;
}

// Slow is not at rest: what slides or rolls down gently gathers speed, by more than what trembles
// ever does. Its time begins anew.
bool gathers_speed(const StepContext& step, const Island& island) {
  constexpr double kTremble = 0.1;  // of the thresholds
  Bodies& bodies = *step.bodies;
  const SleepSettings& sleep = step.settings->sleep;
  const double linear = kTremble * sleep.linear_threshold;
  const double angular = kTremble * sleep.angular_threshold;
  double gained = 0;  // J
  for (const BodyIndex body : members(*step.islands, island)) {
    const core::BodyMass& mass = bodies.mass[body];
    gained += core::kinetic_energy(bodies.motion[body], mass.mass) - bodies.still_energy[body];
    gained -= 0.5 * (mass.mass * linear * linear + mass.inertia_b.trace() / 3 * angular * angular);
  }
  if (gained <= 0) return false;
  for (const BodyIndex body : members(*step.islands, island)) bodies.still_time[body] = 0;
  return true;
}

// Whether an island that nothing holds moves as a whole: stopped, its momentum would be lost.
bool drifts(const StepContext& step, const Island& island) {
  constexpr double kDrift = 0.01;  // of the threshold
  const Bodies& bodies = *step.bodies;
  Vec3 momentum = Vec3::Zero();
  double mass = 0;
  bool damped = true;
  for (const BodyIndex body : members(*step.islands, island)) {
    momentum += bodies.mass[body].mass * bodies.motion[body].linear;
    mass += bodies.mass[body].mass;
    damped = damped && bodies.mass[body].linear_damping > 0;
  }
  const double most = kDrift * step.settings->sleep.linear_threshold * mass;
  return !damped && square(momentum) > most * most && !is_supported(step, island);
}

bool is_at_rest(const StepContext& step, const Island& island) {
  return !meets_moving_kinematic(step, island) && !drifts(step, island) &&
         !gathers_speed(step, island);
}

std::uint32_t take_sleeper_row(Sleepers& sleepers) {
  if (sleepers.free_rows.empty()) {
    sleepers.islands.emplace_back();
    return static_cast<std::uint32_t>(sleepers.islands.size() - 1);
  }
  const std::uint32_t row = sleepers.free_rows.back();
  sleepers.free_rows.pop_back();
  return row;
}

void give_sleeper_row(Sleepers& sleepers, std::uint32_t row) {
  sleepers.islands[row].clear();
  auto& rows = sleepers.free_rows;
  rows.insert(std::lower_bound(rows.begin(), rows.end(), row, std::greater<>()), row);
}

// Quarantined bodies are still in `awake`: whoever set them aside ran on a worker.
void retire_quarantined(const StepContext& step) {
  Bodies& bodies = *step.bodies;
  for (const BodyIndex body : bodies.awake) {
    if (!bodies.is(body, core::kAwake | core::kQuarantined)) continue;
    bodies.flags[body] &= ~core::kAwake;
    bodies.awake_stale = true;
    if (step.warnings)
      step.warnings->push_back("body " + std::to_string(body) +
                               " is set aside: its motion was no longer finite");
  }
}

}  // namespace

void finalise_bodies(const StepContext& step, core::IndexRange groups, core::Task&) {
  Islands& islands = *step.islands;
  for (std::uint32_t g = groups.begin; g < groups.end; ++g) {
    const core::IslandGroup& group = islands.groups[g];
    for (std::uint32_t i = group.first; i < group.first + group.count; ++i) {
      if (group.kind == core::GroupKind::free)
        finalise_body(step, islands.free_bodies[i], true);
      else
        finalise_island(step, islands.islands[i]);
    }
  }
}

void put_to_sleep(Bodies& bodies, Sleepers& sleepers, std::span<const BodyIndex> island) {
  const std::uint32_t row = take_sleeper_row(sleepers);
  sleepers.islands[row].assign(island.begin(), island.end());
  for (const BodyIndex body : island) {
    bodies.flags[body] &= ~core::kAwake;
    bodies.motion[body] = {};
    bodies.sleep_island[body] = row;
  }
  bodies.awake_stale = true;
}

void update_sleep(const StepContext& step, core::IndexRange, core::Task&) {
  Bodies& bodies = *step.bodies;
  retire_quarantined(step);
  const SleepSettings& sleep = step.settings->sleep;
  if (!sleep.enabled) return;
  const float enough = core::rounded_to_float(sleep.time);
  for (const Island& island : step.islands->islands)
    if (island.still_time >= enough && is_at_rest(step, island))
      put_to_sleep(bodies, *step.sleepers, members(*step.islands, island));
  for (const BodyIndex body : step.islands->free_bodies)
    if (bodies.is(body, core::kDynamic | core::kAwake) && bodies.still_time[body] >= enough)
      put_to_sleep(bodies, *step.sleepers, {&body, 1});
}

void wake_island(Bodies& bodies, Sleepers& sleepers, BodyIndex body) {
  const std::uint32_t flags = bodies.flags[body];
  if (!(flags & core::kDynamic) || (flags & (core::kAwake | core::kQuarantined))) return;
  const auto wake = [&bodies](BodyIndex member) {
    if (!(bodies.flags[member] & core::kQuarantined)) bodies.flags[member] |= core::kAwake;
    bodies.still_time[member] = 0;
    bodies.sleep_island[member] = core::kNone;
  };
  const std::uint32_t row = bodies.sleep_island[body];
  wake(body);
  bodies.awake_stale = true;
  if (row == core::kNone) return;  // added asleep: an island of its own
  for (const BodyIndex member : sleepers.islands[row]) {
    SKERRY_ASSERT(member == body || bodies.sleep_island[member] == row,
                  "a sleeping island lists a body that does not know it");
    wake(member);
  }
  give_sleeper_row(sleepers, row);
}

}  // namespace skerry::solver
