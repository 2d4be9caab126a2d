#include <cstdio>
#include <stdexcept>
#include <string>

#include <fmt/core.h>
#include <skerry/error.h>

#include "apps/skerry/arguments.h"
#include "apps/skerry/commands.h"
#include "cmake/build_info/build_info.h"
#include "scenes/near_names.h"
#include "scenes/scene_error.h"

namespace skerry::app {
namespace {

// One line, whatever the argument or file held.
int complain(std::string what) {
  for (char& c : what) {
    if (static_cast<unsigned char>(c) < 0x20) c = c == '\n' ? ' ' : '?';
  }
  fmt::print(stderr, "skerry: {}\n", what);
  return kBadInput;
}

// The parser's own messages span lines and have statuses of their own.
int complain(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  return complain(std::string(error.what()) + " (see skerry --help)");
}

// Said better than the parser does; empty if the first word is a command or an option.
std::string unknown_command(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return "";
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == argv[1]) return "";
    names.push_back(command->get_name());
  }
  return fmt::format("unknown command '{}'{} (see skerry --help)", argv[1],
                     scenes::did_you_mean(argv[1], names));
}

int run(int argc, char** argv) {
  CLI::App app(
      "Skerry: deterministic multithreaded rigid bodies, and the bench that compares ways "
      "to thread them");
  app.set_version_flag("--version", std::string("skerry ") + build_info::kVersion + " (" +
                                        build_info::kCommit + ", " + build_info::kCompiler + ")");
  app.require_subcommand(1);
  Action action;
  add_scenes_command(app, action);
  add_run_command(app, action);
  add_compare_command(app, action, argc, argv);
  add_check_command(app, action);
  const std::string unknown = unknown_command(app, argc, argv);
  if (!unknown.empty()) return complain(unknown);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return complain(app, error);
  }
  try {
    return action();
  } catch (const scenes::SceneError& error) {
    return complain(error.what());
  } catch (const InputError& error) {
    return complain(error.what());
  } catch (const BadInput& error) {
    return complain(error.what());
  }
}

}  // namespace
}  // namespace skerry::app

int main(int argc, char** argv) {
  try {
    return skerry::app::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "skerry: %s\n", error.what());
    return skerry::app::kBadInput;
  }
}
