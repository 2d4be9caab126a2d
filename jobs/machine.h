// What this process may use of the machine: cores, affinity, cgroup CPU quota.
#pragma once

#include <sched.h>

#include <filesystem>
#include <span>
#include <vector>

namespace skerry::jobs {

// Processors that the calling thread may run on, ascending; as they were before any pin of ours.
// At least one entry.
std::vector<int> allowed_processors();

// How many of these processors are different physical cores (at least 1), from
// <sysfs>/devices/system/cpu. Where that says nothing, each processor is a core.
int physical_cores(const std::vector<int>& processors, const std::filesystem::path& sysfs = "/sys");

// The smallest CPU quota of the process's cgroup and those above it, in processors rounded up, or 0
// if there is none. Knows cgroup v2 (cpu.max) and v1 (cpu.cfs_quota_us); `root` replaces "/".
int cgroup_processor_quota(const std::filesystem::path& root = "/");

// Pins the calling thread to one processor for as long as the scope lives, then gives it back the
// affinity it had: three system calls. A thread that runs there already is left as it is. Scopes nest.
class PinScope {
 public:
  explicit PinScope(int processor);  // -1: pins nothing
  ~PinScope();
  PinScope(const PinScope&) = delete;
  PinScope& operator=(const PinScope&) = delete;

 private:
  friend std::vector<int> allowed_processors();
  bool pinned_ = false;
  bool outermost_ = false;
  cpu_set_t before_ = {};
};

// Pins the calling thread, which we do not own, until the next call: no system call if it is there
// already. -1: wherever `allowed` permits, if a pin of ours is to be undone.
void settle_thread(int processor, std::span<const int> allowed);

// The affinity of a thread of ours, right after it began. A thread inherits the mask of the one
// that starts it, which may be pinned.
void set_affinity(std::span<const int> processors);

}  // namespace skerry::jobs
