// The last two published steps, for readers on other threads.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <skerry/snapshot.h>

namespace skerry::pipeline {

// Threads: publish() from the simulating thread, everything else from any thread. Frames come back
// once no reader holds them, so a steady state copies into memory it already has and allocates none.
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
  // A frame with room for the reference count of the pointers to it.
  struct PooledFrame : SnapshotFrame {
    static constexpr std::size_t kCountSize = 128;
    alignas(std::max_align_t) std::array<std::byte, kCountSize> count;
  };
  // Frames nobody reads. Shared, for a reader may outlive the world.
  struct Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<PooledFrame>> frames;  // guarded
    std::unique_ptr<PooledFrame> take();
    void give(std::unique_ptr<PooledFrame> frame);
  };
  template <class Count>
  class CountInFrame;

  std::atomic<bool> wanted_ = false;
  std::shared_ptr<Pool> pool_ = std::make_shared<Pool>();
  mutable std::mutex mutex_;
  std::shared_ptr<const SnapshotFrame> previous_, current_;  // guarded
};

}  // namespace skerry::pipeline
