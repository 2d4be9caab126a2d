// skerry compare: the threading modes side by side.
#include <fmt/core.h>
#include <filesystem>
#include <memory>

#include "apps/measure/machine_load.h"
#include "apps/skerry/arguments.h"
#include "apps/skerry/commands.h"
#include "apps/skerry/json_output.h"
#include "apps/skerry/terminal.h"

namespace skerry::app {
namespace {

struct CompareArguments {
  std::vector<std::string> scenes;
  int workers = 0;
  std::string host_ms = "0,2,4,8";
  int reps = 3;
  std::uint64_t steps = 60;
  std::uint64_t frames = 90;
  std::string affinity = "spread";
  std::string directory;
};

// One of each kind: nothing to do, many islands, one flat island, one deep island.
const std::vector<std::string> kDefaultScenes = {"tiny", "islands", "many_pyramids", "box_bricks"};

// More of the machine than this in other hands shows in the figures.
constexpr double kDisturbing = 0.03;

std::string verdict_word(const measure::ThroughputRow& row) {
  if (!row.first_difference) return "equal";
  return fmt::format("DIFFERS from step {}", *row.first_difference);
}

void print_throughput(const measure::SceneComparison& comparison) {
  fmt::print("  {:<22} {:>7} {:>9} {:>9} {:>9} {:>12}  {}\n", "mode", "workers", "step p50",
             "p99 ms", "speed-up", "CPU ms/step", "state");
  for (const measure::ThroughputRow& row : comparison.throughput) {
    fmt::print("  {:<22} {:>7} {:>9.3f} {:>9.3f} {:>9.2f} {:>12.3f}  {}\n", to_string(row.mode),
               row.workers, row.step_ms.p50, row.step_ms.p99, row.speed_up, row.cpu_ms_per_step,
               verdict_word(row));
  }
}

void print_frames(const measure::SceneComparison& comparison) {
  double host_ms = -1;
  for (const measure::FrameRow& row : comparison.frames) {
    if (row.host_ms != host_ms) {
      host_ms = row.host_ms;
      fmt::print("  {:<22} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>12}\n",
                 fmt::format("{:.0f} Hz, {:g} ms host work", 1 / comparison.dt, host_ms),
                 "frame p50", "p99 ms", "missed", "age ms", "blocked", "helped", "CPU ms/frame");
    }
    const measure::FrameSamples& samples = row.samples;
    const auto frames = static_cast<double>(std::max<std::size_t>(1, samples.frames()));
    const measure::Summary latency = measure::summarize(samples.latency_ms);
    fmt::print("    {:<20} {:>9.2f} {:>9.2f} {:>7.0f} % {:>9.2f} {:>9.2f} {:>9.2f} {:>12.2f}\n",
               to_string(row.mode), latency.p50, latency.p99,
               100 * static_cast<double>(samples.missed) / frames,
               measure::median(samples.state_age_ms), measure::mean(samples.blocked_ms),
               measure::mean(samples.helped_ms), samples.cpu_ms / frames);
  }
}

void print_comparison(const measure::SceneComparison& comparison) {
  fmt::print(
      "\n{}: {} bodies, {} contacts, {} islands (largest {}), {} steps after {}, {} "
      "repetitions, sleeping off\n",
      comparison.scene, comparison.bodies, comparison.contacts, comparison.islands,
      comparison.largest_island, comparison.steps, comparison.warmup, comparison.reps);
  if (comparison.reps > 0) print_throughput(comparison);
  print_frames(comparison);
  for (const std::string& sentence : comparison.verdict) fmt::print("  * {}\n", sentence);
  std::fflush(stdout);
}

measure::CompareOptions options_of(const CompareArguments& arguments) {
  measure::CompareOptions options;
  options.workers = arguments.workers;
  options.host_ms = parse_milliseconds("--host-ms", arguments.host_ms);
  options.reps = arguments.reps;
  options.steps = arguments.steps;
  options.frames = arguments.frames;
  options.affinity = parse_affinity(arguments.affinity);
  return options;
}

void make_directory(const std::string& directory) {
  if (directory.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (!std::filesystem::is_directory(directory)) {
    throw BadInput("--out: cannot make the directory " + directory);
  }
  check_writable((std::filesystem::path(directory) / "results.json").string());
}

Json options_json(const CompareArguments& arguments, const measure::CompareOptions& options) {
  return {{"workers", options.workers},     {"host_ms", options.host_ms},
          {"reps", options.reps},           {"steps", options.steps},
          {"warmup", options.warmup},       {"frames", options.frames},
          {"affinity", arguments.affinity}, {"spin_us", options.wait.spin_us},
          {"sleep", options.sleep}};
}

int compare(const CompareArguments& arguments) {
  const measure::CompareOptions options = options_of(arguments);
  const auto& names = arguments.scenes.empty() ? kDefaultScenes : arguments.scenes;
  std::vector<scenes::SceneDesc> all;
  for (const std::string& name : names) all.push_back(load(name));
  make_directory(arguments.directory);

  const measure::Machine machine = measure::this_machine();
  fmt::print("{}, {} cores, {}, {}, {}\n", machine.cpu, machine.cores, machine.simd,
             machine.compiler, machine.commit);
  const InterruptGuard guard;
  const measure::MachineLoad load;
  measure::HostWork host;
  host.calibrate();
  Json results = {{"format", "skerry-compare"},  {"version", 1},
                  {"machine", to_json(machine)}, {"options", options_json(arguments, options)},
                  {"interrupted", false},        {"equal", true},
                  {"scenes", Json::array()}};
  bool equal = true;
  for (std::size_t i = 0; i < all.size() && !InterruptGuard::interrupted(); ++i) {
    measure::SceneComparison comparison;
    {
      Progress progress(fmt::format("{} ({}/{})", all[i].name, i + 1, all.size()));
      comparison = measure::compare_scene(all[i], options, host, progress.watcher());
    }
    print_comparison(comparison);
    equal = equal && comparison.equal();
    results["scenes"].push_back(to_json(comparison));
  }
  results["interrupted"] = InterruptGuard::interrupted();
  results["equal"] = equal;
  results["other_load"] = load.others_share();
  if (load.others_share() > kDisturbing) {
    fmt::print(
        "\nThe machine was not idle: other programs (or the hypervisor) took {:.0f} % of its "
        "processor time; figures are less certain.\n",
        100 * load.others_share());
  }
  if (!arguments.directory.empty()) {
    const auto file = (std::filesystem::path(arguments.directory) / "results.json").string();
    write_text(file, results.dump(2) + "\n");
    fmt::print("\nwrote {}\n", file);
  }
  return equal ? kOk : kFailedCheck;
}

}  // namespace

void add_compare_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("compare", "The threading modes side by side");
  const auto a = std::make_shared<CompareArguments>();
  command->add_option("SCENE", a->scenes, "Built-in names or files; default: a set of four");
  command->add_option("--workers", a->workers, "Threads that run the step; 0: automatic")
      ->check(CLI::Range(0, kMaxWorkers));
  command->add_option("--host-ms", a->host_ms, "Host work per frame, milliseconds")
      ->capture_default_str();
  command->add_option("--reps", a->reps, "Repetitions of the throughput part")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--steps", a->steps, "Steps to time per repetition")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000}))
      ->capture_default_str();
  command->add_option("--frames", a->frames, "Frames per mode and host load; 0: no frame part")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1'000'000}))
      ->capture_default_str();
  command->add_option("--affinity", a->affinity, "Where threads run: spread or none")
      ->capture_default_str();
  command->add_option("--out", a->directory, "Directory for results.json")->check(needs_name());
  command->callback([a, &action] { action = [a] { return compare(*a); }; });
}

}  // namespace skerry::app
