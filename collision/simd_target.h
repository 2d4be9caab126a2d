// Instruction sets by name, for tests that run each one.
#pragma once

#include <hwy/targets.h>
#include <cstdint>
#include <cstring>

namespace skerry::collision {

// Whether `target` is Highway's name of the instruction set `bit`, and this machine has it.
inline bool is_target_here(const char* target, std::int64_t bit) {
  return std::strcmp(hwy::TargetName(bit), target) == 0 && (hwy::SupportedTargets() & bit) != 0;
}

}  // namespace skerry::collision
