#include "apps/measure/strategy.h"

#include <cstdio>

#include "apps/measure/session.h"

namespace skerry::measure {
namespace {

std::string number(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

const char* to_string(Affinity affinity) {
  return affinity == Affinity::spread ? "spread" : "not pinned";
}

std::string wake_text(double ms) {
  return ms > 0 ? "woken " + number(ms) + " ms ahead" : "no early wake";
}

std::string spin_text(double us) { return us > 0 ? "spin " + number(us) + " us" : "no spinning"; }

bool has_workers(ThreadingMode mode) {
  return mode != ThreadingMode::serial && mode != ThreadingMode::dedicated_thread;
}

// A thread that steps when it is time is not woken by the frame.
bool is_woken(ThreadingMode mode) {
  return mode == ThreadingMode::fork_join || mode == ThreadingMode::job_system;
}

template <class Value>
std::vector<Value> if_it_matters(bool matters, const std::vector<Value>& values) {
  return matters ? values : std::vector<Value>{values.front()};
}

void add_rows(ThreadingMode mode, const Axes& axes, std::vector<Strategy>& rows) {
  const bool workers_matter = has_workers(mode);
  const bool wake_matters = is_woken(mode);
  for (const int workers : if_it_matters(workers_matter, axes.workers)) {
    for (const double spin_us : if_it_matters(workers_matter, axes.spin_us)) {
      for (const Affinity affinity : if_it_matters(workers_matter, axes.affinity)) {
        for (const double ahead_ms : if_it_matters(wake_matters, axes.wake_ahead_ms)) {
          Strategy row = {.mode = mode,
                          .workers = effective_workers(mode, workers),
                          .wait = {.spin_us = spin_us},
                          .affinity = affinity,
                          .wake_ahead_ms = ahead_ms};
          row.label = skerry::to_string(mode);
          if (workers_matter && axes.workers.size() > 1)
            row.label +=
                ", " + std::to_string(row.workers) + (row.workers == 1 ? " worker" : " workers");
          if (workers_matter && axes.spin_us.size() > 1) row.label += ", " + spin_text(spin_us);
          if (workers_matter && axes.affinity.size() > 1)
            row.label += std::string(", ") + to_string(affinity);
          if (wake_matters && axes.wake_ahead_ms.size() > 1)
            row.label += ", " + wake_text(ahead_ms);
          rows.push_back(row);
        }
      }
    }
  }
}

Strategy first_of(const Axes& axes, ThreadingMode mode) {
  Strategy row = {.mode = mode,
                  .workers = effective_workers(mode, axes.workers.front()),
                  .wait = {.spin_us = axes.spin_us.front()},
                  .affinity = axes.affinity.front(),
                  .wake_ahead_ms = axes.wake_ahead_ms.front()};
  row.label = skerry::to_string(mode);
  return row;
}

Strategy renamed(Strategy row, const std::string& difference) {
  row.label += ", " + difference;
  return row;
}

}  // namespace

int effective_workers(ThreadingMode mode, int workers) {
  if (!has_workers(mode)) return 1;
  return workers > 0 ? workers : jobs::automatic_worker_count();
}

WorldSettings Strategy::settings(WorldSettings base) const {
  base.mode = mode;
  base.workers = workers;
  base.wait = wait;
  base.affinity = affinity;
  return base;
}

std::vector<Strategy> strategies(const Axes& axes) {
  std::vector<Strategy> rows;
  for (const ThreadingMode mode : kAllModes) add_rows(mode, axes, rows);
  return rows;
}

std::vector<Strategy> other_schedulers(const Axes& axes) {
  std::vector<Strategy> rows;
  for (const schedulers::OtherScheduler other : schedulers::available()) {
    Strategy row = first_of(axes, ThreadingMode::fork_join);
    if (row.workers < 2) continue;
    row.scheduler = other;
    row.label = schedulers::to_string(other);
    rows.push_back(row);
  }
  return rows;
}

std::vector<Strategy> one_at_a_time(const Axes& axes) {
  std::vector<Strategy> rows;
  for (const ThreadingMode mode : {ThreadingMode::fork_join, ThreadingMode::job_system}) {
    const Strategy base = first_of(axes, mode);
    if (base.workers < 2) continue;
    rows.push_back(base);
    Strategy row = base;
    row.affinity = Affinity::none;
    rows.push_back(renamed(row, to_string(row.affinity)));
    for (const double spin_us : {0.0, 1000.0}) {
      row = base;
      row.wait.spin_us = spin_us;
      rows.push_back(renamed(row, spin_text(spin_us)));
    }
    row = base;
    row.wake_ahead_ms = 0;
    rows.push_back(renamed(row, wake_text(0)));
  }
  return rows;
}

}  // namespace skerry::measure
