// A scene in a world, advanced step by step in any threading mode.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include <skerry/skerry.h>

#include "apps/measure/strategy.h"
#include "scenes/scene.h"

namespace skerry::measure {

inline constexpr std::array kAllModes = {ThreadingMode::serial, ThreadingMode::dedicated_thread,
                                         ThreadingMode::dedicated_thread_jobs,
                                         ThreadingMode::fork_join, ThreadingMode::job_system};

bool is_dedicated(ThreadingMode mode);

class Session {
 public:
  Session(const scenes::SceneDesc& scene, const WorldSettings& settings, double dt);
  // On the strategy's scheduler.
  Session(const scenes::SceneDesc& scene, const WorldSettings& base, double dt,
          const Strategy& strategy);

  // The events of the next step, then that step: on the dedicated thread where the mode has one, on
  // the caller otherwise.
  StepReport advance();
  void advance_to(std::uint64_t step);  // no further than it is if it is there or beyond
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
  // The same for a part that goes from `begin` to `end` of this one's way.
  Watcher part(double begin, double end) const;
};

}  // namespace skerry::measure
