// Finds the fast bodies of a step while they are solved (core/fast_bodies.h).
#pragma once

#include "core/step_context.h"

namespace skerry::solver {

// A turn by more than this (rad) in a step is told by knots in between.
inline constexpr double kLargeTurn = 0.4;

// Remembers where a body starts. Constructed before its flight or solve, finished after; touches
// that body's data only.
class FastWatch {
 public:
  FastWatch(const core::StepContext& step, core::BodyIndex body);
  // Marks the body kFast or not, and if it is, notes its start and how it turned; of a slow one that
  // joints hold, its start. What contacts have sent spinning so fast that substeps could not follow
  // (kLargeTurn) turns on from its start with the angular momentum that they gave it.
  // `impact`: s after the start of the step, when all that contacts gave was given; negative: over the
  // step.
  void finish(core::FastFlight flight, double impact = -1);

 private:
  bool is_fast() const;
  void note_turn(core::FastStart& start, double impact) const;

  const core::StepContext& step_;
  core::BodyIndex body_;
  bool watched_;
  bool joined_;  // may have to stop with what joints hold to it
  core::BodyPose pose_;
  core::BodyMotion motion_;
};

// The orientation of a pushed body `time` s after the start of the step, if external torques are small.
Quat pushed_orientation(const core::StepContext& step, core::BodyIndex body,
                        const core::FastStart& start, double time);

}  // namespace skerry::solver
