#include "pipeline/snapshots.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"

namespace skerry {
namespace {

// Normalised linear interpolation along the shorter arc; between two steps a body turns so little
// that its error against slerp is below 1e-4 of the turn.
Quat blend(const Quat& a, const Quat& b, double t) {
  const double sign = a.dot(b) < 0 ? -1 : 1;
  return Quat(a.w() * (1 - t) + sign * t * b.w(), a.x() * (1 - t) + sign * t * b.x(),
              a.y() * (1 - t) + sign * t * b.y(), a.z() * (1 - t) + sign * t * b.z())
      .normalized();
}

const Pose* find_pose(const SnapshotFrame& frame, BodyId body) {
  const auto at = std::lower_bound(frame.bodies.begin(), frame.bodies.end(), body,
                                   [](BodyId x, BodyId y) { return x.index < y.index; });
  if (at == frame.bodies.end() || *at != body) return nullptr;
  return &frame.poses[static_cast<std::size_t>(at - frame.bodies.begin())];
}

}  // namespace

Snapshot::Snapshot(std::shared_ptr<const SnapshotFrame> previous,
                   std::shared_ptr<const SnapshotFrame> current, double alpha, double age)
    : previous_(std::move(previous)), current_(std::move(current)), alpha_(alpha), age_(age) {}

double Snapshot::time() const {
  if (!current_) return 0;
  if (!previous_) return current_->time;
  return previous_->time + alpha_ * (current_->time - previous_->time);
}

std::span<const BodyId> Snapshot::bodies() const {
  if (!current_) return {};
  return current_->bodies;
}

Pose Snapshot::pose(std::size_t row) const {
  const Pose& now = current_->poses[row];
  if (!previous_ || alpha_ >= 1) return now;
  const BodyId body = current_->bodies[row];
  const bool same_row = row < previous_->bodies.size() && previous_->bodies[row] == body;
  const Pose* before = same_row ? &previous_->poses[row] : find_pose(*previous_, body);
  if (!before) return now;  // came with the newest step
  return {before->position + alpha_ * (now.position - before->position),
          blend(before->orientation, now.orientation, alpha_)};
}

std::optional<Pose> Snapshot::find(BodyId body) const {
  if (!current_) return std::nullopt;
  const Pose* found = find_pose(*current_, body);
  if (!found) return std::nullopt;
  return pose(static_cast<std::size_t>(found - current_->poses.data()));
}

namespace pipeline {

// The allocator of a shared_ptr's reference count: it lies in the frame itself, and once it is gone,
// after the last reader, the frame is free.
template <class Count>
class SnapshotBuffer::CountInFrame {
 public:
  using value_type = Count;
  CountInFrame(std::shared_ptr<Pool> pool, PooledFrame* frame)
      : pool_(std::move(pool)), frame_(frame) {}
  template <class Other>
  CountInFrame(const CountInFrame<Other>& other) : pool_(other.pool_), frame_(other.frame_) {}

  Count* allocate(std::size_t) {
    static_assert(sizeof(Count) <= PooledFrame::kCountSize);
    return reinterpret_cast<Count*>(frame_->count.data());
  }
  void deallocate(Count*, std::size_t) { pool_->give(std::unique_ptr<PooledFrame>(frame_)); }
  template <class Other>
  bool operator==(const CountInFrame<Other>& other) const {
    return frame_ == other.frame_;
  }

 private:
  template <class Other>
  friend class CountInFrame;
  std::shared_ptr<Pool> pool_;
  PooledFrame* frame_;
};

std::unique_ptr<SnapshotBuffer::PooledFrame> SnapshotBuffer::Pool::take() {
  const std::lock_guard lock(mutex);
  if (frames.empty()) return std::make_unique<PooledFrame>();
  std::unique_ptr<PooledFrame> frame = std::move(frames.back());
  frames.pop_back();
  return frame;
}

void SnapshotBuffer::Pool::give(std::unique_ptr<PooledFrame> frame) {
  const std::lock_guard lock(mutex);
  frames.push_back(std::move(frame));
}

void SnapshotBuffer::publish(std::uint64_t step, double time, const std::vector<BodyId>& bodies,
                             const std::vector<Pose>& poses) {
  if (!wanted_.load(std::memory_order_relaxed)) return;
  std::unique_ptr<PooledFrame> frame = pool_->take();
  frame->step = step;
  frame->time = time;
  frame->bodies = bodies;
  frame->poses = poses;
  frame->published_ns = core::now_ns();
  PooledFrame* const kept = frame.release();  // by the count, which gives it back
  std::shared_ptr<const SnapshotFrame> shared(
      kept, [](const SnapshotFrame*) {}, CountInFrame<std::byte>(pool_, kept));
  const std::lock_guard lock(mutex_);
  previous_.swap(current_);
  current_.swap(shared);
}

bool SnapshotBuffer::empty() const {
  const std::lock_guard lock(mutex_);
  return current_ == nullptr;
}

Snapshot SnapshotBuffer::latest(SnapshotView view, double dt, std::int64_t epoch_ns) const {
  std::shared_ptr<const SnapshotFrame> previous, current;
  {
    const std::lock_guard lock(mutex_);
    previous = previous_;
    current = current_;
  }
  if (!current) return {};
  const std::int64_t now = core::now_ns();
  const double since =
      1e-9 * static_cast<double>(epoch_ns >= 0 ? now - epoch_ns - std::llround(current->time * 1e9)
                                               : now - current->published_ns);
  if (view == SnapshotView::newest || !previous) return {nullptr, current, 1, since};
  // One step behind, so that there are two states to blend.
  const double alpha = std::clamp(since / dt, 0.0, 1.0);
  return {previous, current, alpha, since + (1 - alpha) * dt};
}

}  // namespace pipeline
}  // namespace skerry
