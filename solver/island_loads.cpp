#include "solver/island_loads.h"

#include <algorithm>
#include <cmath>

#include "core/vec.h"

namespace skerry::solver {
namespace {

using namespace core;

// Mass ratio of a body and what it rests on from which joints no longer answer contacts: these then
// carry the load that joints would take from them (docs/decisions/0012).
constexpr double kJointsYield = 8;

constexpr double kRestsOn = 0.3;  // cosine of the normal and gravity

// See effort_of.
constexpr double kRatioPerPass = 32;  // mass ratio
constexpr std::uint8_t kMostEffort = 5;
constexpr std::uint64_t kEffortBudget = 8192;  // contacts times passes of an island

}  // namespace

void IslandLoads::set_efforts(GroupData& group) {
  group_ = &group;
  efforts_ = 1;
  yields_.clear();
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < group_->islands.count; ++i) {
    const std::uint32_t end = begin + group_->island(i).contact_count;
    const double ratio = group_->unequal_masses ? heavy_on_light(begin, end) : 0;
    const std::uint8_t effort = effort_of(ratio, end - begin);
    yields_.push_back(ratio > kJointsYield);
    for (std::uint32_t k = begin; effort > 0 && k < end; ++k) group_->contacts[k].effort = effort;
    efforts_ = std::max(efforts_, effort + 1u);
    begin = end;
  }
}

// How many times heavier than the lightest the heaviest of those bodies is that rest on a lighter one;
// 0: none does.
double IslandLoads::heavy_on_light(std::uint32_t begin, std::uint32_t end) const {
  const Bodies& bodies = *group_->step->bodies;
  const Vec3& gravity = group_->step->settings->gravity;
  double heaviest = 0, lightest = 1e300;
  for (std::uint32_t i = begin; i < end; ++i) {
    const std::uint32_t row_a = group_->row_a[i], row_b = group_->row_b[i];
    if (row_a - 1 >= group_->body_count || row_b - 1 >= group_->body_count) continue;
    const double a = bodies.mass[group_->body[row_a]].mass;
    const double b = bodies.mass[group_->body[row_b]].mass;
    if (a < kHeavyOnLight * b && b < kHeavyOnLight * a) continue;
    const V3f normal = group_->manifold(i).normal;
    const double down = gravity.dot(to_double(normal));  // positive: b lies below a
    if ((a > b ? down : -down) <= kRestsOn * gravity.norm()) continue;
    heaviest = std::max(heaviest, std::max(a, b));
    lightest = std::min(lightest, std::min(a, b));
  }
  return heaviest / lightest;
}

// Where a heavy body rests on a light one, a pass carries no more than the light one's share of the
// load, and warm starting builds it up only over (mass ratio) passes: meanwhile the heavy body sinks
// by about g h^2 times that. More passes, for that island alone, keep this small.
std::uint8_t IslandLoads::effort_of(double ratio, std::uint32_t contacts) {
  std::uint8_t effort = 0;
  while (effort < kMostEffort && ratio > kRatioPerPass * (1 << effort) &&
         (std::uint64_t{contacts} << (effort + 1)) <= kEffortBudget) {
    ++effort;
  }
  return effort;
}

void IslandLoads::share() {
  if (!(group_->step->settings->gravity.norm() > 0)) return;
  std::uint32_t begin = 0;
  for (std::uint32_t i = 0; i < group_->islands.count; ++i) {
    const Island& island = group_->island(i);
    if (island.joint_count == 0) share(island, begin);
    begin += island.contact_count;
  }
}

