// A consistent picture of all bodies at one instant, for rendering while the next step runs.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry {

// The state of one published step. Immutable once published.
struct SnapshotFrame {
  std::uint64_t step = 0;
  double time = 0;                // s, simulated
  std::int64_t published_ns = 0;  // monotonic clock
  std::vector<BodyId> bodies;     // ascending index
  std::vector<Pose> poses;        // [bodies], of the body frames
};

enum class SnapshotView : std::uint8_t {
  newest,        // the last published step as it is
  interpolated,  // between the last two, where the clock stands now
};
inline constexpr SnapshotView newest = SnapshotView::newest;
inline constexpr SnapshotView interpolated = SnapshotView::interpolated;

// Cheap to copy; keeps its frames alive. Any thread.
class Snapshot {
 public:
  Snapshot() = default;
  Snapshot(std::shared_ptr<const SnapshotFrame> previous,
           std::shared_ptr<const SnapshotFrame> current, double alpha, double age);

  bool empty() const { return current_ == nullptr; }
  std::uint64_t step() const { return current_ ? current_->step : 0; }
  // Simulated time of this view, s.
  double time() const;
  // How long ago the state shown here was current, s of wall clock, when the snapshot was taken.
  double age() const { return age_; }
  std::span<const BodyId> bodies() const;
  // Pose of the i-th body.
  Pose pose(std::size_t row) const;
  // Pose of a body; nothing if it is not in this snapshot.
  std::optional<Pose> find(BodyId body) const;

 private:
  std::shared_ptr<const SnapshotFrame> previous_, current_;
  double alpha_ = 1;
  double age_ = 0;
};

}  // namespace skerry
