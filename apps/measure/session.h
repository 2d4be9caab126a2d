// A scene in a world, advanced step by step in any threading mode.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include <skerry/skerry.h>

#include "scenes/scene.h"

namespace skerry::measure {

inline constexpr std::array kAllModes = {ThreadingMode::serial, ThreadingMode::dedicated_thread,
                                         ThreadingMode::dedicated_thread_jobs,
                                         ThreadingMode::fork_join, ThreadingMode::job_system};

bool is_dedicated(ThreadingMode mode);

// Threads that run the step: 1 in the modes that have no workers, else the number asked for, or the
// automatic one for 0.
int effective_workers(ThreadingMode mode, int workers);

class Session {
 public:
  Session(const scenes::SceneDesc& scene, const WorldSettings& settings, double dt);

  // The events of the next step, then that step: on the dedicated thread where the mode has one, on
  // the caller otherwise.
  StepReport advance();
  // `advance` in two halves, with the caller free in between.
  PendingStep begin();
  StepReport end(PendingStep& pending) { return world_.end_step(pending); }

  World& world() { return world_; }
  double dt() const { return dt_; }

 private:
  void apply_events();

  const scenes::SceneDesc& scene_;
  World world_;
  scenes::BuiltScene built_;
  double dt_;
};

// How a long measurement talks to the one who waits for it. Both may be empty.
struct Watcher {
  std::function<bool()> stop;  // asked between steps; true: finish with what there is
  std::function<void(double share, const std::string& what)> progress;

  bool stopped() const { return stop && stop(); }
  void report(double share, const std::string& what) const {
    if (progress) progress(share, what);
  }
};

}  // namespace skerry::measure
