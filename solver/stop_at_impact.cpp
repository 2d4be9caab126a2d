#include "solver/stop_at_impact.h"

#include <algorithm>
#include <cmath>

#include "core/trig.h"
#include "solver/fast_watch.h"
#include "solver/free_flight.h"
#include "solver/rotation.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;
using core::Island;
using core::StepContext;

constexpr double kNear = 1, kMostShift = 0.25;  // inner radii
constexpr double kAnyTime = 1e30;               // s

void fly_again(const StepContext& step, BodyIndex body, double part) {
  core::Bodies& bodies = *step.bodies;
  const core::FastStart& start = step.fast->start[body];
  bodies.pose[body] = start.pose;
  bodies.motion[body] = start.motion;
  if (!(part * step.dt > 0)) return;
  StepContext shorter = step;
  shorter.dt = part * step.dt;
  core::add_force(bodies, body, start.force.force, start.force.torque);
  fly_free(shorter, body);
  bodies.force[body] = {};
  bodies.flags[body] &= ~std::uint32_t{core::kForced};
}

// The orientation at a time between two.
Quat between(const Quat& from, const Quat& to, double part) {
  Quat turn = to * from.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const double sine = turn.vec().norm();
  if (sine == 0) return from;
  return turned(from, turn.vec() * (part * 2 * core::trig::atan2(sine, turn.w()) / sine));
}

// The island of a body, if nothing but contacts acted on it, or kNone.
std::uint32_t isolated_island(const StepContext& step, BodyIndex body) {
  const std::uint32_t slot = step.solver->islands.slot[body];
  if (slot & kKinematicSlot) return core::kNone;
  const std::vector<Island>& islands = step.islands->islands;
  const auto after = std::upper_bound(
      islands.begin(), islands.end(), slot,
      [](std::uint32_t place, const Island& island) { return place < island.first_body; });
  const Island& island = *(after - 1);
  return island.isolated ? static_cast<std::uint32_t>(&island - islands.data()) : core::kNone;
}

// One that stops before the impact that turned it has its energy as it is turned then, if that is near.
Quat orientation_at(const StepContext& step, BodyIndex body, double part) {
  const core::FastStart& start = step.fast->start[body];
  const core::BodyMass& mass = step.bodies->mass[body];
  const double time = part * step.dt;
  if (start.impact < 0 && start.knots.empty())
    return between(start.pose.orientation, step.bodies->pose[body].orientation, part);
  const double turn = start.motion.angular.norm() * double(mass.turn_radius);
  const bool near = turn * (start.impact - time) <= kNear * double(mass.inner_radius) ||
                    isolated_island(step, body) != core::kNone;
  if (start.impact < 0 || (time < start.impact && !near))
    return pushed_orientation(step, body, start, time);
  return orientation_after(step.dt - std::max(time, start.impact), mass, step.bodies->flags[body],
                           step.bodies->pose[body].orientation,
                           -step.bodies->motion[body].angular_momentum, Vec3::Zero());
}

void go_back(const StepContext& step, BodyIndex body, double part) {
  core::Bodies& bodies = *step.bodies;
  const core::FastStart& start = step.fast->start[body];
  core::BodyPose& pose = bodies.pose[body];
  core::BodyMotion& motion = bodies.motion[body];
  const core::BodyMass& mass = bodies.mass[body];
  const std::uint32_t flags = bodies.flags[body];
  const double before = kinetic_energy(motion, mass.mass);
  const Vec3 way = pose.center - start.pose.center;
  const Vec3 lost = (1 - part) * way;
  pose.center = start.pose.center + part * way;
  pose.orientation = orientation_at(step, body, part);
  const double squared = motion.linear.squaredNorm();
  const Vec3 gravity = mass.gravity_scale * step.settings->gravity;
  if (squared > 0) {
    motion.linear *= std::sqrt(std::max(0.0, 1 - 2 * gravity.dot(lost) / squared));
  }
  motion.angular = angular_velocity(mass, flags, pose.orientation, motion.angular_momentum);
  if (step.effects) {
    step.effects->bodies[body].energy_lost +=
        before - kinetic_energy(motion, mass.mass) - mass.mass * gravity.dot(lost);
  }
}

void stop(const StepContext& step, BodyIndex body) {
  const double part = step.fast->part[body];
  if (step.fast->start[body].flight == core::FastFlight::free)
    fly_again(step, body, part);
  else
    go_back(step, body, part);
}

// Who was stopped off the line that its momentum acts along leaves a change in the moment of momenta to its
// island. Shifts take it back that are smaller together than the one that would put it onto that line.
void settle(const StepContext& step, const Island& island, const Vec3& change) {
  MomentShift& moment = step.solver->moment;
  const BodyIndex* body = step.islands->bodies.data() + island.first_body;
  moment.begin(kMostShift, kAnyTime);
  for (std::uint32_t i = 0; i < island.body_count; ++i)
    moment.add(step.bodies->mass[body[i]], step.bodies->motion[body[i]].linear);
  moment.solve(change);
  for (std::uint32_t i = 0; i < island.body_count; ++i) {
    step.bodies->pose[body[i]].center += moment.shift(i);
    step.fast->moved.push_back(body[i]);
  }
}

// How much the stop of a body changes the moment of its momentum.
Vec3 stopped_moment(const StepContext& step, BodyIndex body) {
  const Vec3 from = step.bodies->pose[body].center;
  stop(step, body);
  return (step.bodies->pose[body].center - from)
      .cross(step.bodies->mass[body].mass * step.bodies->motion[body].linear);
}

}  // namespace

void stop_at_impacts(const StepContext& step) {
  core::FastBodies& fast = *step.fast;
  std::vector<MomentChange>& changes = step.solver->moment_changes;
  changes.clear();
  fast.moved.clear();
  for (const BodyIndex body : fast.stopped) {
    const Vec3 change = stopped_moment(step, body);
    const bool pushed = fast.start[body].flight == core::FastFlight::pushed;
    const std::uint32_t island = pushed ? isolated_island(step, body) : core::kNone;
    if (island == core::kNone)
      fast.moved.push_back(body);
    else
      changes.push_back({island, body, change});
  }
  std::sort(changes.begin(), changes.end(), [](const MomentChange& a, const MomentChange& b) {
    return a.island != b.island ? a.island < b.island : a.body < b.body;
  });
  for (std::size_t i = 0; i < changes.size();) {
    const std::uint32_t island = changes[i].island;
    Vec3 change = Vec3::Zero();
    for (; i < changes.size() && changes[i].island == island; ++i) change += changes[i].change;
    settle(step, step.islands->islands[island], change);
  }
}

}  // namespace skerry::solver
