#include "apps/skerry/arguments.h"

#include <fmt/core.h>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "apps/measure/session.h"
#include "apps/skerry/commands.h"
#include "scenes/load.h"
#include "scenes/near_names.h"

namespace skerry::app {

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

Affinity parse_affinity(const std::string& name) {
  if (name == "none") return Affinity::none;
  if (name == "spread") return Affinity::spread;
  throw BadInput("--affinity: must be none or spread, got '" + name + "'");
}

scenes::SceneDesc load(const std::string& name, const std::optional<std::uint64_t>& seed) {
  try {
    return scenes::load_scene(name, {.seed = seed});
  } catch (const std::out_of_range& error) {
    throw BadInput(error.what());
  }
}

std::vector<double> parse_milliseconds(const std::string& option, const std::string& list) {
  std::vector<double> values;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    double value = 0;
    const char* last = list.data() + end;
    const auto parsed = std::from_chars(list.data() + begin, last, value);
    const bool whole = parsed.ec == std::errc() && parsed.ptr == last;
    if (!whole || !(value >= 0 && value <= 1000)) {
      throw BadInput(option + ": must be milliseconds from 0 to 1000 with commas between, got '" +
                     list + "'");
    }
    values.push_back(value);
    begin = end + 1;
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

std::string hash_text(std::uint64_t hash) { return fmt::format("0x{:016x}", hash); }

}  // namespace skerry::app
