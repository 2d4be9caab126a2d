#include "jobs/machine.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <utility>

#include <skerry/jobs/executor.h>

namespace skerry::jobs {
namespace {

namespace fs = std::filesystem;

// The outermost pin on this thread: what it was allowed before.
thread_local const cpu_set_t* t_before_pins = nullptr;
// Where settle_thread put this thread.
thread_local int t_settled_on = -1;

template <class Value>
std::optional<Value> read_value(const fs::path& file) {
  std::ifstream input(file);
  Value value;
  if (!(input >> value)) return std::nullopt;
  return value;
}

// Quota over period, for example 1.5 processors; nothing if unlimited or unknown.
std::optional<double> quota_v2(const fs::path& cgroup) {
  std::ifstream input(cgroup / "cpu.max");
  double quota = 0, period = 0;
  if (!(input >> quota >> period) || period <= 0) return std::nullopt;  // "max 100000"
  return quota / period;
}

std::optional<double> quota_v1(const fs::path& cgroup) {
  const auto quota = read_value<double>(cgroup / "cpu.cfs_quota_us");
  const auto period = read_value<double>(cgroup / "cpu.cfs_period_us");
  if (!quota || !period || *quota <= 0 || *period <= 0) return std::nullopt;
  return *quota / *period;
}

// The smallest quota from the process's group up to the mount point. Inside a container the path
// may name a group that only the host sees; the mount point is then the container's own group.
template <class Quota>
double smallest_quota(const fs::path& mount, const std::string& group, Quota quota) {
  double smallest = std::numeric_limits<double>::infinity();
  for (fs::path relative = fs::path(group).relative_path();; relative = relative.parent_path()) {
    if (const auto found = quota(mount / relative)) smallest = std::min(smallest, *found);
    if (relative.empty()) return smallest;
  }
}

bool has_controller(const std::string& controllers, const std::string& name) {
  return ("," + controllers + ",").find("," + name + ",") != std::string::npos;
}

cpu_set_t to_set(std::span<const int> processors) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int processor : processors) CPU_SET(processor, &set);
  return set;
}

}  // namespace

std::vector<int> allowed_processors() {
  std::vector<int> processors;
  cpu_set_t set;
  CPU_ZERO(&set);
  if (t_before_pins) {
    set = *t_before_pins;
  } else if (sched_getaffinity(0, sizeof(set), &set) != 0) {
    // More than 1024 processors do not fit the set: go by their number.
    for (unsigned i = 0; i < std::thread::hardware_concurrency(); ++i) {
      processors.push_back(static_cast<int>(i));
    }
  }
  for (int i = 0; i < CPU_SETSIZE; ++i) {
    if (CPU_ISSET(i, &set)) processors.push_back(i);
  }
  if (processors.empty()) processors.push_back(0);
  return processors;
}

int physical_cores(const std::vector<int>& processors, const fs::path& sysfs) {
  std::set<std::pair<int, int>> cores;  // package, core
  int unknown = 0;
  for (const int processor : processors) {
    const fs::path topology =
        sysfs / "devices/system/cpu" / ("cpu" + std::to_string(processor)) / "topology";
    const auto core = read_value<int>(topology / "core_id");
    const auto package = read_value<int>(topology / "physical_package_id");
    if (core && package) {
      cores.emplace(*package, *core);
    } else {
      ++unknown;
    }
  }
  return std::max(1, static_cast<int>(cores.size()) + unknown);
}

int cgroup_processor_quota(const fs::path& root) {
  double smallest = std::numeric_limits<double>::infinity();
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // "4:cpu,cpuacct:/group", v2: "0::/group"
    const auto first = line.find(':');
    const auto second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    const fs::path mounts = root / "sys/fs/cgroup";
    if (controllers.empty()) {
      smallest = std::min(smallest, smallest_quota(mounts, group, quota_v2));
      smallest = std::min(smallest, smallest_quota(mounts / "unified", group, quota_v2));
    } else if (has_controller(controllers, "cpu")) {
      smallest = std::min(smallest, smallest_quota(mounts / "cpu", group, quota_v1));
      smallest = std::min(smallest, smallest_quota(mounts / controllers, group, quota_v1));
    }
  }
  return std::isinf(smallest) ? 0 : std::max(1, static_cast<int>(std::ceil(smallest)));
}

int automatic_worker_count() {
  const int cores = physical_cores(allowed_processors());
  const int quota = cgroup_processor_quota();
  return quota > 0 ? std::min(cores, quota) : cores;
}

PinScope::PinScope(int processor) {
  // A thread that runs there already stays, by and large; moving the mask to and fro costs 3 us.
  if (processor < 0 || sched_getcpu() == processor) return;
  if (sched_getaffinity(0, sizeof(before_), &before_) != 0) return;
  const cpu_set_t one = to_set({&processor, 1});
  if (sched_setaffinity(0, sizeof(one), &one) != 0) return;
  pinned_ = true;
  if (!t_before_pins) {
    t_before_pins = &before_;
    outermost_ = true;
  }
}

PinScope::~PinScope() {
  if (!pinned_) return;
  sched_setaffinity(0, sizeof(before_), &before_);
  if (outermost_) t_before_pins = nullptr;
}

void settle_thread(int processor, std::span<const int> allowed) {
  if (t_settled_on == processor) return;
  set_affinity(processor < 0 ? allowed : std::span<const int>(&processor, 1));
  t_settled_on = processor;
}

void set_affinity(std::span<const int> processors) {
  const cpu_set_t set = to_set(processors);
  sched_setaffinity(0, sizeof(set), &set);  // a hint: where it is refused, threads run anywhere
}

}  // namespace skerry::jobs
