// skerry compare: the threading modes side by side.
#include <fmt/core.h>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include "apps/measure/host_work.h"
#include "apps/measure/plan.h"
#include "apps/measure/process_meter.h"
#include "apps/measure/scheduling_cost.h"
#include "apps/measure/verdict.h"
#include "apps/report/baseline.h"
#include "apps/report/results.h"
#include "apps/skerry/arguments.h"
#include "apps/skerry/commands.h"
#include "apps/skerry/compare_table.h"
#include "apps/skerry/terminal.h"

namespace skerry::app {
namespace {

using report::Json;

struct CompareArguments {
  std::vector<std::string> scenes;
  std::string workers = "0", host_ms = "0,2,4,8,12", host_shape = "serial";
  std::string spin_us = "50", affinity = "spread", wake_ahead_ms = "0.3";
  std::optional<int> reps;
  std::optional<std::uint64_t> steps, frames;
  double max_seconds = 210;
  bool quick = false, modes_only = false;
  std::string directory = "skerry-compare";
  std::string baseline;
  double tolerance = 5;
  std::string command_line;
};

// One of each kind: nothing to do, a rain into one pile, many islands, one deep island.
const std::vector<std::string> kDefaultScenes = {"tiny", "sphere_rain", "islands", "box_bricks"};
// Where settings are varied one at a time, if it is among the scenes; else the first.
constexpr const char* kSettingsScene = "islands";
constexpr double kQuickSeconds = 40;

measure::CompareOptions options_of(const CompareArguments& arguments) {
  measure::CompareOptions options;
  options.axes.workers = parse_workers(arguments.workers);
  options.axes.spin_us = parse_numbers("--spin-us", arguments.spin_us, 1e6, "microseconds");
  options.axes.affinity = parse_affinities(arguments.affinity);
  options.axes.wake_ahead_ms =
      parse_numbers("--wake-ahead-ms", arguments.wake_ahead_ms, 2, "milliseconds");
  options.host_ms = parse_numbers("--host-ms", arguments.host_ms, 1000, "milliseconds");
  options.host_shape = parse_host_shape(arguments.host_shape);
  options.other_schedulers = !arguments.modes_only;
  if (arguments.quick) {
    options.reps = 3;
    options.steps = 20;
    options.frames = 12;
  }
  options.reps = arguments.reps.value_or(options.reps);
  options.steps = arguments.steps.value_or(options.steps);
  options.frames = arguments.frames.value_or(options.frames);
  return options;
}

std::vector<measure::CompareOptions> options_by_scene(
    const CompareArguments& arguments, const std::vector<scenes::SceneDesc>& scenes) {
  std::vector<measure::CompareOptions> all(scenes.size(), options_of(arguments));
  if (arguments.modes_only || arguments.quick) return all;
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (scenes[i].name == kSettingsScene) chosen = i;
  }
  all[chosen].one_at_a_time = true;
  return all;
}

std::filesystem::path make_directory(const std::string& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory)) {
    throw BadInput("--out: cannot make the directory " + directory);
  }
  check_writable((std::filesystem::path(directory) / "results.json").string());
  return directory;
}

Json read_baseline(const std::string& file) {
  if (file.empty()) return nullptr;
  std::ifstream input(file);
  if (!input) throw BadInput("--baseline: cannot read " + file);
  std::ostringstream text;
  text << input.rdbuf();
  Json json = Json::parse(text.str(), nullptr, false);
  if (json.is_discarded()) throw BadInput("--baseline: " + file + " is not JSON");
  try {
    report::compare_with_baseline(json, json, 0);
  } catch (const std::exception& error) {
    throw BadInput("--baseline: " + file + ": " + error.what());
  }
  return json;
}

measure::Plan plan_of(const CompareArguments& arguments,
                      const std::vector<scenes::SceneDesc>& scenes) {
  const std::vector<measure::CompareOptions> options = options_by_scene(arguments, scenes);
  std::vector<measure::SceneCost> costs;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    costs.push_back(measure::probe(scenes[i], options[i]));
  }
  const measure::Fixed fixed = {.reps = arguments.reps.has_value(),
                                .steps = arguments.steps.has_value(),
                                .frames = arguments.frames.has_value()};
  const double limit_s =
      arguments.quick ? std::min(kQuickSeconds, arguments.max_seconds) : arguments.max_seconds;
  return measure::make_plan(costs, options, fixed, limit_s);
}

// Runs the plan; fills results["scenes"] and says what was found as it goes.
void run_plan(const measure::Plan& plan, const std::vector<scenes::SceneDesc>& scenes,
              measure::HostLoad& host, Json& results) {
  Progress progress;
  double done_s = 0;
  for (std::size_t i = 0; i < scenes.size() && !InterruptGuard::interrupted(); ++i) {
    progress.set_title(fmt::format("{} ({}/{})", scenes[i].name, i + 1, scenes.size()));
    const measure::Watcher watcher =
        progress.watcher().part(done_s / plan.total_s, (done_s + plan.seconds[i]) / plan.total_s);
    const measure::SceneComparison comparison =
        measure::compare_scene(scenes[i], plan.options[i], host, watcher);
    done_s += plan.seconds[i];
    progress.clear();
    print_comparison(comparison);
    report::add(results, comparison);
  }
}

