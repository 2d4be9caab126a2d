// Islands on which nothing but contacts acts keep what such islands keep: their momentum as it is, their
// angular momentum, and no more energy than they had (docs/decisions/0025). Impulses that act over a step
// refer to where their bodies were at its start, and impacts that follow each other within it to one time,
// so that both come out a little wrong. Once all impulses are known they are put right.
#pragma once

#include <cstdint>
#include <vector>

#include "solver/group_data.h"
#include "solver/impacts.h"
#include "solver/moment_shift.h"

namespace skerry::solver {

class Balance {
 public:
  // The group and its impacts must outlive this.
  void begin(GroupData& group, const Impacts& impacts);
  // Whether there may be such islands.
  bool acts() const { return acts_; }
  // Whether bodies are where their substeps brought them, all of them.
  bool is_idle() const { return !acts_ && !impacts_->bounces(); }

  // After contacts are booked: impulses that would give energy to an island are lessened together.
  void lessen();
  // After bodies have flown and been parted: all that contacts moved are shifted by little, so that the
  // moment of their momenta is what it was.
  void settle();

  // m: how far the body is moved from where its impulses bring it.
  Vec3 shift(std::uint32_t row) const;
  // s: as Impacts::time_of_impact, for the body's turning.
  double time_of_turn(std::uint32_t row) const;

 private:
  enum class Kind : std::uint8_t { acted_on, grounded, isolated };
  struct Energy {
    double before = 0, gained = 0;  // J
    double square = 0;              // J, of the impulses alone
  };
  Kind kind_of(std::uint32_t island, std::uint32_t row, std::uint32_t contact) const;
  bool is_free(std::uint32_t row) const;
  double lessen(std::uint32_t begin, std::uint32_t end);
  Energy energy_of(std::uint32_t begin, std::uint32_t end) const;
  Quat orientation_after_step(std::uint32_t row) const;
  bool by_substeps(std::uint32_t row) const;
  bool turns_far(std::uint32_t row) const;
  double mean_time(std::uint32_t row) const;
  void settle(std::uint32_t begin, std::uint32_t end, double spare);
  bool shift_back();
  void turn_back(double spare);
  bool flies_so_far(std::uint32_t row) const;
  Vec3 moment_change() const;
  Vec3 way(std::uint32_t row) const;
  Vec3 velocity_after(std::uint32_t row) const;

  GroupData* group_ = nullptr;
  const Impacts* impacts_ = nullptr;
  bool acts_ = false;
  std::vector<Kind> kind_;         // [islands]
  std::vector<double> spare_;      // [islands] J, that contacts took
  std::vector<Vec3> shift_;        // [rows] m
  std::vector<double> turn_time_;  // [rows] s; negative: as Impacts has it
  std::vector<std::uint32_t> movers_, turners_;
  std::vector<Vec3> pushes_;  // N s, of the turners
  MomentShift moment_;
};

inline Vec3 Balance::shift(std::uint32_t row) const {
  if (acts_) return shift_[row];
  return impacts_->timed() ? impacts_->parted(row) : Vec3(Vec3::Zero());
}

}  // namespace skerry::solver
