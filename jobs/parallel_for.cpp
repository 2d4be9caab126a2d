#include <skerry/jobs/parallel_for.h>

#include <algorithm>
#include <stdexcept>

namespace skerry::jobs {
namespace {

constexpr Domain kChunks = 1;

struct Loop {
  Kernel kernel;
  void* context;
  std::uint32_t count;
  std::uint32_t chunk;
};

std::uint32_t chunk_count(void* context) {
  const Loop& loop = *static_cast<const Loop*>(context);
  return loop.count / loop.chunk + (loop.count % loop.chunk != 0);
}

void run_chunks(void* context, IndexRange chunks, Task& task) {
  const Loop& loop = *static_cast<const Loop*>(context);
  for (std::uint32_t i = chunks.begin; i < chunks.end; ++i) {
    const std::uint32_t first = i * loop.chunk;
    loop.kernel(loop.context, {first, first + std::min(loop.chunk, loop.count - first)}, task);
  }
}

// One graph for every loop, its items the chunks: a loop builds and allocates nothing.
const TaskGraph& loop_graph() {
  static const TaskGraph kGraph = [] {
    TaskGraph graph;
    graph.stage(
        {.name = "parallel_for", .domain = kChunks, .kernel = run_chunks, .count = chunk_count});
    return graph;
  }();
  return kGraph;
}

}  // namespace

void parallel_for(Executor& executor, std::uint32_t count, std::uint32_t chunk, Kernel kernel,
                  void* context, const char* name) {
  if (chunk == 0) throw std::invalid_argument("parallel_for: chunk is 0");
  if (!kernel) throw std::invalid_argument("parallel_for: kernel is null");
  if (count == 0) return;
  Loop loop{kernel, context, count, chunk};
  executor.run(loop_graph(), &loop, {.name = name});
}

}  // namespace skerry::jobs
