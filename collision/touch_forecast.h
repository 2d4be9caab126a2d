// Where two bodies that will bounce off each other in this step are when they touch. A contact found at
// the start of the step has the place and the normal of that time; by the touch its bodies have moved on,
// and an impulse along the old normal has a wrong lever by as much (docs/decisions/0025).
//
//   Frame    world axes; the origin is the centre of mass of body a at the time in question.
//   Threads  pure functions; pairs are independent.
#pragma once

#include <array>

#include "collision/narrowphase_pairs.h"

namespace skerry::collision {

// A body at some time of the step.
struct BodyAt {
  core::BodyPose pose;
  Vec3 linear, angular;  // m/s, rad/s
};
struct PairAt {
  BodyAt a, b;
};
// `time` s after the start of the step, if nothing but gravity acts meanwhile. Orientations to second
// order.
PairAt pair_at(const StepContext& step, const core::ContactPair& pair, float time);

// As pair_approach, pair_frame and placed_pair, of that time. No point counts as foreseen (Query::touch).
void pair_frame(const StepContext& step, const core::ContactPair& pair, const PairAt& at,
                float margin, PairFrame& frame);
PlacedPair placed_pair(const StepContext& step, const core::ContactPair& pair, const PairAt& at,
                       const PairFrame& frame);

// Whether impacts of a pair are foreseen at all: not those of meshes, nor of what does not bounce.
bool may_bounce(const StepContext& step, const core::ContactPair& pair);

// The contact of a pair that may bounce, as time goes on.
class TouchForecast {
 public:
  // `linear`, `angular`: see Query.
  TouchForecast(const StepContext& step, const core::ContactPair& pair, const V3f& linear,
                const V3f& angular);

  // Whether two bodies that are apart now will touch in this step, fast enough to bounce.
  bool expects(const PatchSet& patches) const;

  // Goes from one meeting to the next until the two touch, or pass each other, and puts their contact
  // of then in the place of `patches`, separations carried back to the start of the step; none, if they
  // are out of each other's reach. `collide` (const PairAt&, PatchSet&) finds it at a time. Returns the
  // time, s; 0, and nothing done, if it cannot be found. `gaps`: m, the separations of then.
  template <class Collide>
  float find(const Collide& collide, PatchSet& patches, std::array<float, 4>& gaps) {
    begin(patches.patch[0]);
    for (int round = 0; round < kRounds; ++round) {
      const float time = time_;
      const PairAt at = pair_at(step_, pair_, time);
      PatchSet then;
      collide(at, then);
      const bool apart = then.count == 0 || then.patch[0].count == 0;
      const bool there = apart || arrives(at, then.patch[0]);
      if (!there && (round + 1 < kRounds || !is_close(then.patch[0]))) continue;
      if (!apart) carry_back(at, then.patch[0], gaps);
      patches = then;
      return time;
    }
    return 0;
  }

 private:
  static constexpr int kRounds = 10;
  bool is_far() const;
  bool bends_to(const ContactPatch& patch, float slowest) const;
  // The point that touches first, and when.
  struct Meeting {
    float time, separation, speed;  // s from then; m; m/s of departure
  };
  Meeting meeting(const ContactPatch& patch, const V3f& linear, const V3f& angular) const;
  void begin(const ContactPatch& patch);
  bool arrives(const PairAt& at, const ContactPatch& patch);
  static bool is_close(const ContactPatch& patch);
  void carry_back(const PairAt& at, ContactPatch& patch, std::array<float, 4>& gaps) const;

  const StepContext& step_;
  const core::ContactPair& pair_;
  V3f linear_, angular_, acceleration_;
  float restitution_;
  float dt_, time_ = 0, before_ = 0;  // s; before_: they were apart
};

}  // namespace skerry::collision
