// Progress and interruption.
#pragma once

#include <cstdint>
#include <string>

#include "apps/measure/session.h"

namespace skerry::app {

// While it lives, Ctrl-C asks for an early end instead of killing the program; the second one kills.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  static bool interrupted();
};

// On standard error: a bar that is redrawn ten times a second on a terminal, a line per tenth of the
// way elsewhere; with the time left, from the way and the time so far.
class Progress {
 public:
  explicit Progress(std::string title = {});
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void set_title(std::string title) { title_ = std::move(title); }
  void show(double share, const std::string& what);
  void clear();  // takes the bar away, so that something else can be printed
  // Shows progress and stops at Ctrl-C.
  measure::Watcher watcher();

 private:
  void draw(double share, const std::string& what);
  std::string time_left(double share) const;

  std::string title_;
  bool terminal_;
  std::int64_t begin_ns_;
  std::int64_t drawn_ns_ = 0;
  int tenths_ = 0;
};

}  // namespace skerry::app
