// What the weights of bodies decide before a group is solved, island by island: how many passes its
// contacts take where heavy bodies rest on light ones, and which contacts begin with the loads of statics.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/group_data.h"
#include "solver/standing_loads.h"

namespace skerry::solver {

inline constexpr double kHeavyOnLight = 4;  // mass ratio from which a contact counts

// Loads of statics are shared anew in an island whose bodies all move slower than kImpactSpeed while some
// contact has pressed for so long since they were.
inline constexpr float kRestTime = 0.25f;  // s

inline bool is_unsettled(const core::Manifold& manifold) {
  return !manifold.settled && manifold.pressed_time >= kRestTime;
}

class IslandLoads {
 public:
  // Sets GroupContact::effort. The group must outlive this.
  void set_efforts(GroupData& group);
  std::uint32_t efforts() const { return efforts_; }  // one more than the highest of the group
  // [islands of the group]: joints do not answer contacts
  std::span<const std::uint8_t> yields() const { return yields_; }

  // What was put on each other in this step begins with the loads of statics, and what has come to rest
  // goes on with them, joints aside.
  void share();

 private:
  double heavy_on_light(std::uint32_t begin, std::uint32_t end) const;
  static std::uint8_t effort_of(double ratio, std::uint32_t contacts);
  void share(const core::Island& island, std::uint32_t begin);
  bool is_plain(const core::Island& island, std::uint32_t begin) const;
  bool is_reloaded(const core::Island& island) const;
  bool is_slow(const core::Island& island) const;
  void add_bodies(const core::Island& island);
  void add_support(std::uint32_t contact);

  GroupData* group_ = nullptr;
  std::uint32_t efforts_ = 1;
  std::vector<std::uint8_t> yields_;
  StandingLoads standing_loads_;
};

}  // namespace skerry::solver
