// What changed since an earlier results.json.
#pragma once

#include <string>
#include <vector>

#include "apps/report/results.h"

namespace skerry::report {

struct Change {
  std::string what;  // "islands, job_system, 4 ms of host work: frame time p95"
  double before = 0, now = 0;
  bool worse = false;
};

struct BaselineComparison {
  bool same_machine = true;  // else only figures relative to serial are compared
  int compared = 0;          // figures that both have
  std::vector<Change> changes;
  bool regressed() const;
};

// A change is one beyond noise: the 95 % intervals do not overlap and the figures differ by more than
// `tolerance` (a share). Rows match by scene, label and host load. Compared are the median step and
// the speed-up of every row, and of frames the 95th percentiles of frame time and of input to
// visible, and whether the rate is held. Throws
// std::invalid_argument if `before` is not a results.json of this
// version.
BaselineComparison compare_with_baseline(const Json& before, const Json& now, double tolerance);

}  // namespace skerry::report
