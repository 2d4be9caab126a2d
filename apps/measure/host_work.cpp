#include "apps/measure/host_work.h"

#include <algorithm>
#include <cmath>

#include "apps/measure/process_meter.h"

namespace skerry::measure {
namespace {

constexpr std::size_t kBlock = 32;  // objects: about a microsecond

}  // namespace

HostWork::HostWork(std::size_t bytes) : objects_(std::max(kBlock, bytes / sizeof(Object))) {
  objects_.resize(objects_.size() / kBlock * kBlock);
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    objects_[i] = {{double(i), 0, 0}, {1, 0.5, 0.25}, i * 2654435761u + 1, 0};
  }
}

std::size_t HostWork::all_blocks() const { return objects_.size() / kBlock; }

void HostWork::run_block(std::size_t block) {
  constexpr double kDt = 1.0 / 60;
  for (std::size_t i = block * kBlock; i < (block + 1) * kBlock; ++i) {
    Object& object = objects_[i];
    object.state = object.state * 6364136223846793005u + 1442695040888963407u;
    // A little thinking that depends on the object and cannot be skipped.
    const double wish = static_cast<double>(object.state >> 40) * (1.0 / 16777216.0) - 0.5;
    const double speed = std::sqrt(object.velocity[0] * object.velocity[0] + wish * wish + 1);
    for (int axis = 0; axis < 3; ++axis) {
      object.velocity[axis] += kDt * (wish - 0.1 * object.velocity[axis]) / speed;
      object.position[axis] += kDt * object.velocity[axis];
    }
    object.age += kDt;
  }
}

void HostWork::run_blocks(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    run_block(next_);
    next_ = (next_ + 1) % all_blocks();
  }
}

void HostWork::calibrate() {
  constexpr int kTrials = 10;
  constexpr std::size_t kBlocks = 4000;
  run_blocks(kBlocks);  // pages in, clock up
  double best_ms = 1e9;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::int64_t begin = now_ns();
    run_blocks(kBlocks);
    best_ms = std::min(best_ms, 1e-6 * static_cast<double>(now_ns() - begin));
  }
  blocks_per_ms_ = kBlocks / best_ms;
}

void HostWork::run(double ms) { run_blocks(block_count(ms)); }

// In rounds of at most one pass over the objects: two jobs never share one.
void HostWork::run_jobs(double ms, HostPool& pool) {
  const auto chunk = static_cast<std::uint32_t>(std::max(1.0, 0.05 * blocks_per_ms_));
  for (std::size_t left = block_count(ms); left > 0;) {
    const std::size_t count = std::min(left, all_blocks());
    const std::size_t first = next_;
    pool.parallel_for(static_cast<std::uint32_t>(count), chunk,
                      [this, first](std::uint32_t begin, std::uint32_t end) {
                        for (std::size_t i = begin; i < end; ++i) {
                          run_block((first + i) % all_blocks());
                        }
                      });
    next_ = (next_ + count) % all_blocks();
    left -= count;
  }
}

double HostWork::checksum() const {
  double sum = 0;
  for (const Object& object : objects_) sum += object.position[0] + object.age;
  return sum;
}

}  // namespace skerry::measure
