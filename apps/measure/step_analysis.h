// What the tasks of a step say about its parallelism.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <skerry/world.h>

namespace skerry::measure {

// Work and critical path ("span") of a task graph: with any number of workers and no overhead a step
// cannot take less than the critical path, with p workers not less than work / p (Brent, JACM 21,
// 1974).
struct GraphBound {
  double work_ms = 0;
  double critical_ms = 0;
  // Largest speed-up that the graph allows on p workers.
  double speed_up(int workers) const;
};

// From a step that the serial executor ran (its tasks know what phase programs could gain). Stages
// are taken one after the other, those that follow per item item by item: an upper bound of the
// critical path.
GraphBound graph_bound(std::span<const StageTime> stages, std::span<const jobs::TaskRecord> tasks);

// Time in tasks by worker, ms; waits within a task count.
std::vector<double> busy_ms_by_worker(std::span<const jobs::TaskRecord> tasks, int workers);

// Of the busiest worker over the mean: 1 is even. 1 for no work.
double imbalance(const std::vector<double>& busy_ms);

}  // namespace skerry::measure
