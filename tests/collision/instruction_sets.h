// Kernels on each instruction set that this machine has.
#pragma once

#include <hwy/targets.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace skerry::test {

// Calls check(name) once per instruction set; what it calls runs on that one. No other thread may
// call kernels meanwhile.
template <class Check>
void on_every_instruction_set(Check check) {
  static const std::int64_t here = hwy::SupportedTargets();
  static const std::vector<std::pair<std::int64_t, std::string>> sets = [] {
    std::vector<std::pair<std::int64_t, std::string>> all;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets())
      all.emplace_back(target, hwy::TargetName(target));
    return all;
  }();
  for (const auto& [target, name] : sets) {
    hwy::GetChosenTarget().Update(target);
    check(name);
  }
  hwy::GetChosenTarget().Update(here);
}

}  // namespace skerry::test
