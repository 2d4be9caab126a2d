// What scheduling costs when there is nothing to do.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/measure/compare.h"
#include "apps/measure/statistics.h"

namespace skerry::measure {

struct SchedulingCost {
  Strategy strategy;
  Summary empty_step_us;  // a step of a world with no bodies, as its caller sees it
  // A run of 12 stages of 64 chunks each, one after the other, whose kernels do nothing: on the
  // executor that runs the row's steps. None where that is another row's.
  std::optional<Summary> empty_tasks_us = std::nullopt;
};
inline constexpr int kEmptyStages = 12, kEmptyChunks = 64;

// Back to back, so warm; rows in turns.
std::vector<SchedulingCost> scheduling_costs(const CompareOptions& options);

}  // namespace skerry::measure
