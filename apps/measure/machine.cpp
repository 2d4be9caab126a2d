#include "apps/measure/machine.h"

#include <sched.h>
#include <sys/utsname.h>
#include <fstream>
#include <thread>

#include "cmake/build_info/build_info.h"

namespace skerry::measure {
namespace {

std::string cpu_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

int allowed_cores() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return CPU_COUNT(&set);
  return static_cast<int>(std::thread::hardware_concurrency());
}

std::string simd_name() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return "avx512";
  if (__builtin_cpu_supports("avx2")) return "avx2";
  if (__builtin_cpu_supports("sse4.2")) return "sse4";
  return "sse2";
#elif defined(__aarch64__)
  return "neon";
#else
  return "none";
#endif
}

std::string system_name() {
  utsname name = {};
  if (uname(&name) != 0) return "unknown";
  std::string text = std::string(name.sysname) + " " + name.release;
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("flags")) continue;
    if (line.find(" hypervisor") != std::string::npos) text += ", virtual machine";
    break;
  }
  return text;
}

}  // namespace

Machine this_machine() {
  return {cpu_name(),         allowed_cores(),    simd_name(), system_name(), build_info::kCompiler,
          build_info::kFlags, build_info::kCommit};
}

}  // namespace skerry::measure
