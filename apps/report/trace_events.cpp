#include "apps/report/trace_events.h"

#include <algorithm>
#include <utility>

namespace skerry::report {
namespace {

double microseconds(std::int64_t ns) { return 1e-3 * static_cast<double>(ns); }

}  // namespace

void TraceEvents::name_track(std::uint32_t track, const std::string& name) {
  events_.push_back({{"name", "thread_name"},
                     {"ph", "M"},
                     {"pid", 1},
                     {"tid", track},
                     {"args", {{"name", name}}}});
}

// Durations are a nanosecond short: as a sum of two rounded numbers the end of an event could come
// to lie behind the beginning of the next, and speedscope would nest the one in the other.
void TraceEvents::add(const std::string& name, const std::string& category, std::uint32_t track,
                      std::int64_t begin_ns, std::int64_t end_ns, Json args) {
  Json event = {{"name", name},
                {"cat", category},
                {"ph", "X"},
                {"pid", 1},
                {"tid", track},
                {"ts", microseconds(begin_ns)},
                {"dur", microseconds(std::max<std::int64_t>(0, end_ns - begin_ns - 1))}};
  if (!args.is_null()) event["args"] = std::move(args);
  events_.push_back(std::move(event));
}

void TraceEvents::mark(const std::string& name, std::int64_t at_ns) {
  events_.push_back({{"name", name},
                     {"ph", "i"},
                     {"s", "g"},
                     {"pid", 1},
                     {"tid", 0},
                     {"ts", microseconds(at_ns)}});
}

Json TraceEvents::take(Json facts) {
  return {{"traceEvents", std::exchange(events_, Json::array())},
          {"displayTimeUnit", "ms"},
          {"otherData", std::move(facts)}};
}

}  // namespace skerry::report
