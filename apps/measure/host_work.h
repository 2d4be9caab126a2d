// Stands in for what a game does on its main thread: updating objects in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "apps/measure/host_load.h"

namespace skerry::measure {

// A fixed amount of work per millisecond asked for, not a fixed time: when the machine is busy or
// the caches are taken, it lasts longer, as a game's own work would.
class HostWork : public HostLoad {
 public:
  // The objects fill `bytes`: more than a core's L2, so that every pass goes to shared memory.
  explicit HostWork(std::size_t bytes = std::size_t{8} << 20);

  // Finds how much is done in a millisecond on an idle machine: the best of several trials. Takes
  // about 50 ms.
  void calibrate();

  // What took `ms` milliseconds at calibration.
  void run(double ms) override;
  // The same amount in jobs of some 50 us.
  void run_jobs(double ms, HostPool& pool) override;

  double blocks_per_ms() const { return blocks_per_ms_; }
  double checksum() const;  // of all that was done; also keeps the compiler honest

 private:
  struct Object {  // a cache line
    double position[3], velocity[3];
    std::uint64_t state;
    double age;
  };
  std::size_t block_count(double ms) const { return static_cast<std::size_t>(ms * blocks_per_ms_); }
  std::size_t all_blocks() const;
  void run_blocks(std::size_t count);
  void run_block(std::size_t block);

  std::vector<Object> objects_;
  std::size_t next_ = 0;  // block; the passes go round
  double blocks_per_ms_ = 0;
};

}  // namespace skerry::measure
