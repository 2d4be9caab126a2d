// A game at 60 frames per second on the main thread, with the world stepped in any threading mode.
#pragma once

#include <cstdint>
#include <vector>

#include "apps/measure/host_work.h"
#include "apps/measure/session.h"

namespace skerry::measure {

struct FrameOptions {
  double host_ms = 0;  // the game's own work on the main thread, per frame
  std::uint64_t frames = 120;
  double wake_ahead_ms = 0.3;  // workers are woken so long before a step is wanted
  double max_seconds = 10;     // give up a loop that cannot keep up
};

// [frame] each, and sums over the loop.
struct FrameSamples {
  std::vector<double> latency_ms;    // from the instant the frame was due to its end
  std::vector<double> state_age_ms;  // of what the frame shows, at its end
  std::vector<double> blocked_ms;    // the main thread waited for physics with nothing to do
  std::vector<double> helped_ms;     // the main thread ran physics
  double cpu_ms = 0;                 // of the process
  std::uint64_t missed = 0;          // frames that ended after the next one was due
  std::uint64_t dropped_steps = 0;   // by the dedicated thread

  std::size_t frames() const { return latency_ms.size(); }
  void append(const FrameSamples& other);
};

// Frames are due at fixed times, one per step of the session's dt, whatever the loop does: a late
// frame makes the next ones late, and none is left out. In each frame:
//   serial, fork_join      host work, step, show
//   job_system             begin the step, host work, end the step, show
//   dedicated_thread...    host work, take the interpolated snapshot, show
// Showing reads every body's pose. The state of a frame's step stands for the instant the frame was
// due, so where the caller steps its age is the frame's latency.
FrameSamples run_frames(Session& session, HostWork& host, const FrameOptions& options,
                        const Watcher& watcher = {});

}  // namespace skerry::measure
