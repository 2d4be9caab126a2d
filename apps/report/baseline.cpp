#include "apps/report/baseline.h"

#include <fmt/core.h>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace skerry::report {
namespace {

struct Figure {
  double value = 0, low = 0, high = 0;
};

Figure estimate(const Json& json) {
  return {json.at("value"), json.at("interval")[0], json.at("interval")[1]};
}
Figure p95(const Json& json) {
  return {json.at("p95"), json.at("p95_interval")[0], json.at("p95_interval")[1]};
}

class Comparer {
 public:
  Comparer(double tolerance, BaselineComparison& result) : tolerance_(tolerance), result_(result) {}

  void compare(const std::string& what, const Figure& before, const Figure& now,
               bool more_is_worse) {
    if (before.value <= 0 || now.value <= 0) return;
    ++result_.compared;
    const bool overlap = before.low <= now.high && now.low <= before.high;
    const double change = std::abs(now.value - before.value) / before.value;
    if (overlap || change <= tolerance_) return;
    result_.changes.push_back(
        {what, before.value, now.value, (now.value > before.value) == more_is_worse});
  }

  void steps(const std::string& scene, const Json& before, const Json& now) {
    const std::string what = fmt::format("{}, {}", scene, now.at("label").get<std::string>());
    compare(what + ": speed-up over serial", estimate(before.at("speed_up")),
            estimate(now.at("speed_up")), false);
    if (!result_.same_machine) return;
    compare(what + ": step, ms", estimate(before.at("typical_ms")), estimate(now.at("typical_ms")),
            true);
  }

  void frames(const std::string& scene, const Json& before, const Json& now) {
    if (!result_.same_machine) return;
    const std::string what =
        fmt::format("{}, {}, {:g} ms of host work", scene, now.at("label").get<std::string>(),
                    now.at("host_ms").get<double>());
    compare(what + ": frame time p95, ms", p95(before.at("frame_ms")), p95(now.at("frame_ms")),
            true);
    compare(what + ": input to visible p95, ms", p95(before.at("input_to_visible_ms")),
            p95(now.at("input_to_visible_ms")), true);
  }

 private:
  double tolerance_;
  BaselineComparison& result_;
};

const Json* find(const Json& rows, const Json& like, std::initializer_list<const char*> keys) {
  for (const Json& row : rows) {
    const bool same = std::all_of(keys.begin(), keys.end(),
                                  [&](const char* key) { return row.at(key) == like.at(key); });
    if (same) return &row;
  }
  return nullptr;
}

}  // namespace

bool BaselineComparison::regressed() const {
  return std::any_of(changes.begin(), changes.end(), [](const Change& c) { return c.worse; });
}

BaselineComparison compare_with_baseline(const Json& before, const Json& now, double tolerance) {
  if (!before.is_object() || before.value("format", "") != "skerry-compare" ||
      before.value("version", 0) != kResultsVersion) {
    throw std::invalid_argument(
        fmt::format("must be a results.json of version {}", kResultsVersion));
  }
  BaselineComparison result;
  for (const char* key : {"cpu", "cores"}) {
    if (before.at("machine").at(key) != now.at("machine").at(key)) result.same_machine = false;
  }
  Comparer comparer(tolerance, result);
  for (const Json& scene : now.at("scenes")) {
    const Json* old_scene = find(before.at("scenes"), scene, {"scene", "bodies", "host_shape"});
    if (!old_scene) continue;
    const std::string name = scene.at("scene");
    for (const Json& row : scene.at("throughput")) {
      const Json* old = find(old_scene->at("throughput"), row, {"label", "workers"});
      if (old) comparer.steps(name, *old, row);
    }
    for (const Json& row : scene.at("frames")) {
      const Json* old = find(old_scene->at("frames"), row, {"label", "workers", "host_ms"});
      if (old) comparer.frames(name, *old, row);
    }
  }
  return result;
}

}  // namespace skerry::report
