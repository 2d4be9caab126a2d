// Continuous collision: fast bodies stop where they first meet something in the step.
//
//   Who      Fast bodies (core/fast_bodies.h) against everything they may touch; the
//            other body's motion counts too. Pairs come from the broadphase, whose fat boxes hold
//            the whole step, and from the tree for bodies that were thrown out of theirs by an
//            impact in this very step.
//   What     A meeting counts if it would go deeper than a slide or a graze: the shape, made
//            smaller by a few millimetres at most, meets the other one. The body stops where the
//            shape itself first touched.
//   Order    Meetings are taken by time, then by ids. A body that stopped is from then on an
//            obstacle that stands still.
//   Threads  the sweeps of pairs run side by side; stages that run once share their work out in
//            blocks. The order of meetings is gone through by one thread.
#pragma once

#include <memory>

#include "core/step_context.h"

namespace skerry::collision {

using core::IndexRange;
using core::StepContext;
using core::Task;

class ContinuousScratch;
struct ContinuousScratchDeleter {
  void operator()(ContinuousScratch* scratch) const;
};
using ContinuousScratchPtr = std::unique_ptr<ContinuousScratch, ContinuousScratchDeleter>;
ContinuousScratchPtr make_continuous_scratch(std::uint32_t workers);

// Whether two would meet in this step if both went on as they now move; as in sweep_fast, a slide or a
// graze is no meeting. For the narrowphase; `triangles`: scratch.
bool will_meet(const StepContext& step, const core::ContactPair& pair,
               std::vector<std::uint32_t>& triangles);

// Stage "find_fast", once: FastBodies::bodies and pairs.
void find_fast(const StepContext& step, IndexRange, Task& task);

// Stage "sweep_fast", per fast pair: when the two would first meet.
void sweep_fast(const StepContext& step, IndexRange pairs, Task& task);

// Who stops when: FastBodies::part and stopped. Once, after the sweeps.
void order_impacts(const StepContext& step, Task& task);

}  // namespace skerry::collision
