// After the solve: flags, sleep timers; then who falls asleep.
#pragma once

#include <span>

#include "core/step_context.h"

namespace skerry::solver {

// Stage "finalise_bodies", per island group: kChanged (of awake bodies; it says nothing about
// others), cleared forces, still_time of bodies and islands. A body that is not allowed to sleep is
// never still; nor is one in free flight that moves without damping, or while an external force acts on
// it, so that nothing hangs in the air at the top of its path. Writes its own bodies and islands only.
void finalise_bodies(const core::StepContext& step, core::IndexRange groups, core::Task& task);

// Stage "sleep", once: islands still for longer than the setting fall asleep as a unit, and so do
// free bodies, each its own island; not those that touch or are joined to a moving kinematic body, nor
// those that gather speed, nor those that drift and touch nothing that holds them.
// Puts quarantined bodies to rest for good and names them in step.warnings.
void update_sleep(const core::StepContext& step, core::IndexRange, core::Task& task);

// Puts these dynamic bodies to sleep as one island, which stops them. Once, as above, or between
// steps.
void put_to_sleep(core::Bodies& bodies, core::Sleepers& sleepers,
                  std::span<const core::BodyIndex> island);

// Wakes a body and its whole sleeping island; nothing if it is awake, fixed, kinematic or
// quarantined. Resets their timers. Between steps, or in stages that run once.
void wake_island(core::Bodies& bodies, core::Sleepers& sleepers, core::BodyIndex body);

}  // namespace skerry::solver
