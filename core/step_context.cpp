#include "core/step_context.h"

#include <utility>

namespace skerry::core {

void CallbackErrors::keep(BodyIndex body, std::exception_ptr error) {
  const std::lock_guard lock(mutex_);
  // Of one body the first is kept: its callbacks run one after the other.
  if (error_ && body_ <= body) return;
  body_ = body;
  error_ = std::move(error);
}

void CallbackErrors::rethrow() {
  std::exception_ptr error;
  {
    const std::lock_guard lock(mutex_);
    error = std::exchange(error_, nullptr);
    body_ = kNone;
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace skerry::core
