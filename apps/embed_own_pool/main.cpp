// Runs the engine on a thread pool that knows nothing of it, as a game with threads of its own would,
// and shows that the result is that of one thread, bit for bit.
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include <skerry/skerry.h>

namespace {

// A plain pool: a queue, some threads, a lock.
class Pool {
 public:
  struct Job {
    void (*function)(void*);
    void* context;
    bool begun = false, done = false;
  };

  explicit Pool(int threads) {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  ~Pool() {
    {
      const std::lock_guard lock(mutex_);
      quit_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  int size() const { return static_cast<int>(threads_.size()); }

  void push(Job* job) {
    {
      const std::lock_guard lock(mutex_);
      queue_.push_back(job);
    }
    changed_.notify_one();
  }

  // Until the job is done; runs it here if nobody has taken it yet.
  void wait(Job* job) {
    std::unique_lock lock(mutex_);
    if (!job->begun) {
      std::erase(queue_, job);
      run(job, lock);
    }
    finished_.wait(lock, [job] { return job->done; });
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return quit_ || !queue_.empty(); });
      if (queue_.empty()) return;
      Job* job = queue_.front();
      queue_.pop_front();
      run(job, lock);
    }
  }

  void run(Job* job, std::unique_lock<std::mutex>& lock) {
    job->begun = true;
    lock.unlock();
    job->function(job->context);
    lock.lock();
    job->done = true;
    finished_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_, finished_;
  std::deque<Job*> queue_;
  bool quit_ = false;
  std::vector<std::thread> threads_;
};

// All that Skerry asks of a pool.
class SkerryOnPool : public skerry::TaskPool {
 public:
  explicit SkerryOnPool(Pool& pool) : pool_(pool) {}

  Handle submit(Function function, void* context, const char*) override {
    auto job = std::make_unique<Pool::Job>(Pool::Job{function, context});
    pool_.push(job.get());
    return job.release();
  }
  void wait(Handle handle) override {
    const std::unique_ptr<Pool::Job> job(static_cast<Pool::Job*>(handle));
    pool_.wait(job.get());
  }
  int worker_count() const override { return pool_.size(); }

 private:
  Pool& pool_;
};

// 400 boxes falling onto the ground in 100 columns.
std::uint64_t simulate(const skerry::WorldSettings& settings) {
  skerry::World world(settings);
  world.add_body({.type = skerry::BodyType::fixed,
                  .shapes = {skerry::Box{.half_extents = {50, 1, 50}}},
                  .position = {0, -1, 0}});
  for (int i = 0; i < 400; ++i) {
    world.add_body({.shapes = {skerry::Box{}},
                    .position = {1.2 * (i % 10), 1.0 + 1.1 * (i / 100), 1.2 * (i / 10 % 10)}});
  }
  for (int i = 0; i < 120; ++i) world.step(1.0 / 60);
  return world.state_hash();
}

}  // namespace

int main() {
  const std::uint64_t serial = simulate({});
  std::printf("serial      %016llx\n", static_cast<unsigned long long>(serial));
  for (const int threads : {0, 1, 3}) {
    Pool pool(threads);
    SkerryOnPool adapter(pool);
    const std::uint64_t own =
        simulate({.mode = skerry::ThreadingMode::job_system, .pool = &adapter});
    std::printf("%d threads   %016llx\n", threads, static_cast<unsigned long long>(own));
    if (own != serial) return 1;
  }
}
