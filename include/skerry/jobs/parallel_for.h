// A parallel loop on any executor.
#pragma once

#include <cstdint>
#include <type_traits>

#include <skerry/jobs/executor.h>

namespace skerry::jobs {

// Calls body(IndexRange, Task&) for chunks that cover [0, count) exactly once each. Chunk bounds
// depend on count and chunk only, never on the executor. Exceptions reach the caller.
void parallel_for(Executor& executor, std::uint32_t count, std::uint32_t chunk, Kernel kernel,
                  void* context, const char* name = "parallel_for");

template <class Body>
void parallel_for(Executor& executor, std::uint32_t count, std::uint32_t chunk, Body&& body,
                  const char* name = "parallel_for") {
  using Function = std::remove_reference_t<Body>;
  parallel_for(
      executor, count, chunk,
      [](void* context, IndexRange items, Task& task) {
        (*static_cast<Function*>(context))(items, task);
      },
      const_cast<void*>(static_cast<const void*>(&body)), name);
}

}  // namespace skerry::jobs
