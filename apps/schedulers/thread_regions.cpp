// Parallel loops on plain std::thread: workers sleep on a condition variable between loops and take
// indices from one counter; the caller waits for the last of them.
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "apps/schedulers/fork_join_regions.h"
#include "jobs/machine.h"

namespace skerry::schedulers {
namespace {

class ThreadRegions final : public Regions {
 public:
  explicit ThreadRegions(const jobs::ExecutorSettings& settings) {
    const std::vector<int> processors = jobs::allowed_processors();
    for (int i = 1; i < settings.workers; ++i) {
      const bool spread = settings.affinity == jobs::Affinity::spread;
      const std::vector<int> where =
          spread ? std::vector<int>{processors[static_cast<std::size_t>(i) % processors.size()]}
                 : processors;
      threads_.emplace_back([this, i, where] {
        jobs::set_affinity(where);
        serve(static_cast<std::uint32_t>(i));
      });
    }
  }

  ~ThreadRegions() override {
    {
      const std::lock_guard lock(mutex_);
      quit_ = true;
    }
    begin_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  std::uint32_t workers() const override { return static_cast<std::uint32_t>(threads_.size()) + 1; }

  void loop(std::uint32_t count, const Body& body) override {
    {
      const std::lock_guard lock(mutex_);
      body_ = &body;
      count_ = count;
      next_.store(0, std::memory_order_relaxed);
      busy_ = threads_.size();
      ++loop_;
    }
    begin_.notify_all();
    work(0);
    std::unique_lock lock(mutex_);
    end_.wait(lock, [this] { return busy_ == 0; });
  }

 private:
  void work(std::uint32_t worker) {
    for (;;) {
      const std::uint32_t i = next_.fetch_add(1, std::memory_order_relaxed);
      if (i >= count_) return;
      (*body_)(i, worker);
    }
  }

  void serve(std::uint32_t worker) {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex_);
    while (true) {
      begin_.wait(lock, [&] { return quit_ || loop_ != seen; });
      if (quit_) return;
      seen = loop_;
      lock.unlock();
      work(worker);
      lock.lock();
      if (--busy_ == 0) end_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable begin_, end_;
  std::uint64_t loop_ = 0;
  bool quit_ = false;
  std::size_t busy_ = 0;
  const Body* body_ = nullptr;
  std::uint32_t count_ = 0;
  std::atomic<std::uint32_t> next_{0};
  std::vector<std::thread> threads_;
};

}  // namespace

std::unique_ptr<Regions> make_thread_regions(const jobs::ExecutorSettings& settings) {
  return std::make_unique<ThreadRegions>(settings);
}

}  // namespace skerry::schedulers
