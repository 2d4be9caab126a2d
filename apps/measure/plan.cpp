#include "apps/measure/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/measure/compare_parts.h"
#include "apps/measure/process_meter.h"

namespace skerry::measure {
namespace {

double seconds_since(std::int64_t begin_ns) {
  return 1e-9 * static_cast<double>(now_ns() - begin_ns);
}

// Of the analysis that follows the repetitions, per row.
constexpr double kIdleWatch = 0.12;
constexpr double kWarmupFrames = 3;
// Steps of early frames are cheaper than those of late ones, and caches are shared with host work.
constexpr double kFrameStepFactor = 1.3;

double loop_seconds(const SceneCost& cost, double host_ms, const CompareOptions& options,
                    double dt) {
  const double frame = std::max(dt, kFrameStepFactor * cost.step_s + 1e-3 * host_ms);
  return (static_cast<double>(options.frames) + kWarmupFrames) * std::min(frame, 2 * dt);
}

std::string change(const char* what, double from, double to) {
  char text[96];
  std::snprintf(text, sizeof text, "%s cut from %.0f to %.0f", what, from, to);
  return text;
}

}  // namespace

SceneCost probe(const scenes::SceneDesc& scene, const CompareOptions& options) {
  SceneCost cost;
  std::int64_t begin_ns = now_ns();
  const double dt = frame_dt(options.dt.value_or(scene.defaults.dt));
  Session session(scene, base_settings(scene, options, dt), dt);
  cost.build_s = seconds_since(begin_ns);
  constexpr int kSteps = 30;
  begin_ns = now_ns();
  for (int i = 0; i < kSteps; ++i) session.advance();
  cost.step_s = seconds_since(begin_ns) / kSteps;
  begin_ns = now_ns();
  session.world().state_hash();
  cost.hash_s = seconds_since(begin_ns);
  return cost;
}

SceneSeconds estimate(const SceneCost& cost, const CompareOptions& options, double dt) {
  const std::size_t own = strategies(options.axes).size();
  const std::size_t others = options.other_schedulers ? other_schedulers(options.axes).size() : 0;
  const double rows = static_cast<double>(own + others);
  const double warm = cost.build_s + static_cast<double>(options.warmup) * cost.step_s;
  const double steps = static_cast<double>(options.steps);
  SceneSeconds seconds;
  const double rep =
      warm + steps * cost.step_s + (steps + static_cast<double>(options.warmup)) * cost.hash_s;
  seconds.throughput = rows * (options.step_reps() * rep + warm + steps * cost.step_s + kIdleWatch);
  if (options.frames == 0 || options.host_ms.empty()) return seconds;
  const double settle = cost.build_s + static_cast<double>(options.frame_warmup) * cost.step_s;
  double all_loads = 0;
  for (const double host_ms : options.host_ms) {
    all_loads += loop_seconds(cost, host_ms, options, dt);
  }
  seconds.frames = static_cast<double>(own) * (settle + options.reps * all_loads);
  if (options.one_at_a_time) {
    const auto single = static_cast<double>(one_at_a_time(options.axes).size());
    seconds.frames +=
        single * (settle + options.reps * loop_seconds(cost, options.detail_host_ms, options, dt));
  }
  return seconds;
}

Plan make_plan(const std::vector<SceneCost>& costs, std::vector<CompareOptions> options,
               const Fixed& fixed, double limit_s) {
  Plan plan;
  const auto measure_all = [&] {
    plan.seconds.clear();
    plan.total_s = 0;
    for (std::size_t i = 0; i < costs.size(); ++i) {
      const double dt = options[i].dt.value_or(1.0 / 60);
      plan.seconds.push_back(estimate(costs[i], options[i], dt).total());
      plan.total_s += plan.seconds.back();
    }
  };
  // Lowers one number of all scenes by 1 until the whole fits or the least is reached.
  const auto lower = [&](const char* what, bool is_fixed, auto member, auto least) {
    measure_all();
    if (is_fixed || options.empty() || plan.total_s <= limit_s) return;
    const auto before = options.front().*member;
    while (plan.total_s > limit_s && options.front().*member > least) {
      for (CompareOptions& one : options) --(one.*member);
      measure_all();
    }
    const auto after = options.front().*member;
    if (after == before) return;
    if (!plan.cut.empty()) plan.cut += ", ";
    plan.cut += change(what, static_cast<double>(before), static_cast<double>(after));
  };
  lower("frames", fixed.frames, &CompareOptions::frames, std::uint64_t{10});
  lower("repetitions", fixed.reps, &CompareOptions::reps, 3);
  lower("steps", fixed.steps, &CompareOptions::steps, std::uint64_t{10});
  lower("frames", fixed.frames, &CompareOptions::frames, std::uint64_t{5});
  measure_all();
  if (!plan.cut.empty()) {
    char text[48];
    std::snprintf(text, sizeof text, " to stay below %.0f s", limit_s);
    plan.cut += text;
  }
  plan.options = std::move(options);
  return plan;
}

}  // namespace skerry::measure
