#include "apps/report/results.h"

#include <fmt/chrono.h>
#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <ctime>
#include <fstream>
#include <stdexcept>

#include "apps/measure/verdict.h"
#include "apps/report/report.h"
#include "apps/report/trace_events.h"

namespace skerry::report {
namespace {

using measure::Estimate;
using measure::FrameRow;
using measure::FrameSamples;
using measure::Repetitions;

Json interval(const Estimate& estimate) { return {estimate.low, estimate.high}; }

Json estimate_json(const Estimate& estimate) {
  return {{"value", estimate.value}, {"interval", interval(estimate)}};
}

// A summary with the intervals of its percentiles.
Json distribution(const Repetitions& values) {
  Json json = to_json(measure::summarize(measure::pooled(values)));
  json["p50_interval"] = interval(measure::bootstrap_percentile(values, 0.50));
  json["p95_interval"] = interval(measure::bootstrap_percentile(values, 0.95));
  json["p99_interval"] = interval(measure::bootstrap_percentile(values, 0.99));
  return json;
}

Json strategy_json(const measure::Strategy& strategy) {
  return {{"label", strategy.label},
          {"mode", to_string(strategy.mode)},
          {"scheduler", schedulers::to_string(strategy.scheduler)},
          {"workers", strategy.workers},
          {"spin_us", strategy.wait.spin_us},
          {"affinity", strategy.affinity == Affinity::spread ? "spread" : "none"},
          {"wake_ahead_ms", strategy.wake_ahead_ms}};
}

Json difference_json(const std::optional<measure::Difference>& difference) {
  if (!difference) return nullptr;
  return {{"step", difference->step}, {"where", difference->where}};
}

Json repetitions_json(const measure::RepetitionCount& count) {
  return {{"made", count.made},
          {"disturbed", count.disturbed},
          {"counted", count.counted},
          {"largest_steal", count.steal},
          {"largest_others", count.others}};
}

Json throughput_json(const measure::ThroughputRow& row,
                     const measure::SceneComparison& comparison) {
  Json json = strategy_json(row.strategy);
  json["step_ms"] = to_json(row.step_ms);
  json["rep_mean_ms"] = row.rep_ms;
  json["typical_ms"] = estimate_json(row.typical_ms);
  json["speed_up"] = estimate_json(row.speed_up);
  json["allowed_speed_up"] = comparison.bound.speed_up(row.strategy.workers);
  json["efficiency"] = row.speed_up.value / row.strategy.workers;
  json["karp_flatt"] = row.strategy.workers > 1
                           ? Json(measure::karp_flatt(row.speed_up.value, row.strategy.workers))
                           : Json(nullptr);
  json["cpu_ms_per_step"] = row.cpu_ms_per_step;
  json["cpu_s_per_simulated_s"] = 1e-3 * row.cpu_ms_per_step / comparison.dt;
  json["idle_ms_per_step"] = row.idle_ms_per_step;
  json["blocked_ms_per_step"] = row.blocked_ms_per_step;
  json["imbalance"] = row.imbalance;
  json["switches_per_step"] = row.switches_per_step;
  json["forced_switches_per_step"] = row.forced_switches_per_step;
  json["allocations_per_step"] = row.allocations_per_step;
  json["peak_mb"] = row.peak_mb;
  json["idle_cpu"] = row.idle_cpu;
  json["state_hash"] = hash_text(row.state_hash);
  json["equal"] = !row.difference.has_value();
  json["first_difference"] = difference_json(row.difference);
  json["stages"] = Json::array();
  for (const measure::StageMeans& stage : row.stages) {
    json["stages"].push_back({{"name", stage.name},
                              {"wall_ms", stage.wall_ms},
                              {"cpu_ms", stage.cpu_ms},
                              {"tasks", stage.tasks}});
  }
  return json;
}

const char* text_of(measure::FrameRate rate) {
  switch (rate) {
    case measure::FrameRate::held:
      return "held";
    case measure::FrameRate::edge:
      return "edge";
    case measure::FrameRate::lost:
      break;
  }
  return "lost";
}

Json frame_json(const FrameRow& row, double dt) {
  double cpu_ms = 0, switches = 0, forced = 0;
  std::uint64_t missed = 0, dropped = 0;
  for (const FrameSamples& rep : row.reps) {
    cpu_ms += rep.cpu_ms;
    switches += static_cast<double>(rep.voluntary_switches);
    forced += static_cast<double>(rep.involuntary_switches);
    missed += rep.missed;
    dropped += rep.dropped_steps;
  }
  const double frames = static_cast<double>(std::max<std::uint64_t>(1, row.frames()));
  Json json = strategy_json(row.strategy);
  json["host_ms"] = row.host_ms;
  json["frames"] = row.frames();
  json["gave_up"] = row.gave_up;
  json["frame_rate"] = text_of(measure::frame_rate(row, dt));
  json["missed"] = missed;
  json["missed_share"] = row.missed_share();
  json["frame_ms"] = distribution(row.values(&FrameSamples::latency_ms));
  json["input_to_visible_ms"] = distribution(row.values(&FrameSamples::input_ms));
  json["state_age_ms"] = distribution(row.values(&FrameSamples::state_age_ms));
  json["step_ms"] = distribution(row.values(&FrameSamples::step_ms));
  json["blocked_ms"] =
      to_json(measure::summarize(measure::pooled(row.values(&FrameSamples::blocked_ms))));
  json["helped_ms"] =
      to_json(measure::summarize(measure::pooled(row.values(&FrameSamples::helped_ms))));
  json["cpu_ms_per_frame"] = cpu_ms / frames;
  json["switches_per_frame"] = switches / frames;
  json["forced_switches_per_frame"] = forced / frames;
  json["dropped_steps"] = dropped;
  return json;
}

// The repetition whose typical frame is nearest to the median of all.
const measure::FrameTimeline* typical(const FrameRow& row) {
  const double middle = measure::median(measure::pooled(row.values(&FrameSamples::latency_ms)));
  const measure::FrameTimeline* best = nullptr;
  for (const FrameSamples& rep : row.reps) {
    if (!rep.typical) continue;
    if (!best || std::abs(rep.typical->latency_ms - middle) < std::abs(best->latency_ms - middle))
      best = &*rep.typical;
  }
  return best;
}

double microseconds(double ms) { return std::round(1e4 * ms) / 10; }

Json timeline_json(const FrameRow& row, const measure::FrameTimeline& timeline) {
  Json json = {{"label", row.strategy.label},     {"mode", to_string(row.strategy.mode)},
               {"host_ms", row.host_ms},          {"latency_ms", timeline.latency_ms},
               {"period_ms", timeline.period_ms}, {"tracks", timeline.tracks},
               {"spans", Json::array()}};
  for (const measure::FrameSpan& span : timeline.spans) {
    json["spans"].push_back({span.track, to_string(span.kind), span.name,
                             microseconds(span.begin_ms), microseconds(span.end_ms),
                             span.first_item, span.item_count});
  }
  return json;
}

Json recommendation_json(const measure::LoadVerdict& verdict) {
  Json json = {{"host_ms", verdict.host_ms},
               {"modes", verdict.modes},
               {"holding", verdict.holding},
               {"edge", verdict.edge},
               {"best", verdict.best},
               {"input_p95_ms", verdict.input_ms},
               {"frame_p95_ms", verdict.best_frame_ms}};
  json["shortest_frames"] = verdict.shortest ? Json{{"label", *verdict.shortest},
                                                    {"frame_p95_ms", verdict.shortest_frame_ms},
                                                    {"input_p95_ms", verdict.shortest_input_ms}}
                                             : Json(nullptr);
  json["sooner_input"] =
      verdict.sooner ? Json{{"label", *verdict.sooner}, {"input_p95_ms", verdict.sooner_input_ms}}
                     : Json(nullptr);
  return json;
}

Json options_json(const measure::CompareOptions& options) {
  Json affinity = Json::array();
  for (const Affinity value : options.axes.affinity) {
    affinity.push_back(value == Affinity::spread ? "spread" : "none");
  }
  return {{"workers", options.axes.workers},
          {"spin_us", options.axes.spin_us},
          {"affinity", std::move(affinity)},
          {"wake_ahead_ms", options.axes.wake_ahead_ms},
          {"host_ms", options.host_ms},
          {"host_shape", to_string(options.host_shape)},
          {"reps", options.reps},
          {"steps", options.steps},
          {"warmup", options.warmup},
          {"frame_warmup", options.frame_warmup},
          {"frames", options.frames},
          {"sleep", options.sleep}};
}

std::string trace_name(const std::string& scene, const std::string& label) {
  std::string name = "trace_" + scene + "_" + label + ".json";
  for (char& c : name) {
    const bool fits = std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '_';
    if (!fits) c = '_';
  }
  return name;
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream output(file, std::ios::binary);
  output << text;
  if (!output.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace

std::string hash_text(std::uint64_t hash) { return fmt::format("0x{:016x}", hash); }

Json to_json(const measure::Machine& machine) {
  return {{"cpu", machine.cpu},       {"cores", machine.cores},       {"simd", machine.simd},
          {"system", machine.system}, {"compiler", machine.compiler}, {"flags", machine.flags},
          {"commit", machine.commit}};
}

Json to_json(const measure::Summary& summary) {
  return {{"mean", summary.mean},
          {"p50", summary.p50},
          {"p95", summary.p95},
          {"p99", summary.p99},
          {"max", summary.max}};
}

Json begin_results(const std::string& command, const measure::CompareOptions& options) {
  return {{"format", "skerry-compare"},
          {"version", kResultsVersion},
          {"command", command},
          {"started", fmt::format("{:%Y-%m-%d %H:%M}", fmt::localtime(std::time(nullptr)))},
          {"seconds", 0},
          {"machine", to_json(measure::this_machine())},
          {"options", options_json(options)},
          {"cut", ""},
          {"interrupted", false},
          {"equal", true},
          {"scheduling", Json::array()},
          {"scenes", Json::array()}};
}

void add(Json& results, const measure::SceneComparison& comparison) {
  results["equal"] = results["equal"].get<bool>() && comparison.equal();
  results["scenes"].push_back(to_json(comparison));
}

void add(Json& results, const measure::SchedulingCost& cost) {
  Json json = strategy_json(cost.strategy);
  json["empty_step_us"] = to_json(cost.empty_step_us);
  json["empty_tasks_us"] = cost.empty_tasks_us ? to_json(*cost.empty_tasks_us) : Json(nullptr);
  results["scheduling"].push_back(std::move(json));
}

int write_files(const std::filesystem::path& directory, const Json& results) {
  write_text(directory / "results.json", results.dump(1) + "\n");
  write_text(directory / "report.html", html(results));
  int traces = 0;
  for (const Json& scene : results.at("scenes")) {
    const std::string name = scene.at("scene");
    for (const Json& timeline : scene.at("timelines")) {
      write_text(directory / trace_name(name, timeline.at("label")),
                 to_trace(timeline, name).dump() + "\n");
      ++traces;
    }
  }
  return traces;
}

Json to_json(const measure::SceneComparison& comparison) {
  Json json = {{"scene", comparison.scene},
               {"bodies", comparison.bodies},
               {"joints", comparison.joints},
               {"contacts", comparison.contacts},
               {"islands", comparison.islands},
               {"largest_island", comparison.largest_island},
               {"dt", comparison.dt},
               {"substeps", comparison.substeps},
               {"warmup", comparison.warmup},
               {"steps", comparison.steps},
               {"host_shape", to_string(comparison.host_shape)},
               {"equal", comparison.equal()},
               {"verdict", comparison.verdict},
               {"recommendations", Json::array()},
               {"throughput_repetitions", repetitions_json(comparison.throughput_reps)},
               {"frame_repetitions", repetitions_json(comparison.frame_reps)},
               {"work_ms", comparison.bound.work_ms()},
               {"critical_path_ms", comparison.bound.critical_ms()},
               {"throughput", Json::array()},
               {"frames", Json::array()},
               {"settings", Json::array()},
               {"frame_difference", difference_json(comparison.frame_difference)},
               {"timelines", Json::array()}};
  for (const auto& verdict : measure::load_verdicts(comparison)) {
    json["recommendations"].push_back(recommendation_json(verdict));
  }
  for (const auto& row : comparison.throughput) {
    json["throughput"].push_back(throughput_json(row, comparison));
  }
  for (const auto& row : comparison.frames) {
    json["frames"].push_back(frame_json(row, comparison.dt));
    if (const auto* timeline = typical(row)) {
      json["timelines"].push_back(timeline_json(row, *timeline));
    }
  }
  for (const auto& row : comparison.one_at_a_time)
    json["settings"].push_back(frame_json(row, comparison.dt));
  return json;
}

Json to_trace(const Json& timeline, const std::string& scene) {
  const auto ns = [](const Json& us) { return std::int64_t{std::llround(1e3 * us.get<double>())}; };
  TraceEvents events(fmt::format("skerry: {}, {}", scene, timeline.at("label").get<std::string>()));
  std::uint32_t track = 0;
  for (const Json& name : timeline.at("tracks")) events.name_track(track++, name);
  std::int64_t first_ns = 0;  // tasks of the step before reach into a frame
  for (const Json& span : timeline.at("spans")) first_ns = std::min(first_ns, ns(span[3]));
  for (const Json& span : timeline.at("spans")) {
    const bool has_items = span[6].get<std::uint32_t>() > 0;
    Json args = has_items ? Json{{"first_item", span[5]}, {"item_count", span[6]}} : Json(nullptr);
    events.add(span[2], span[1], span[0], ns(span[3]) - first_ns, ns(span[4]) - first_ns,
               std::move(args));
  }
  events.mark("frame due", -first_ns);
  return events.take(
      {{"scene", scene}, {"mode", timeline.at("label")}, {"host_ms", timeline.at("host_ms")}});
}

}  // namespace skerry::report
