#include "apps/skerry/terminal.h"

#include <fmt/core.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>

#include "apps/measure/process_meter.h"

namespace skerry::app {
namespace {

std::atomic<bool> interrupted_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void on_interrupt(int) {
  if (interrupted_flag.exchange(true)) _exit(130);
}

}  // namespace

InterruptGuard::InterruptGuard() { std::signal(SIGINT, on_interrupt); }
InterruptGuard::~InterruptGuard() { std::signal(SIGINT, SIG_DFL); }
bool InterruptGuard::interrupted() { return interrupted_flag.load(); }

Progress::Progress(std::string title)
    : title_(std::move(title)), terminal_(isatty(2) != 0), begin_ns_(measure::now_ns()) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (terminal_ && drawn_ns_ > 0) std::fputs("\r\033[K", stderr);
}

std::string Progress::time_left(double share) const {
  if (share < 0.02 || share >= 1) return "";
  const double elapsed_s = 1e-9 * static_cast<double>(measure::now_ns() - begin_ns_);
  const auto left = static_cast<int>(elapsed_s * (1 - share) / share + 0.5);
  return fmt::format(", {}:{:02} left", left / 60, left % 60);
}

void Progress::draw(double share, const std::string& what) {
  constexpr int kWidth = 30;
  const int full = static_cast<int>(kWidth * share);
  fmt::print(stderr, "\r\033[K{} [{}{}] {:3.0f} %{}  {}", title_, std::string(full, '#'),
             std::string(kWidth - full, '.'), 100 * share, time_left(share), what);
}

void Progress::show(double share, const std::string& what) {
  share = std::clamp(share, 0.0, 1.0);
  if (terminal_) {
    constexpr std::int64_t kRedrawNs = 100'000'000;
    const std::int64_t now = measure::now_ns();
    if (now - drawn_ns_ < kRedrawNs) return;
    drawn_ns_ = now;
    return draw(share, what);
  }
  const int tenths = static_cast<int>(10 * share);
  if (tenths <= tenths_) return;
  tenths_ = tenths;
  fmt::print(stderr, "{}: {} %{} ({})\n", title_, 10 * tenths, time_left(share), what);
}

measure::Watcher Progress::watcher() {
  return {.stop = [] { return InterruptGuard::interrupted(); },
          .progress = [this](double share, const std::string& what) { show(share, what); }};
}

}  // namespace skerry::app
