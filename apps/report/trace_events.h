// Files in the trace event format (Google, "Trace Event Format"), which chrome://tracing, Perfetto
// and speedscope open.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace skerry::report {

using Json = nlohmann::ordered_json;

class TraceEvents {
 public:
  // `traced`: what the tracks belong to, shown above them.
  explicit TraceEvents(const std::string& traced);

  // Track 0 is the one that is shown first.
  void name_track(std::uint32_t track, const std::string& name);

  // Times from the beginning of the trace. The events of one track follow each other or nest.
  // `args`: an object, or null for none. speedscope adds up events of equal name and arguments, so
  // arguments are what may keep them apart; never a step's number.
  void add(const std::string& name, const std::string& category, std::uint32_t track,
           std::int64_t begin_ns, std::int64_t end_ns, Json args);

  // A line across all tracks.
  void mark(const std::string& name, std::int64_t at_ns);

  // The whole file; `facts` tells what was traced. Leaves nothing behind.
  Json take(Json facts);

 private:
  Json events_ = Json::array();
};

}  // namespace skerry::report