int print_baseline(const CompareArguments& arguments, const Json& before, const Json& now) {
  const report::BaselineComparison changes =
      report::compare_with_baseline(before, now, arguments.tolerance / 100);
  fmt::print("\nAgainst {} ({}): {} figures compared, {} changed beyond noise\n",
             arguments.baseline, before.at("machine").at("commit").get<std::string>(),
             changes.compared, changes.changes.size());
  if (!changes.same_machine) {
    fmt::print("  measured on another machine: only speed-ups are compared\n");
  }
  for (const report::Change& change : changes.changes) {
    fmt::print("  {} {}: {:.4g} -> {:.4g} ({:+.0f} %)\n", change.worse ? "WORSE " : "better",
               change.what, change.before, change.now, 100 * (change.now / change.before - 1));
  }
  return changes.regressed() ? kFailedCheck : kOk;
}

int compare(const CompareArguments& arguments) {
  const auto& names = arguments.scenes.empty() ? kDefaultScenes : arguments.scenes;
  std::vector<scenes::SceneDesc> scenes;
  for (const std::string& name : names) scenes.push_back(load(name));
  options_of(arguments);  // complains before anything is written
  const Json before = read_baseline(arguments.baseline);
  const std::filesystem::path directory = make_directory(arguments.directory);

  const measure::Machine machine = measure::this_machine();
  fmt::print("{}, {} cores, {}, {}, {}\n", machine.cpu, machine.cores, machine.simd,
             machine.compiler, machine.commit);
  const InterruptGuard guard;
  const std::int64_t begin_ns = measure::now_ns();
  measure::HostWork host;
  host.calibrate();
  const measure::Plan plan = plan_of(arguments, scenes);
  fmt::print("about {:.0f} s{}\n", plan.total_s, plan.cut.empty() ? "" : "; " + plan.cut);
  std::fflush(stdout);

  Json results = report::begin_results(arguments.command_line, plan.options.front());
  results["cut"] = plan.cut;
  run_plan(plan, scenes, host, results);
  if (!InterruptGuard::interrupted()) {
    for (const auto& cost : measure::scheduling_costs(plan.options.front())) {
      report::add(results, cost);
    }
  }
  results["interrupted"] = InterruptGuard::interrupted();
  results["seconds"] = 1e-9 * static_cast<double>(measure::now_ns() - begin_ns);
  const int traces = report::write_files(directory, results);
  fmt::print("\nwrote {}, results.json and {} traces\n", (directory / "report.html").string(),
             traces);
  const int status = before.is_null() ? kOk : print_baseline(arguments, before, results);
  return results.at("equal").get<bool>() ? status : kFailedCheck;
}

}  // namespace

void add_compare_command(CLI::App& app, Action& action, int argc, char** argv) {
  CLI::App* command = app.add_subcommand("compare", "The threading modes side by side");
  const auto a = std::make_shared<CompareArguments>();
  for (int i = 0; i < argc; ++i) a->command_line += (i > 0 ? " " : "") + std::string(argv[i]);
  const auto text = [&](const char* name, std::string& value, const char* what) {
    command->add_option(name, value, what)->capture_default_str();
  };
  command->add_option("SCENE", a->scenes, "Built-in names or files; default: a set of four");
  text("--workers", a->workers, "Threads that run the step, comma between; 0: automatic");
  text("--host-ms", a->host_ms, "Host work per frame, milliseconds");
  text("--host-shape", a->host_shape, "Host work as one serial block, as jobs, or mixed");
  text("--spin-us", a->spin_us, "Wait policy: spinning before a thread blocks, microseconds");
  text("--affinity", a->affinity, "Where threads run: spread, none, or both with a comma");
  text("--wake-ahead-ms", a->wake_ahead_ms, "Early wake of workers before a step; 0: none");
  command->add_option("--reps", a->reps, "Repetitions, rows interleaved; default 5")
      ->check(CLI::Range(1, 1000));
  command->add_option("--steps", a->steps, "Steps to time per repetition; default 30")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000}));
  command
      ->add_option("--frames", a->frames,
                   "Frames per repetition, mode and host load; default 15; 0: no frame part")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1'000'000}));
  command
      ->add_option("--max-seconds", a->max_seconds,
                   "What was not fixed by --reps, --steps and --frames is cut to stay below")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  command->add_flag("--quick", a->quick, "Less of everything, about 40 s");
  command->add_flag("--modes-only", a->modes_only,
                    "Without other schedulers and without varied settings");
  text("--out", a->directory, "Directory for report.html, results.json and traces");
  command->add_option("--baseline", a->baseline,
                      "An earlier results.json: say what changed, exit 1 on a regression");
  command->add_option("--tolerance", a->tolerance, "Change that is never one, percent")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->callback([a, &action] { action = [a] { return compare(*a); }; });
}

}  // namespace skerry::app
