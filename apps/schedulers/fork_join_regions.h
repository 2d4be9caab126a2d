// Textbook fork-join: every stage with several chunks is a parallel loop, and a barrier at its end.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <skerry/jobs.h>

namespace skerry::schedulers {

// What a threading library must bring: a parallel loop.
class Regions {
 public:
  using Body = std::function<void(std::uint32_t index, std::uint32_t worker)>;
  virtual ~Regions() = default;
  virtual std::uint32_t workers() const = 0;
  // body(i, worker) for i in [0, count), the caller as worker 0; returns when all are done. Not
  // called inside a loop. `body` does not throw.
  virtual void loop(std::uint32_t count, const Body& body) = 0;
};

std::unique_ptr<Regions> make_thread_regions(const jobs::ExecutorSettings& settings);
std::unique_ptr<Regions> make_openmp_regions(const jobs::ExecutorSettings& settings);  // or null

std::unique_ptr<jobs::Executor> make_fork_join(std::unique_ptr<Regions> regions,
                                               const jobs::ExecutorSettings& settings);
std::unique_ptr<jobs::Executor> make_flow_graph(const jobs::ExecutorSettings& settings);

}  // namespace skerry::schedulers
