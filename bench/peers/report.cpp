#include "bench/peers/report.h"

#include <fmt/format.h>

#include <fstream>
#include <thread>

#include "cmake/build_info/build_info.h"

namespace skerry::peers {
namespace {

using nlohmann::json;

const Lane* find_bullet(const std::vector<Lane>& lanes) {
  for (const Lane& lane : lanes) {
    if (lane.contestant->info.name == "bullet") return &lane;
  }
  return nullptr;
}

json row_of(const PeerScene& scene, const Lane& lane, const Lane* bullet,
            const RaceOptions& options) {
  const double step_ms = mean(lane.times.wall_ms);
  const double cpu_ms = mean(lane.times.cpu_ms);
  const Quality& q = lane.quality;
  return {
      {"scene", scene.source.name},
      {"bodies", scene.bodies.size()},
      {"engine", lane.contestant->info.name},
      {"workers", lane.contestant->workers},
      {"steps", lane.times.wall_ms.size()},
      {"reps", options.reps},
      {"step_ms", step_ms},
      {"ratio_to_bullet", bullet ? json(step_ms / mean(bullet->times.wall_ms)) : json()},
      {"step_ms_p50", quantile(lane.times.wall_ms, 0.5)},
      {"step_ms_p95", quantile(lane.times.wall_ms, 0.95)},
      {"step_cpu_ms", cpu_ms},
      {"cpu_ratio_to_bullet", bullet ? json(cpu_ms / mean(bullet->times.cpu_ms)) : json()},
      {"penetration_mm", {{"mean", 1e3 * q.penetration.mean}, {"max", 1e3 * q.penetration.max}}},
      {"overlapping_pairs", q.penetration.pairs},
      {"kinetic_energy_j", q.kinetic_energy},
      {"largest_drift_m", q.largest_drift},
      {"mean_y_m", q.mean_y},
      {"top_y_m", q.top_y},
      {"escaped_bodies", q.escaped}};
}

std::string ratio_text(const json& ratio) {
  return ratio.is_null() ? "-" : fmt::format("{:.3f}", ratio.get<double>());
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

json rows_of(const PeerScene& scene, const std::vector<Lane>& lanes, const RaceOptions& options) {
  json rows = json::array();
  const Lane* bullet = find_bullet(lanes);
  for (const Lane& lane : lanes) rows.push_back(row_of(scene, lane, bullet, options));
  return rows;
}

json about(const std::vector<Contestant>& contestants, const RaceOptions& options) {
  json engines = json::object();
  for (const Contestant& contestant : contestants) {
    engines[contestant.info.name] = {{"version", contestant.info.version},
                                     {"settings", contestant.info.settings}};
  }
  return {{"engines", engines},
          {"slice_steps", options.slice},
          {"processor", processor()},
          {"processors", std::thread::hardware_concurrency()},
          {"build",
           {{"commit", build_info::kCommit},
            {"compiler", build_info::kCompiler},
            {"type", build_info::kBuildType},
            {"flags", build_info::kFlags}}}};
}

std::string table_header() {
  return fmt::format(
      "{:<14} {:<7} {:>2} {:>8} {:>8} {:>6} {:>8} {:>6} {:>7} {:>7} {:>9} {:>7} {:>6} {:>6} {:>4}",
      "scene", "engine", "w", "step ms", "p50 ms", "ratio", "cpu ms", "ratio", "pen mm", "max mm",
      "energy J", "drift m", "mean y", "top y", "out");
}

std::string table_line(const json& row) {
  const json& depth = row["penetration_mm"];
  return fmt::format(
      "{:<14} {:<7} {:>2} {:>8.2f} {:>8.2f} {:>6} {:>8.2f} {:>6} {:>7.3f} {:>7.2f} {:>9.3g} "
      "{:>7.4f} {:>6.3f} {:>6.2f} {:>4}",
      row["scene"].get<std::string>(), row["engine"].get<std::string>(), row["workers"].get<int>(),
      row["step_ms"].get<double>(), row["step_ms_p50"].get<double>(),
      ratio_text(row["ratio_to_bullet"]), row["step_cpu_ms"].get<double>(),
      ratio_text(row["cpu_ratio_to_bullet"]), depth["mean"].get<double>(),
      depth["max"].get<double>(), row["kinetic_energy_j"].get<double>(),
      row["largest_drift_m"].get<double>(), row["mean_y_m"].get<double>(),
      row["top_y_m"].get<double>(), row["escaped_bodies"].get<std::size_t>());
}

}  // namespace skerry::peers
