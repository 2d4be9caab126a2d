// Every executor kind and worker count for parametrised tests, and pools that a host might have.
#pragma once

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <skerry/jobs.h>

namespace skerry::jobs::test {

// A host's pool on std::threads. wait() runs a function that has not begun.
class ThreadPool : public TaskPool {
 public:
  struct Habits {
    bool last_in_first_out = false;
    int longest_delay_us = 0;   // random, before each function
    int promised_workers = -1;  // what worker_count() says; -1: the truth
  };
  explicit ThreadPool(int threads) : ThreadPool(threads, Habits()) {}
  ThreadPool(int threads, Habits habits);
  ~ThreadPool() override;
  Handle submit(Function function, void* context, const char* name) override;
  void wait(Handle handle) override;
  int worker_count() const override;

  int submitted() const;
  int waited() const;
  std::vector<std::string> names() const;

 private:
  struct Job {
    Function function;
    void* context;
    enum { queued, running, done } state = queued;
  };
  void serve();
  void run(std::unique_lock<std::mutex>& lock, Job& job);

  Habits habits_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job*> queue_;
  std::mt19937 random_{7};
  bool stopping_ = false;
  int submitted_ = 0;
  int waited_ = 0;
  std::vector<std::string> names_;
  std::vector<std::thread> threads_;
};

// Runs everything in submit().
class InlinePool : public TaskPool {
 public:
  Handle submit(Function function, void* context, const char*) override {
    ++submitted;
    function(context);
    return nullptr;
  }
  void wait(Handle) override { ++waited; }
  int worker_count() const override { return 3; }
  std::atomic<int> submitted = 0;
  std::atomic<int> waited = 0;
};

// Runs everything in wait().
class LazyPool : public TaskPool {
 public:
  Handle submit(Function function, void* context, const char*) override {
    ++submitted;
    return new Job{function, context};
  }
  void wait(Handle handle) override {
    const std::unique_ptr<Job> job(static_cast<Job*>(handle));
    job->function(job->context);
    ++waited;
  }
  int worker_count() const override { return 2; }
  std::atomic<int> submitted = 0;
  std::atomic<int> waited = 0;

 private:
  struct Job {
    Function function;
    void* context;
  };
};

struct ExecutorCase {
  ExecutorKind kind = ExecutorKind::serial;
  int workers = 1;
  Affinity affinity = Affinity::none;
};

// An executor and, for host_pool, the pool it runs on.
class TestedExecutor {
 public:
  explicit TestedExecutor(const ExecutorCase& executor_case, WaitPolicy wait = {});
  Executor& operator*() { return *executor_; }
  Executor* operator->() { return executor_.get(); }
  Executor& get() { return *executor_; }

 private:
  std::unique_ptr<ThreadPool> pool_;
  std::unique_ptr<Executor> executor_;
};

// All kinds x 1, 2, 3, 4, 8 workers. Names of those that run on plain threads contain std_thread,
// which the build takes as: fit for ThreadSanitizer.
std::vector<ExecutorCase> every_executor();
std::vector<ExecutorCase> every_parallel_executor();  // 2 workers and more; overlaps stages
std::string case_name(const testing::TestParamInfo<ExecutorCase>& info);

class EveryExecutor : public testing::TestWithParam<ExecutorCase> {
 protected:
  TestedExecutor executor{GetParam()};
};

}  // namespace skerry::jobs::test
