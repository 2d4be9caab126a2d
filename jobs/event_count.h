// Sleeping until some other thread has changed something, without a lock on the fast path.
#pragma once

#include <atomic>

namespace skerry::jobs {

// Sleeper:   EventCount::Sleeper sleeper(event);  if (!condition()) sleeper.sleep();
// Signaller: make the condition true, then event.signal().
// Either the signaller sees the sleeper, or the sleeper sees the condition: there is a full fence
// between the write and the look on both sides. With nobody asleep, signal() is that fence and a
// load.
class EventCount {
 public:
  class Sleeper {
   public:
    explicit Sleeper(EventCount& event)
        : event_(event), sequence_(event.sequence_.load(std::memory_order_acquire)) {
      event_.sleepers_.fetch_add(1, std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_seq_cst);
    }
    ~Sleeper() { event_.sleepers_.fetch_sub(1, std::memory_order_relaxed); }
    Sleeper(const Sleeper&) = delete;
    Sleeper& operator=(const Sleeper&) = delete;

    // Returns at the next signal, or at once if there has been one since the construction.
    void sleep() { event_.sequence_.wait(sequence_, std::memory_order_acquire); }

   private:
    EventCount& event_;
    int sequence_;
  };

  void signal() {
    std::atomic_thread_fence(std::memory_order_seq_cst);
    if (sleepers_.load(std::memory_order_relaxed) == 0) return;
    sequence_.fetch_add(1, std::memory_order_release);
    sequence_.notify_all();
  }

 private:
  std::atomic<int> sequence_{0};  // int: what a futex waits on
  std::atomic<int> sleepers_{0};
};

}  // namespace skerry::jobs
