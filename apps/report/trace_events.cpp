#include "apps/report/trace_events.h"

#include <algorithm>
#include <utility>

namespace skerry::report {
namespace {

// Perfetto shows the thread whose number is its process's first, and calls it the main thread; to it and
// others thread 0 is the idle one.
constexpr std::uint32_t kProcess = 1;
std::uint32_t thread_of(std::uint32_t track) { return kProcess + track; }

double microseconds(std::int64_t ns) { return 1e-3 * static_cast<double>(ns); }

Json naming(const char* what, std::uint32_t thread, const std::string& name) {
  return {
      {"name", what}, {"ph", "M"}, {"pid", kProcess}, {"tid", thread}, {"args", {{"name", name}}}};
}

}  // namespace

TraceEvents::TraceEvents(const std::string& traced) {
  events_.push_back(naming("process_name", kProcess, traced));
}

void TraceEvents::name_track(std::uint32_t track, const std::string& name) {
  events_.push_back(naming("thread_name", thread_of(track), name));
}

// Durations are a nanosecond short: as a sum of two rounded numbers the end of an event could come
// to lie behind the beginning of the next, and speedscope would nest the one in the other.
void TraceEvents::add(const std::string& name, const std::string& category, std::uint32_t track,
                      std::int64_t begin_ns, std::int64_t end_ns, Json args) {
  Json event = {{"name", name},
                {"cat", category},
                {"ph", "X"},
                {"pid", kProcess},
                {"tid", thread_of(track)},
                {"ts", microseconds(begin_ns)},
                {"dur", microseconds(std::max<std::int64_t>(0, end_ns - begin_ns - 1))}};
  if (!args.is_null()) event["args"] = std::move(args);
  events_.push_back(std::move(event));
}

void TraceEvents::mark(const std::string& name, std::int64_t at_ns) {
  events_.push_back({{"name", name},
                     {"ph", "i"},
                     {"s", "g"},
                     {"pid", kProcess},
                     {"tid", thread_of(0)},
                     {"ts", microseconds(at_ns)}});
}

// No displayTimeUnit: Perfetto before 2022 multiplied all times by it.
Json TraceEvents::take(Json facts) {
  return {{"traceEvents", std::exchange(events_, Json::array())}, {"otherData", std::move(facts)}};
}

}  // namespace skerry::report
