// Bounces of free bodies at their own time within the step: when they happen, how their bodies fly there
// and on from there, and how bodies are kept from flying into others (docs/decisions/0024, 0025).
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "solver/group_data.h"

namespace skerry::solver {

class Impacts {
 public:
  // What turns of a body at some time, world.
  struct Spin {
    core::Sym3f inv_inertia;  // kg^-1 m^-2
    core::V3f angular;        // rad/s
  };

  // Once all contacts are known; `may_bounce`: some contact's materials do. The group must outlive this.
  void begin(GroupData& group, bool may_bounce);

  // Whether contacts bounce in this step: known, and set by any worker, when contacts are prepared.
  void set_bounces() { bounces_.store(true, std::memory_order_relaxed); }
  bool bounces() const { return bounces_.load(std::memory_order_relaxed); }
  // Whether bounces of several bodies of an island have a time of their own, and bodies are parted.
  bool timed() const { return bounces() && !group_->joined; }

  // Whether a body that no contact touches flies as external forces alone make it.
  bool flies(std::uint32_t row) const;
  // Whether a contact has no gap at the start of the step.
  bool touches(std::uint32_t contact) const;
  // m: how far a body flies in `time` s from the start of the step, if no contact touches it.
  Vec3 way(std::uint32_t row, double time) const;
  // How a body turns `time` s after the start of the step, if no contact touches it.
  Spin spin_after(std::uint32_t row, double time) const;
  // m: centre of b from centre of a at a time, by its offset, which is of another.
  Vec3 offset_after(std::uint32_t contact, double from, double time) const;
  // s: when impacts among several bodies of its island happen.
  double time_of_impacts(std::uint32_t contact) const;
  // s: when all that contacts gave to the body in this step was given; negative: over the step.
  double time_of_impact(std::uint32_t row) const;

  // Struck bodies fly freely to the impacts of their island, or stay where they are for half of what follows.
  void rebalance(std::uint32_t begin, std::uint32_t end);
  // After contacts are booked: where bodies come that fly to their impacts and on.
  void fly(std::uint32_t begin, std::uint32_t end);
  DeltaRow* flown() { return flown_.data(); }
  // Where a body comes that flies freely to its impact, and on from it.
  core::BodyPose pose_after(std::uint32_t row, double time) const;
  // m: how far the body has been moved away from others that it would have flown into.
  Vec3 parted(std::uint32_t row) const;
  // Takes the energy that parting gave to a body from its motion. `orientation`: after the step.
  void pay_for_parting(std::uint32_t row, const Quat& orientation, core::BodyMotion& motion) const;

 private:
  void find_held();
  bool is_pressed(const core::Manifold& manifold, bool alone) const;
  bool is_forced(std::uint32_t row) const;
  bool stays(std::uint32_t row) const;
  float first_impact(std::uint32_t begin, std::uint32_t end) const;
  Vec3 torque_on(std::uint32_t row) const;

  GroupData* group_ = nullptr;
  std::atomic<bool> bounces_ = false;
  std::vector<std::uint8_t> held_;     // [rows] see find_held
  std::vector<float> impact_time_;     // [rows] s, when impacts among several of its island happen
  std::vector<DeltaRow> flown_;        // [rows] see ContactPass; written where contacts may bounce
  std::vector<core::V3f> flown_from_;  // [rows] m, their translation before bodies were parted
};

inline bool Impacts::flies(std::uint32_t row) const {
  if (row - 1 >= group_->body_count) return true;
  return !group_->joined && held_[row] == 0 && !group_->outlook[row].from_rows &&
         group_->mass[row].lock_flags == 0;
}

inline double Impacts::time_of_impact(std::uint32_t row) const {
  const Ledger& ledger = group_->ledger[row];
  if (!bounces() || !flies(row)) return -1;
  if (group_->velocity[row].struck > 0) return double(impact_time_[row]);
  return ledger.bounced && !ledger.several ? double(ledger.bounce_time) : -1;
}

}  // namespace skerry::solver
