// The hook through which a host's own thread pool runs our work. Three functions, nothing else.
#pragma once

namespace skerry::jobs {

// Contract. submit() may run the function at once on the caller, later, on any thread, or not before
// wait(); each submitted function is run exactly once and each handle is waited for exactly once.
// wait() returns when its function has returned, running it on the caller if it has not begun.
// worker_count() is the number of threads that may run functions at the same time, the caller not
// counted; 0 is fine. We finish whatever the pool does within this contract: the caller of a step
// does all the work itself if nobody else comes.
class TaskPool {
 public:
  using Function = void (*)(void* context);
  using Handle = void*;

  virtual ~TaskPool() = default;
  virtual Handle submit(Function function, void* context, const char* name) = 0;
  virtual void wait(Handle handle) = 0;
  virtual int worker_count() const = 0;
};

}  // namespace skerry::jobs
