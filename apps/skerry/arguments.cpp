#include "apps/skerry/arguments.h"

#include <fmt/core.h>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "apps/measure/session.h"
#include "scenes/load.h"
#include "scenes/near_names.h"

namespace skerry::app {
namespace {

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    parts.push_back(list.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

}  // namespace

ThreadingMode parse_mode(const std::string& name) {
  std::vector<std::string> names;
  for (const ThreadingMode mode : measure::kAllModes) {
    if (name == to_string(mode)) return mode;
    names.emplace_back(to_string(mode));
  }
  std::string all;
  for (const std::string& known : names) all += (all.empty() ? "" : ", ") + known;
  throw BadInput("--mode: must be one of " + all + ", got '" + name + "'" +
                 scenes::did_you_mean(name, names));
}

SolverKind parse_solver(const std::string& name) {
  for (const SolverKind kind : scenes::kSolverKinds) {
    if (name == to_string(kind)) return kind;
  }
  throw BadInput("--solver: must be soft_step_tgs, pgs or penalty, got '" + name + "'");
}

std::vector<Affinity> parse_affinities(const std::string& list) {
  std::vector<Affinity> values;
  for (const std::string& name : split(list)) {
    if (name != "none" && name != "spread") {
      throw BadInput("--affinity: must be none or spread, got '" + name + "'");
    }
    values.push_back(name == "none" ? Affinity::none : Affinity::spread);
  }
  return values;
}

measure::HostShape parse_host_shape(const std::string& name) {
  using measure::HostShape;
  for (const HostShape shape : {HostShape::serial, HostShape::jobs, HostShape::mixed}) {
    if (name == to_string(shape)) return shape;
  }
  throw BadInput("--host-shape: must be serial, jobs or mixed, got '" + name + "'");
}

std::vector<int> parse_workers(const std::string& list) {
  std::vector<int> values;
  for (const std::string& text : split(list)) {
    int value = 0;
    const char* last = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), last, value);
    if (parsed.ec != std::errc() || parsed.ptr != last || value < 0 || value > kMaxWorkers) {
      throw BadInput(
          fmt::format("--workers: must be numbers from 0 to {} with commas between, got '{}'",
                      kMaxWorkers, list));
    }
    values.push_back(value);
  }
  return values;
}

scenes::SceneDesc load(const std::string& name, const std::optional<std::uint64_t>& seed) {
  try {
    return scenes::load_scene(name, {.seed = seed});
  } catch (const std::out_of_range& error) {
    throw BadInput(error.what());
  }
}

std::vector<double> parse_numbers(const std::string& option, const std::string& list, double most,
                                  const std::string& unit) {
  std::vector<double> values;
  for (const std::string& text : split(list)) {
    double value = 0;
    const char* last = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), last, value);
    const bool whole = parsed.ec == std::errc() && parsed.ptr == last;
    if (!whole || !(value >= 0 && value <= most)) {
      throw BadInput(fmt::format("{}: must be {} from 0 to {:g} with commas between, got '{}'",
                                 option, unit, most, list));
    }
    values.push_back(value);
  }
  return values;
}

void write_text(const std::string& file, const std::string& text) {
  if (file == "-") {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return;
  }
  std::ofstream output(file, std::ios::binary);
  output << text;
  if (!output.flush()) throw BadInput("cannot write " + file);
}

void check_writable(const std::string& file) {
  if (file.empty() || file == "-") return;
  const std::filesystem::path parent = std::filesystem::path(file).parent_path();
  std::error_code error;
  if (!parent.empty() && !std::filesystem::is_directory(parent, error)) {
    throw BadInput("cannot write " + file + ": there is no directory " + parent.string());
  }
  if (!std::ofstream(file, std::ios::app)) throw BadInput("cannot write " + file);
}

}  // namespace skerry::app
