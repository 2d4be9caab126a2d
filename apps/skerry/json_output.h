// Result files: docs/cli.md lists their keys.
#pragma once

#include <skerry/snapshot.h>
#include <skerry/world.h>

#include "apps/measure/scene_run.h"
#include "apps/report/results.h"

namespace skerry::app {

using report::Json;

struct RunIdentity {
  std::string scene;
  ThreadingMode mode = ThreadingMode::serial;
  int workers = 1;
  SolverKind solver = SolverKind::soft_step_tgs;
  int substeps = 0;
  double dt = 0;
  std::uint64_t warmup = 0, seed = 0;
  bool sleep = true;
};
Json to_json(const RunIdentity& identity, const measure::RunResult& result);

// The trace event format that chrome://tracing and Perfetto read.
Json to_trace(const RunIdentity& identity, const measure::RunResult& result);

}  // namespace skerry::app
