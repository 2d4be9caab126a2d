// The commands of the skerry program. Each adds itself to the command line; what it does is run
// after parsing and returns the exit status.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace skerry::app {

inline constexpr int kOk = 0;
inline constexpr int kFailedCheck = 1;
inline constexpr int kBadInput = 2;

using Action = std::function<int()>;

// For options that name a file or directory: an empty name is a mistake, not "none".
inline CLI::Validator needs_name() {
  return CLI::Validator(
      [](const std::string& name) { return std::string(name.empty() ? "needs a name" : ""); }, "");
}

void add_scenes_command(CLI::App& app, Action& action);
void add_run_command(CLI::App& app, Action& action);
// The command line goes into result files.
void add_compare_command(CLI::App& app, Action& action, int argc, char** argv);
void add_check_command(CLI::App& app, Action& action);

}  // namespace skerry::app
