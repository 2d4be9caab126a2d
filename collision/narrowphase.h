// Narrowphase: contact manifolds of the active pairs.
#pragma once

#include <cstdint>
#include <memory>

#include "core/step_context.h"

namespace skerry::collision {

using core::IndexRange;
using core::StepContext;
using core::Task;

// Per-worker buffers and counters of the narrowphase.
class NarrowphaseScratch;
struct NarrowphaseScratchDeleter {
  void operator()(NarrowphaseScratch* scratch) const;
};
using NarrowphaseScratchPtr = std::unique_ptr<NarrowphaseScratch, NarrowphaseScratchDeleter>;
NarrowphaseScratchPtr make_narrowphase_scratch(std::uint32_t workers);

// Stage "narrowphase", per active pair (rows of ContactTable::active). Fills the manifolds of its
// pairs at the bodies' present poses, down to a gap of kSpeculativeDistance + dt * closing speed,
// and carries impulses over from the last manifold by feature. Writes its own pairs and manifolds
// only.
//
//   Normals  unit, from body a to body b, whatever the shapes' order. Separation < 0 inside.
//   Points   halfway between the surfaces, relative to body a's centre; at most 4, deepest kept.
//   Errors   none leave: exceptions, NaN and absurd depths of the fallback are caught; the pair then
//            keeps no contact and is counted (fallback_failures).
void collide_pairs(const StepContext& step, IndexRange active_pairs, Task& task);

struct NarrowphaseCounts {
  std::uint32_t fallback_pairs = 0;     // through FCL
  std::uint32_t fallback_failures = 0;  // of those, without a usable answer
};
// Sums and clears the counters of all workers.
NarrowphaseCounts take_counts(NarrowphaseScratch& scratch);

}  // namespace skerry::collision
