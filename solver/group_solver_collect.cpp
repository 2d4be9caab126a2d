// Rows and contacts of a group, and the order in which its contacts are solved.
#include <algorithm>

#include "core/assert.h"
#include "core/growth.h"
#include "jobs/blocks.h"
#include "solver/group_solver.h"
#include "solver/row_helpers.h"
#include "solver/solver_scratch.h"

namespace skerry::solver {
namespace {

using namespace core;

constexpr std::uint32_t kCollectGrain = 1024;  // contacts per task

}  // namespace

void GroupSolver::assign_rows() {
  const Island& first = group_.island(0);
  const Island& last = group_.island(group_.islands.count - 1);
  group_.first_body = first.first_body;
  group_.body_count = last.first_body + last.body_count - group_.first_body;
  group_.row_count = 1 + group_.body_count;
  core::make_room(group_.body, group_.row_count);
  group_.body.resize(group_.row_count);
  group_.body[0] = kNone;
  group_.has_locks = group_.has_reloaded = false;
  double lightest = 1e300, heaviest = 0;
  for (std::uint32_t row = 1; row < group_.row_count; ++row) {
    group_.body[row] = group_.step->islands->bodies[group_.first_body + row - 1];
    const std::uint32_t flags = group_.step->bodies->flags[group_.body[row]];
    group_.has_locks = group_.has_locks || (flags & kLockMask) != 0;
    group_.has_reloaded = group_.has_reloaded || (flags & kReloaded) != 0;
    const double mass = group_.step->bodies->mass[group_.body[row]].mass;
    lightest = std::min(lightest, mass);
    heaviest = std::max(heaviest, mass);
  }
  group_.unequal_masses = heaviest >= kHeavyOnLight * lightest;
  for (const std::uint32_t kinematic : used_kinematics_) kinematic_row_[kinematic] = 0;
  used_kinematics_.clear();
  core::grow(kinematic_row_, group_.step->solver->islands.kinematics.size());
}

std::uint32_t GroupSolver::row_of(BodyIndex body) {
  const std::uint32_t slot = body == kNone ? kNone : group_.step->solver->islands.slot[body];
  const std::uint32_t row = row_in(slot);
  return row == kNone ? seat(slot & ~kKinematicSlot, body) : row;
}

// Dynamic bodies of the group have their rows already; a kinematic one gets its row when it is
// first met (kNone until then); all others share row 0.
std::uint32_t GroupSolver::row_in(std::uint32_t slot) const {
  if (slot == kNone) return 0;
  if (!(slot & kKinematicSlot)) {
    SKERRY_ASSERT(slot - group_.first_body < group_.body_count,
                  "a contact or joint leaves its island");
    return slot - group_.first_body + 1;
  }
  const std::uint32_t row = kinematic_row_[slot & ~kKinematicSlot];
  return row == 0 ? kNone : row;
}

std::uint32_t GroupSolver::seat(std::uint32_t kinematic, BodyIndex body) {
  kinematic_row_[kinematic] = group_.row_count++;
  used_kinematics_.push_back(kinematic);
  group_.body.push_back(body);
  return kinematic_row_[kinematic];
}

void GroupSolver::collect(jobs::Task& task) {
  const Island& first = group_.island(0);
  const Island& last = group_.island(group_.islands.count - 1);
  first_contact_ = first.first_contact;
  group_.contact_count = last.first_contact + last.contact_count - first_contact_;
  core::grow(group_.contacts, group_.contact_count);
  core::grow(group_.row_a, group_.contact_count);
  core::grow(group_.row_b, group_.contact_count);
  has_bounces_.store(false, std::memory_order_relaxed);
  has_placed_.store(false, std::memory_order_relaxed);
  has_unsettled_.store(false, std::memory_order_relaxed);
  meets_kinematics_.store(false, std::memory_order_relaxed);
  const std::uint32_t grain =
      group_.islands.kind == GroupKind::wide ? kCollectGrain : group_.contact_count;
  jobs::run_blocks(task, group_.contact_count == 0 ? 0 : (group_.contact_count - 1) / grain + 1,
                   [&](std::uint32_t block, std::uint32_t) {
                     const std::uint32_t begin = block * grain;
                     collect_contacts(begin, begin + std::min(grain, group_.contact_count - begin));
                   });
  if (meets_kinematics_.load(std::memory_order_relaxed)) seat_kinematics();
  joints_.collect(*group_.step, group_.islands.first, group_.islands.count,
                  [this](BodyIndex body) { return row_of(body); });
  group_.joined = !joints_.empty();
}

void GroupSolver::collect_contacts(std::uint32_t begin, std::uint32_t end) {
  const ContactTable& table = *group_.step->contacts;
  const ContactRef* refs = group_.step->islands->contacts.data() + first_contact_;
  const std::uint32_t* slots = group_.step->solver->islands.slot.data();
  bool bounces = false, placed = false, unsettled = false, kinematics = false;
  for (std::uint32_t i = begin; i < end; ++i) {
    const ContactRef ahead = refs[std::min(i + kPrefetch, group_.contact_count - 1)];
    prefetch(table.manifolds[ahead.manifold]);
    prefetch(table.pairs[ahead.pair]);
    const ContactPair& pair = table.pairs[refs[i].pair];
    const Manifold& manifold = table.manifolds[refs[i].manifold];
    const std::uint32_t slot_a = slots[pair.body_a], slot_b = slots[pair.body_b];
    group_.row_a[i] = row_in(slot_a);
    group_.row_b[i] = row_in(slot_b);
    const Vec3 offset = center_in(slot_b, pair.body_b) - center_in(slot_a, pair.body_a);
    group_.contacts[i] = {{offset.x(), offset.y(), offset.z()},
                          refs[i].manifold,
                          kind_of(manifold, group_.row_a[i], group_.row_b[i]),
                          0,
                          is_loose(manifold)};
    bounces = bounces || manifold.restitution > 0;
    placed = placed || manifold.begins;
    unsettled = unsettled || is_unsettled(manifold);
    kinematics = kinematics || group_.row_a[i] == kNone || group_.row_b[i] == kNone;
  }
  if (bounces) has_bounces_.store(true, std::memory_order_relaxed);
  if (placed) has_placed_.store(true, std::memory_order_relaxed);
  if (unsettled) has_unsettled_.store(true, std::memory_order_relaxed);
  if (kinematics) meets_kinematics_.store(true, std::memory_order_relaxed);
}

void GroupSolver::seat_kinematics() {
  const ContactRef* refs = group_.step->islands->contacts.data() + first_contact_;
  for (std::uint32_t i = 0; i < group_.contact_count; ++i) {
    const ContactPair& pair = group_.step->contacts->pairs[refs[i].pair];
    if (group_.row_a[i] == kNone) group_.row_a[i] = row_of(pair.body_a);
    if (group_.row_b[i] == kNone) group_.row_b[i] = row_of(pair.body_b);
  }
}

// Whether some of its four points were free at the end of the last step.
bool GroupSolver::is_loose(const Manifold& manifold) {
  const float* impulse = manifold.normal_impulse;
  return manifold.point_count < 4 ||
         std::min(std::min(impulse[0], impulse[1]), std::min(impulse[2], impulse[3])) <= 0;
}

ContactKind GroupSolver::kind_of(const Manifold& manifold, std::uint32_t row_a,
                                 std::uint32_t row_b) const {
  const auto locked = [this](std::uint32_t row) {
    return row - 1 < group_.body_count &&
           (group_.step->bodies->flags[group_.body[row]] & kLockMask) != 0;
  };
  const bool full = manifold.restitution > 0 || manifold.rolling_resistance > 0 ||
                    (group_.has_locks && (locked(row_a) || locked(row_b)));
  const bool one = manifold.point_count <= 1;
  if (full) return one ? ContactKind::point1_full : ContactKind::points4_full;
  return one ? ContactKind::point1 : ContactKind::points4;
}

const Vec3& GroupSolver::center_in(std::uint32_t slot, BodyIndex body) const {
  return slot != kNone && slot & kKinematicSlot
             ? group_.step->solver->islands.kinematics[slot & ~kKinematicSlot].center
             : group_.step->bodies->pose[body].center;
}

// Counting sort by (effort, colour, kind, loose), stable, each kind padded to whole blocks.
void GroupSolver::bucket_contacts() {
  const std::uint32_t width = kernels_->width;
  const std::size_t kinds = std::size_t{loads_.efforts()} * colouring_.colours * kContactKinds;
  core::refill(bucket_, 2 * kinds, 0u);
  const auto key = [this](std::uint32_t contact) {
    const GroupContact& c = group_.contacts[contact];
    const std::uint32_t kind =
        (c.effort * colouring_.colours + colouring_.colour[contact]) * kContactKinds +
        static_cast<std::uint32_t>(c.kind);
    return 2 * kind + (c.loose ? 1 : 0);
  };
  for (std::uint32_t i = 0; i < group_.contact_count; ++i) ++bucket_[key(i)];
  std::uint32_t first = 0;
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    std::uint32_t* sizes = &bucket_[2 * kind];
    const std::uint32_t firm = sizes[0], all = firm + sizes[1];
    sizes[0] = first;
    sizes[1] = first + firm;
    first += (all + width - 1) / width * width;
  }
  core::refill(lanes_, first, kNone);
  chunks_.clear();
  for (std::uint32_t i = 0; i < group_.contact_count; ++i) lanes_[bucket_[key(i)]++] = i;
}

void GroupSolver::make_chunks() {
  const std::uint32_t width = kernels_->width;
  colour_chunks_.assign(1, 0);
  std::size_t memory = 0;
  std::uint32_t lane = 0;
  for (std::uint32_t colour = 0; colour < loads_.efforts() * colouring_.colours; ++colour) {
    for (std::uint32_t kind = 0; kind < kContactKinds; ++kind) {
      // After sorting bucket_ holds the end of each bucket's contacts.
      const std::uint32_t end = bucket_[2 * (colour * kContactKinds + kind) + 1];
      std::uint32_t blocks = end > lane ? (end - lane + width - 1) / width : 0;
      while (blocks > 0) {
        const std::uint32_t count = std::min(blocks, block_grain_);
        chunks_.push_back({static_cast<ContactKind>(kind), count, memory, lane});
        memory += count * kernels_->kind[kind].block_bytes;
        lane += count * width;
        blocks -= count;
      }
    }
    colour_chunks_.push_back(static_cast<std::uint32_t>(chunks_.size()));
  }
  core::grow(memory_, (memory + sizeof(Memory) - 1) / sizeof(Memory));
}

}  // namespace skerry::solver
