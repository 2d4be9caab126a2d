// A game at 60 frames per second on the main thread, with the world stepped in any threading mode.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/measure/host_load.h"
#include "apps/measure/session.h"

namespace skerry::measure {

struct FrameOptions {
  double host_ms = 0;  // the game's own work per frame
  HostShape host_shape = HostShape::serial;
  std::uint64_t frames = 120;  // that count
  std::uint64_t warmup = 0;    // frames before them
  double wake_ahead_ms = 0.3;  // workers are woken so long before a step is wanted; 0: not
  double max_seconds = 10;     // give up a loop that cannot keep up
  double phase = 0;           // of a frame: how far frames are due after a dedicated thread's steps
  bool keep_typical = false;  // fill FrameSamples::typical; needs WorldSettings::record_tasks
};

// What a thread did in a frame.
struct FrameSpan {
  enum class Kind : std::uint8_t { host, host_job, physics, wait, show };
  std::size_t track = 0;  // into FrameTimeline::tracks
  Kind kind = Kind::host;
  std::string name;
  double begin_ms = 0, end_ms = 0;  // since the frame was due
  std::uint32_t first_item = 0, item_count = 0;
};
const char* to_string(FrameSpan::Kind kind);

// One frame as it was, for pictures and traces. A `wait` span lies under the physics that the thread
// ran meanwhile.
struct FrameTimeline {
  double latency_ms = 0, period_ms = 0;
  std::vector<std::string> tracks;
  std::vector<FrameSpan> spans;
};

// [frame] each unless said otherwise, and sums over the loop.
struct FrameSamples {
  std::vector<double> latency_ms;    // from the instant the frame was due to its end
  std::vector<double> state_age_ms;  // of what the frame shows, at its end
  std::vector<double> blocked_ms;    // the main thread waited for physics with nothing to do
  std::vector<double> helped_ms;     // the main thread ran physics
  // Input that comes when a frame is due is posted when the frame begins; this is the time until the
  // end of the first frame that shows a step that began after that. Inputs that the loop did not
  // live to show are missing.
  std::vector<double> input_ms;
  std::vector<double> step_ms;  // [step] that began during the loop
  double cpu_ms = 0;            // of the process
  std::int64_t voluntary_switches = 0, involuntary_switches = 0;  // of the process
  std::uint64_t missed = 0;              // frames that ended after the next one was due
  std::uint64_t dropped_steps = 0;       // by the dedicated thread
  std::optional<FrameTimeline> typical;  // the frame of median latency

  std::size_t frames() const { return latency_ms.size(); }
};

class StepLog;  // step_log.h; its after_step() must be in the world's settings

// Frames are due at fixed times, one per step of the session's dt, whatever the loop does: a late
// frame makes the next ones late, and none is left out. In each frame:
//   serial, fork_join      host work, step, show
//   job_system             begin the step, host work, end the step, show
//   dedicated_thread...    host work, take the interpolated snapshot, show
// Showing reads every body's pose. The state of a frame's step stands for the instant the frame was
// due, so where the caller steps its age is the frame's latency.
FrameSamples run_frames(Session& session, StepLog& log, HostLoad& host, HostPool& pool,
                        const FrameOptions& options, const Watcher& watcher = {});

}  // namespace skerry::measure
