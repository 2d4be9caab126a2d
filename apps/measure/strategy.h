// One row of a comparison: a way to thread the same step.
#pragma once

#include <string>
#include <vector>

#include <skerry/settings.h>

#include "apps/schedulers/other_scheduler.h"

namespace skerry::measure {

// Threads that run the step: 1 in the modes that have no workers, else the number asked for, or the
// automatic one for 0.
int effective_workers(ThreadingMode mode, int workers);

struct Strategy {
  ThreadingMode mode = ThreadingMode::serial;
  int workers = 1;  // that run the step, the caller included; resolved
  WaitPolicy wait = {};
  Affinity affinity = Affinity::spread;  // with none the kernel's choice of core decides
  double wake_ahead_ms = 0.3;            // workers are woken so long before a step is wanted
  schedulers::OtherScheduler scheduler = schedulers::OtherScheduler::none;
  std::string label;  // unique within a comparison

  WorldSettings settings(WorldSettings base) const;
};

// What may vary between the rows of a comparison. Every combination that makes a difference to a
// mode is a row of it.
struct Axes {
  std::vector<int> workers = {0};  // 0: automatic
  std::vector<double> spin_us = {WaitPolicy{}.spin_us};
  std::vector<Affinity> affinity = {Affinity::spread};
  std::vector<double> wake_ahead_ms = {0.3};
};

// All modes, serial first. Labels name what differs, for example "job_system, 2 workers, spin 0 us".
std::vector<Strategy> strategies(const Axes& axes);

// The same step on other schedulers, for the throughput part.
std::vector<Strategy> other_schedulers(const Axes& axes);

// fork_join and job_system as they are in `axes`, and with one thing changed at a time: no
// affinity, no spinning, long spinning, no early wake. Of lists in `axes` the first value.
std::vector<Strategy> one_at_a_time(const Axes& axes);

}  // namespace skerry::measure
