// Contacts of a group: into blocks of lanes, and what they gave to their bodies out of them.
#include <algorithm>
#include <span>

#include "core/rounding.h"
#include "solver/effect_watch.h"
#include "solver/group_solver.h"
#include "solver/row_helpers.h"

namespace skerry::solver {
namespace {

using namespace core;

const Manifold& empty_manifold() {
  static const Manifold empty = [] {
    Manifold m{};
    m.normal = {0, 1, 0};
    return m;
  }();
  return empty;
}

}  // namespace

void GroupSolver::prepare_chunk(const Chunk& chunk) {
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  const bool full =
      chunk.kind == ContactKind::points4_full || chunk.kind == ContactKind::point1_full;
  const bool foreseen = full && has_bounces_.load(std::memory_order_relaxed);
  std::byte* block = block_memory() + chunk.memory;
  const std::uint32_t* contact = &lanes_[chunk.first_lane];
  LaneInput input;
  for (std::uint32_t i = 0; i < chunk.count; ++i, block += kernel.block_bytes) {
    if (foreseen) move_to_touch({contact, kernels_->width});
    fill_lanes(input, {contact, kernels_->width}, full, false);
    if (kernel.prepare(pass_, input, block)) impacts_.set_bounces();
    contact += kernels_->width;
  }
}

void GroupSolver::take_back_chunk(const Chunk& chunk) {
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  std::byte* block = block_memory() + chunk.memory;
  const std::uint32_t* contact = &lanes_[chunk.first_lane];
  LaneInput input;
  for (std::uint32_t i = 0; i < chunk.count; ++i, block += kernel.block_bytes) {
    fill_lanes(input, {contact, kernels_->width}, true, true);
    kernel.take_back(pass_, input, block);
    contact += kernels_->width;
  }
}

// Offsets refer to the time of the manifold's geometry.
void GroupSolver::move_to_touch(std::span<const std::uint32_t> contacts) {
  for (const std::uint32_t contact : contacts) {
    const float time = contact == kNone ? 0 : group_.manifold(contact).touch_time;
    if (!(time > 0)) continue;
    const Vec3 moved = impacts_.offset_after(contact, 0, double(time));
    for (int axis = 0; axis < 3; ++axis) group_.contacts[contact].offset[axis] = moved[axis];
  }
}

// `full`: of contacts that need it; `impact`: see fill_full.
void GroupSolver::fill_lanes(LaneInput& input, std::span<const std::uint32_t> contacts, bool full,
                             bool impact) const {
  for (std::uint32_t lane = 0; lane < contacts.size(); ++lane) {
    fill_lane(input, lane, contacts[lane]);
    if (full) fill_full(input, lane, contacts[lane], impact);
  }
}

void GroupSolver::fill_lane(LaneInput& input, std::uint32_t lane, std::uint32_t index) const {
  const bool padding = index == kNone;
  const Manifold& manifold = padding ? empty_manifold() : group_.manifold(index);
  prefetch(manifold);
  input.manifold[lane] = reinterpret_cast<const float*>(&manifold);
  input.row_a[lane] = padding ? 0 : group_.row_a[index];
  input.row_b[lane] = padding ? 0 : group_.row_b[index];
  for (int k = 0; k < 3; ++k) {
    input.offset[k][lane] =
        padding ? 0.0f : core::rounded_to_float(group_.contacts[index].offset[k]);
  }
}

// m, of a point at the time of the manifold's geometry.
float GroupSolver::gap_at_touch(std::uint32_t contact, std::uint32_t point) const {
  const Manifold& manifold = group_.manifold(contact);
  return manifold.touch_time > 0
             ? group_.step->contacts->touch_gaps[group_.contacts[contact].manifold][point]
             : manifold.points[point].separation;
}

// `impact`: for an impact among several bodies, at the time of those; else as the manifold is.
void GroupSolver::fill_full(LaneInput& input, std::uint32_t lane, std::uint32_t contact,
                            bool impact) const {
  const bool padding = contact == kNone;
  const std::uint32_t a = padding ? 0 : group_.row_a[contact];
  const std::uint32_t b = padding ? 0 : group_.row_b[contact];
  const bool free = !padding && impacts_.flies(a) && impacts_.flies(b);
  double time = padding ? 0 : double(group_.manifold(contact).touch_time);
  input.touch[lane] =
      free && (time > 0 || impacts_.touches(contact)) ? core::rounded_to_float(time) : -1;
  input.held[lane] = free ? 0.0f : 1.0f;
  const float slowest = pass_.restitution_threshold;
  input.slowest[lane] =
      free ? core::slowest_bounce(slowest, group_.manifold(contact).restitution) : slowest;
  for (std::uint32_t k = 0; k < 4; ++k) input.gap[k][lane] = padding ? 0 : gap_at_touch(contact, k);
  Vec3 shift = Vec3::Zero();
  if (impact && free) {
    const double then = impacts_.time_of_impacts(contact);
    shift = impacts_.way(b, then) - impacts_.way(a, then) -
            (impacts_.way(b, time) - impacts_.way(a, time));
    time = then;
  }
  for (int k = 0; k < 3; ++k) input.shift[k][lane] = core::rounded_to_float(shift[k]);
  fill_side(input, false, lane, a, free ? time : 0);
  fill_side(input, true, lane, b, free ? time : 0);
}

void GroupSolver::fill_side(LaneInput& input, bool is_b, std::uint32_t lane, std::uint32_t row,
                            double time) const {
  auto& inv_mass = is_b ? input.inv_mass_b : input.inv_mass_a;
  auto& inertia = is_b ? input.inertia_b : input.inertia_a;
  auto& angular = is_b ? input.angular_b : input.angular_a;
  const MassRow& mass = group_.mass[row];
  Sym3f inverse = mass.inv_inertia;
  V3f omega = start_[row].angular;
  if (time > 0 && row - 1 < group_.body_count) {
    const Impacts::Spin spin = impacts_.spin_after(row, time);
    inverse = spin.inv_inertia;
    omega = spin.angular;
  }
  for (std::uint32_t k = 0; k < 3; ++k)
    inv_mass[k][lane] = mass.lock_flags & (kLockX << k) ? 0.0f : mass.inv_mass;
  const float six[6] = {inverse.xx, inverse.xy, inverse.xz, inverse.yy, inverse.yz, inverse.zz};
  for (int k = 0; k < 6; ++k) inertia[k][lane] = six[k];
  const float three[3] = {omega.x, omega.y, omega.z};
  for (int k = 0; k < 3; ++k) angular[k][lane] = three[k];
}

void GroupSolver::store_chunk(const Chunk& chunk) {
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  const std::byte* block = block_memory() + chunk.memory;
  Manifold sink;  // of padding lanes
  LaneOutput output;
  const std::uint32_t* contact = &lanes_[chunk.first_lane];
  for (std::uint32_t i = 0; i < chunk.count; ++i, block += kernel.block_bytes) {
    for (std::uint32_t k = 0; k < kernels_->width; ++k) {
      Manifold& manifold = contact[k] == kNone ? sink : group_.manifold(contact[k]);
      prefetch(manifold);
      output.manifold[k] = reinterpret_cast<float*>(&manifold);
    }
    kernel.store(block, output);
    for (std::uint32_t k = 0; k < kernels_->width; ++k) {
      if (contact[k] == kNone) continue;
      book(output, k, contact[k]);
      if (group_.step->effects) judge(contact[k]);
    }
    contact += kernels_->width;
  }
}

// Before it is booked.
void GroupSolver::note_push(std::uint32_t index, bool bounced) {
  for (const std::uint32_t row : {group_.row_a[index], group_.row_b[index]}) {
    if (row - 1 >= group_.body_count) continue;
    Ledger& ledger = group_.ledger[row];
    ledger.several = ledger.several || ledger.pushed;
    if (!bounced) continue;
    ledger.bounced = true;
    ledger.bounce_time = group_.manifold(index).touch_time;
  }
}

// Equal and opposite in double, at one and the same point: momentum and angular momentum of the two
// bodies together stay put to rounding in double.
void GroupSolver::book(const LaneOutput& output, std::uint32_t lane, std::uint32_t index) {
  const LaneOutput::Row& push_row = output.push[lane];
  const LaneOutput::Row& torque_row = output.torque[lane];
  const Vec3 push = to_double(push_row.v), torque_a = to_double(torque_row.v);
  // NaN as well: the body is to be set aside, not to fly on. A bounce may take back all of the push
  // but not its friction.
  const bool pushed = !(push_row.s <= 0) || !push.isZero(0) || !torque_a.isZero(0);
  const bool impact = pushed && torque_row.s > kImpactSpeed;
  Manifold& manifold = group_.manifold(index);
  const float* n = manifold.normal_impulse;
  carry(carrying_, ((n[0] + n[1]) + (n[2] + n[3])) / static_cast<float>(manifold.point_count),
        manifold);
  const auto add = [&](std::uint32_t row, const Vec3& impulse, const Vec3& torque, double sign) {
    if (row - 1 >= group_.body_count) return;
    Ledger& ledger = group_.ledger[row];
    for (int k = 0; k < 3; ++k) {
      ledger.impulse[k] += sign * impulse[k];
      ledger.angular_impulse[k] += sign * torque[k];
    }
    ledger.pushed = ledger.pushed || pushed;
    if (pushed) ledger.held.hold(manifold.normal, manifold.point_count > 1);
    ledger.impact = ledger.impact || impact;
  };
  const double* o = group_.contacts[index].offset;
  Vec3 offset(o[0], o[1], o[2]);
  if (impacts_.bounces() && pushed) note_push(index, output.bounced[lane] > 0);
  if (impacts_.timed() && output.struck[lane] > 0 && impacts_.flies(group_.row_a[index]) &&
      impacts_.flies(group_.row_b[index]))
    offset = impacts_.offset_after(index, double(group_.manifold(index).touch_time),
                                   impacts_.time_of_impacts(index));
  add(group_.row_a[index], push, torque_a, -1);
  add(group_.row_b[index], push, torque_a - offset.cross(push), 1);
}

// How well the contact keeps its law, by the rows as the last pass left them.
void GroupSolver::judge(std::uint32_t index) {
  const GroupContact& contact = group_.contacts[index];
  const Manifold& manifold = group_.manifold(index);
  const Vec3 offset(contact.offset[0], contact.offset[1], contact.offset[2]);
  const Vec3 n = to_double(manifold.normal);
  ContactSide side[2];
  Vec3 shift[2];
  Mat3 turn[2];
  for (int k = 0; k < 2; ++k) {
    const std::uint32_t row = k == 0 ? group_.row_a[index] : group_.row_b[index];
    const MassRow& mass = group_.mass[row];
    const Sym3f& inverse = mass.inv_inertia;
    side[k].linear = to_double(group_.velocity[row].linear);
    side[k].angular = to_double(group_.velocity[row].angular);
    side[k].inv_mass = unlocked(Vec3::Constant(double(mass.inv_mass)), mass.lock_flags, kLockX);
    side[k].inv_inertia << double(inverse.xx), double(inverse.xy), double(inverse.xz),
        double(inverse.xy), double(inverse.yy), double(inverse.yz), double(inverse.xz),
        double(inverse.yz), double(inverse.zz);
    const Q4f& q = group_.delta[row].rotation;
    shift[k] = to_double(group_.delta[row].translation);
    turn[k] = Quat(double(q.w), double(q.x), double(q.y), double(q.z)).toRotationMatrix();
  }
  double gap[4] = {};
  for (std::uint32_t i = 0; i < manifold.point_count; ++i) {
    // A rounded surface turns about the centre of its rounding.
    const Vec3 at = to_double(manifold.points[i].position);
    const Vec3 arm_a = at - double(manifold.rounding_a) * n;
    const Vec3 arm_b = at - offset + double(manifold.rounding_b) * n;
    const Vec3 moved = shift[1] + turn[1] * arm_b - arm_b - shift[0] - turn[0] * arm_a + arm_a;
    gap[i] = double(manifold.points[i].separation) + n.dot(moved);
  }
  group_.step->effects->contacts[contact.manifold] = contact_residual(
      *group_.step, manifold, offset, side[0], side[1], gap, double(pass_.substep));
}

}  // namespace skerry::solver
