// An executor on a GraphRun and a source of helpers: job system, host pool and own threads.
#pragma once

#include <memory>
#include <vector>

#include <skerry/jobs/executor.h>

#include "jobs/graph_run.h"
#include "jobs/machine.h"
#include "jobs/run_state.h"

namespace skerry::jobs {

// Helpers with what an executor needs beyond inviting them.
class Helpers : public HelperSource {
 public:
  // The run is over; called on the caller's thread before end() returns. Time here is blocked time.
  virtual void end_run() {}
  // Whether early wakes make sense.
  virtual bool can_wake() const { return true; }
};

// `affinity` and `processors` are for the caller; helpers pin themselves.
std::unique_ptr<Executor> make_ticket_executor(std::shared_ptr<GraphRun> run,
                                               std::unique_ptr<Helpers> helpers, Affinity affinity,
                                               std::vector<int> processors);

// The sources. `processors`: where helper i is to run ([i % size]); empty: anywhere.
std::unique_ptr<Helpers> make_thread_helpers(GraphRun& run, const ExecutorSettings& settings,
                                             const std::vector<int>& processors);
std::unique_ptr<Helpers> make_pool_helpers(GraphRun& run, TaskPool& pool);
std::unique_ptr<Helpers> make_tbb_helpers(const std::shared_ptr<GraphRun>& run,
                                          const ExecutorSettings& settings,
                                          const std::vector<int>& processors);

std::unique_ptr<Executor> make_tbb_fork_join_executor(std::uint32_t workers,
                                                      const ExecutorSettings& settings);

}  // namespace skerry::jobs
