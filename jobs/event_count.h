// Sleeping until some other thread has changed something, without a lock on the fast path.
#pragma once

#include <atomic>

namespace skerry::jobs {

// Waiting:   const int key = event.key();  if (condition()) return;  event.wait(key);
// Signalling: make the condition true, then event.signal().
// No wake-up is lost: whoever signals after key() was taken makes wait(key) return. signal() is one
// atomic addition and one load when nobody sleeps.
class EventCount {
 public:
  int key() const { return sequence_.load(std::memory_order_seq_cst); }

  void wait(int key) {
    waiters_.fetch_add(1, std::memory_order_seq_cst);
    sequence_.wait(key, std::memory_order_seq_cst);
    waiters_.fetch_sub(1, std::memory_order_relaxed);
  }

  void signal() {
    sequence_.fetch_add(1, std::memory_order_seq_cst);
    if (waiters_.load(std::memory_order_seq_cst) > 0) sequence_.notify_all();
  }

 private:
  std::atomic<int> sequence_{0};  // int: what a futex waits on
  std::atomic<int> waiters_{0};
};

}  // namespace skerry::jobs
