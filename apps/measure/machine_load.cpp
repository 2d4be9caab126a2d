#include "apps/measure/machine_load.h"

#include <unistd.h>
#include <algorithm>
#include <array>
#include <fstream>
#include <string>

#include "apps/measure/process_meter.h"

namespace skerry::measure {
namespace {

struct ProcessorTime {
  double busy_ms = 0, total_ms = 0;  // of all processors
};

ProcessorTime processor_time() {
  // cpu user nice system idle iowait irq softirq steal ...
  constexpr std::size_t kIdle = 3;
  constexpr std::size_t kWait = 4;
  std::ifstream stat("/proc/stat");
  std::string label;
  std::array<double, 8> ticks = {};
  stat >> label;
  for (double& value : ticks) stat >> value;
  if (!stat) return {};
  const double ms_per_tick = 1e3 / static_cast<double>(sysconf(_SC_CLK_TCK));
  ProcessorTime time;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    time.total_ms += ticks[i] * ms_per_tick;
    if (i != kIdle && i != kWait) time.busy_ms += ticks[i] * ms_per_tick;
  }
  return time;
}

}  // namespace

MachineLoad::MachineLoad() : own_before_ms_(cpu_ms()) {
  const ProcessorTime time = processor_time();
  busy_before_ms_ = time.busy_ms;
  total_before_ms_ = time.total_ms;
}

double MachineLoad::others_share() const {
  const ProcessorTime time = processor_time();
  const double total = time.total_ms - total_before_ms_;
  const double others = time.busy_ms - busy_before_ms_ - (cpu_ms() - own_before_ms_);
  return total > 0 ? std::clamp(others / total, 0.0, 1.0) : 0;
}

}  // namespace skerry::measure
