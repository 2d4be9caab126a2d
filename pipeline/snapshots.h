// The last two published steps, for readers on other threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <skerry/snapshot.h>

namespace skerry::pipeline {

// Threads: publish() from the simulating thread, everything else from any thread. Frames come back
// once no reader holds them, so a steady state copies into memory it already has.
class SnapshotBuffer {
 public:
  // Copies the state if anybody has asked for snapshots.
  void publish(std::uint64_t step, double time, const std::vector<BodyId>& bodies,
               const std::vector<Pose>& poses);
  // From now on steps are published. Returns true if they were not before.
  bool want() { return !wanted_.exchange(true); }
  // Whether anything has been published.
  bool empty() const;

  // The newest frame, or a view between the last two at the present moment. `epoch_ns` is the
  // moment of simulated time zero if simulated time runs with the clock (age counts from when the
  // state was due), negative otherwise (age counts from when it was published).
  Snapshot latest(SnapshotView view, double dt, std::int64_t epoch_ns) const;

 private:
  // Frames nobody reads. Shared, for a reader may outlive the world.
  struct Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<SnapshotFrame>> frames;  // guarded
    std::unique_ptr<SnapshotFrame> take();
    void give(std::unique_ptr<SnapshotFrame> frame);
  };

  std::atomic<bool> wanted_ = false;
  std::shared_ptr<Pool> pool_ = std::make_shared<Pool>();
  mutable std::mutex mutex_;
  std::shared_ptr<const SnapshotFrame> previous_, current_;  // guarded
};

}  // namespace skerry::pipeline
