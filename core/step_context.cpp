#include "core/step_context.h"

#include <utility>

namespace skerry::core {
namespace {

class SpinLock {
 public:
  explicit SpinLock(std::atomic_flag& flag) : flag_(flag) {
    while (flag_.test_and_set(std::memory_order_acquire)) {
    }
  }
  ~SpinLock() { flag_.clear(std::memory_order_release); }

 private:
  std::atomic_flag& flag_;
};

}  // namespace

void CallbackErrors::keep(BodyIndex body, std::exception_ptr error) {
  const SpinLock lock(busy_);
  // Of one body the first is kept: its callbacks run one after the other.
  if (error_ && body_ <= body) return;
  body_ = body;
  error_ = std::move(error);
}

void CallbackErrors::rethrow() {
  std::exception_ptr error;
  {
    const SpinLock lock(busy_);
    error = std::exchange(error_, nullptr);
    body_ = kNone;
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace skerry::core
