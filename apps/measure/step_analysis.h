// What the tasks of a step say about its parallelism.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <skerry/world.h>

namespace skerry::measure {

// Work and critical path ("span") of the parts of a step that follow each other: with any number of
// workers and no overhead a part cannot take less than its critical path, with p workers not less
// than work / p (Brent, JACM 21, 1974).
struct GraphBound {
  struct Part {
    double work_ms = 0, critical_ms = 0;
  };
  std::vector<Part> parts;

  double work_ms() const;
  double critical_ms() const;
  // Least time of a step on p workers.
  double least_ms(int workers) const;
  // Largest speed-up that the graph allows on p workers; 1 if nothing is known.
  double speed_up(int workers) const;
  // Adds a part of the figures of another step of the same graph.
  void add(const GraphBound& other, double part);
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
