// Helpers on std::threads of our own, asleep on a condition variable while nobody invites them.
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>

#include "jobs/ticket_executor.h"

namespace skerry::jobs {
namespace {

class ThreadHelpers final : public Helpers {
 public:
  ThreadHelpers(GraphRun& run, const ExecutorSettings& settings, const std::vector<int>& processors)
      : run_(run) {
    threads_.reserve(run.workers() - 1);
    for (std::uint32_t i = 1; i < run.workers(); ++i) {
      const bool spread = settings.affinity == Affinity::spread;
      const std::vector<int> where =
          spread ? std::vector<int>{processors[i % processors.size()]} : processors;
      try {
        threads_.emplace_back([this, i, where] {
          set_affinity(where);
          serve(i);
        });
      } catch (const std::system_error&) {
        break;  // as many as the system lets us have; the caller does the rest
      }
    }
  }

  ~ThreadHelpers() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  std::uint32_t invite(std::uint32_t count, const char*) noexcept override {
    if (threads_.empty()) return 0;
    {
      const std::lock_guard lock(mutex_);
      invitations_ += count;
    }
    if (count == 1) {
      wake_.notify_one();
    } else {
      wake_.notify_all();
    }
    return count;
  }

 private:
  void serve(std::uint32_t index) {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return stopping_ || invitations_ > 0; });
      if (invitations_ == 0) return;
      --invitations_;
      lock.unlock();
      run_.redeem_ticket(index);
      lock.lock();
    }
  }

  GraphRun& run_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::uint32_t invitations_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace

std::unique_ptr<Helpers> make_thread_helpers(GraphRun& run, const ExecutorSettings& settings,
                                             const std::vector<int>& processors) {
  return std::make_unique<ThreadHelpers>(run, settings, processors);
}

}  // namespace skerry::jobs