void IslandLoads::share(const Island& island, std::uint32_t begin) {
  const std::uint32_t end = begin + island.contact_count;
  bool begins = false, unsettled = false;
  for (std::uint32_t k = begin; k < end; ++k) {
    begins = begins || group_->manifold(k).begins;
    unsettled = unsettled || is_unsettled(group_->manifold(k));
  }
  const bool reloaded = is_reloaded(island);
  if (!begins && !unsettled && !reloaded) return;
  const bool all = is_slow(island) && is_plain(island, begin);
  if (!begins && !all) return;
  using Scope = StandingLoads::Scope;
  const double h = group_->step->dt / group_->step->settings->solver.substeps;
  standing_loads_.begin(group_->row_count, group_->step->settings->gravity, h,
                        !all                 ? Scope::begun
                        : begins || reloaded ? Scope::all_anew
                                             : Scope::all);
  add_bodies(island);
  for (std::uint32_t k = begin; k < end; ++k) add_support(k);
  standing_loads_.share();
  if (!all) return;
  for (std::uint32_t k = begin; k < end; ++k) {
    Manifold& m = group_->manifold(k);
    m.settled = m.standing_impulse > 0 || m.pressed_time > 0;
  }
}

// Whether statics is to be trusted: all contacts were placed, or each body rests on one other.
bool IslandLoads::is_plain(const Island& island, std::uint32_t begin) const {
  std::uint32_t pressed = 0;
  bool placed = true;
  for (std::uint32_t k = begin; k < begin + island.contact_count; ++k) {
    const Manifold& manifold = group_->manifold(k);
    if (!manifold.begins && !(manifold.pressed_time > 0)) continue;
    placed = placed && manifold.placed;
    ++pressed;
  }
  return placed || pressed <= island.body_count;
}

bool IslandLoads::is_reloaded(const Island& island) const {
  if (!group_->has_reloaded) return false;
  for (std::uint32_t k = 0; k < island.body_count; ++k) {
    const BodyIndex body = group_->step->islands->bodies[island.first_body + k];
    if (group_->step->bodies->is(body, kReloaded)) return true;
  }
  return false;
}

bool IslandLoads::is_slow(const Island& island) const {
  const Bodies& bodies = *group_->step->bodies;
  for (std::uint32_t k = 0; k < island.body_count; ++k) {
    const BodyIndex body = group_->step->islands->bodies[island.first_body + k];
    const BodyMotion& motion = bodies.motion[body];
    const double radius = bodies.mass[body].radius;
    if (motion.linear.squaredNorm() + radius * radius * motion.angular.squaredNorm() >
        double(kImpactSpeed) * double(kImpactSpeed))
      return false;
  }
  return true;
}

void IslandLoads::add_bodies(const Island& island) {
  const Bodies& bodies = *group_->step->bodies;
  const double gravity = group_->step->settings->gravity.norm();
  for (std::uint32_t k = 0; k < island.body_count; ++k) {
    const std::uint32_t row = island.first_body + k - group_->first_body + 1;
    const core::BodyMass& mass = bodies.mass[group_->body[row]];
    standing_loads_.add_body(row, mass.mass * mass.gravity_scale * gravity);
  }
}

// Bodies with locks bear what they are given.
void IslandLoads::add_support(std::uint32_t index) {
  const Bodies& bodies = *group_->step->bodies;
  const Vec3& gravity = group_->step->settings->gravity;
  const auto gives_way = [&](std::uint32_t row) {
    return row - 1 < group_->body_count && (bodies.flags[group_->body[row]] & kLockMask) == 0;
  };
  Manifold& manifold = group_->manifold(index);
  const double down = gravity.dot(to_double(manifold.normal));  // positive: b lies below a
  if (std::abs(down) <= kRestsOn * gravity.norm()) return;
  const bool a_rests = down > 0;
  const std::uint32_t above = a_rests ? group_->row_a[index] : group_->row_b[index];
  const std::uint32_t below = a_rests ? group_->row_b[index] : group_->row_a[index];
  if (!gives_way(above)) return;
  const double* o = group_->contacts[index].offset;
  const Vec3 from_a = Vec3::Zero(), from_b = -Vec3(o[0], o[1], o[2]);
  standing_loads_.add({above,
                       gives_way(below) ? below : StandingLoads::kGround,
                       &manifold,
                       {a_rests ? from_a : from_b, a_rests ? from_b : from_a}});
}

}  // namespace skerry::solver
