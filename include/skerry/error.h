// What is thrown at the API edge when the caller's input cannot be used. The world is unchanged.
#pragma once

#include <stdexcept>
#include <string>

namespace skerry {

// A bad value: `field()` names it ("shapes[0].radius"), what() is a whole sentence with the value.
class InputError : public std::invalid_argument {
 public:
  InputError(std::string field, const std::string& sentence)
      : std::invalid_argument(sentence), field_(std::move(field)) {}
  const std::string& field() const noexcept { return field_; }

 private:
  std::string field_;
};

// A call that the world's state forbids: a stale id, a call during a step, stop() without start().
class UsageError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

}  // namespace skerry
