#include "tests/jobs/executors.h"

#include <algorithm>
#include <chrono>

namespace skerry::jobs::test {

ThreadPool::ThreadPool(int threads, Habits habits) : habits_(habits) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { serve(); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

TaskPool::Handle ThreadPool::submit(Function function, void* context, const char* name) {
  auto* job = new Job{function, context};
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(job);
    names_.emplace_back(name);
    ++submitted_;
  }
  changed_.notify_all();
  return job;
}

void ThreadPool::wait(Handle handle) {
  const std::unique_ptr<Job> job(static_cast<Job*>(handle));
  std::unique_lock lock(mutex_);
  ++waited_;
  if (job->state == Job::queued) {
    queue_.erase(std::find(queue_.begin(), queue_.end(), job.get()));
    run(lock, *job);
  }
  changed_.wait(lock, [&] { return job->state == Job::done; });
}

int ThreadPool::worker_count() const {
  return habits_.promised_workers >= 0 ? habits_.promised_workers
                                       : static_cast<int>(threads_.size());
}

int ThreadPool::submitted() const {
  const std::lock_guard lock(mutex_);
  return submitted_;
}

int ThreadPool::waited() const {
  const std::lock_guard lock(mutex_);
  return waited_;
}

std::vector<std::string> ThreadPool::names() const {
  const std::lock_guard lock(mutex_);
  return names_;
}

void ThreadPool::serve() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (queue_.empty()) return;
    Job* job = habits_.last_in_first_out ? queue_.back() : queue_.front();
    if (habits_.last_in_first_out) {
      queue_.pop_back();
    } else {
      queue_.pop_front();
    }
    run(lock, *job);
  }
}

void ThreadPool::run(std::unique_lock<std::mutex>& lock, Job& job) {
  job.state = Job::running;
  int delay_us = 0;
  if (habits_.longest_delay_us > 0) {
    delay_us = static_cast<int>(random_() % static_cast<unsigned>(habits_.longest_delay_us));
  }
  lock.unlock();
  if (delay_us > 0) std::this_thread::sleep_for(std::chrono::microseconds(delay_us));
  job.function(job.context);
  lock.lock();
  job.state = Job::done;
  changed_.notify_all();
}

TestedExecutor::TestedExecutor(const ExecutorCase& executor_case, WaitPolicy wait) {
  ExecutorSettings settings{
      .workers = executor_case.workers, .wait = wait, .affinity = executor_case.affinity};
  if (executor_case.kind == ExecutorKind::host_pool) {
    pool_ = std::make_unique<ThreadPool>(executor_case.workers - 1);
    settings.pool = pool_.get();
  }
  executor_ = make_executor(executor_case.kind, settings);
}

std::vector<ExecutorCase> every_executor() {
  std::vector<ExecutorCase> cases = {{ExecutorKind::serial, 1}};
  for (const auto kind : {ExecutorKind::fork_join, ExecutorKind::job_system,
                          ExecutorKind::host_pool, ExecutorKind::threads}) {
    for (const int workers : {1, 2, 3, 4, 8}) cases.push_back({kind, workers});
    cases.push_back({kind, 2, Affinity::spread});
  }
  return cases;
}

std::vector<ExecutorCase> every_parallel_executor() {
  std::vector<ExecutorCase> cases;
  for (const ExecutorCase& one : every_executor()) {
    if (one.workers > 1 && one.kind != ExecutorKind::fork_join) cases.push_back(one);
  }
  return cases;
}

std::string case_name(const testing::TestParamInfo<ExecutorCase>& info) {
  const char* const kinds[] = {"serial", "fork_join", "job_system", "host_std_thread_pool",
                               "std_thread"};
  return std::string(kinds[static_cast<int>(info.param.kind)]) + "_" +
         std::to_string(info.param.workers) +
         (info.param.affinity == Affinity::spread ? "_spread" : "");
}

}  // namespace skerry::jobs::test
