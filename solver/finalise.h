// After the solve: flags, sleep timers; then who falls asleep.
#pragma once

#include "core/step_context.h"

namespace skerry::solver {

// Stage "finalise_bodies", per island group: kChanged flags, cleared forces, still_time of bodies
// and islands. Writes its own bodies and islands only.
void finalise_bodies(const core::StepContext& step, core::IndexRange groups, core::Task& task);

// Stage "sleep", once: islands still for longer than the setting fall asleep as a unit.
void update_sleep(const core::StepContext& step, core::IndexRange, core::Task& task);

// Wakes a body and its whole sleeping island; nothing if it is awake, fixed or kinematic. Resets
// their timers. Between steps, or in stages that run once.
void wake_island(core::Bodies& bodies, core::Sleepers& sleepers, core::BodyIndex body);

}  // namespace skerry::solver
