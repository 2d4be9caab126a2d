// skerry run: one scene in one threading mode, every step timed.
#include <fmt/core.h>
#include <memory>
#include <optional>

#include "apps/measure/process_meter.h"
#include "apps/measure/statistics.h"
#include "apps/skerry/arguments.h"
#include "apps/skerry/commands.h"
#include "apps/skerry/json_output.h"
#include "apps/skerry/terminal.h"

namespace skerry::app {
namespace {

struct RunArguments {
  std::string scene;
  std::string mode = "serial", solver;
  int workers = 0;
  std::optional<std::uint64_t> steps, warmup, seed;
  std::optional<double> dt;
  std::optional<int> substeps;
  bool no_sleep = false, measure = false;
  std::string json_file, trace_file;
  std::uint64_t hash_every = 0;
};

// The parser's range check lets NaN through.
double checked_dt(double dt) {
  if (dt >= 1e-6 && dt <= 1) return dt;
  throw BadInput(fmt::format("--dt: must be between 1e-06 and 1 s, got {}", dt));
}

measure::RunOptions options_of(const RunArguments& arguments, const scenes::SceneDesc& scene) {
  measure::RunOptions options;
  options.settings = scenes::world_settings(scene);
  options.settings.mode = parse_mode(arguments.mode);
  options.settings.workers = arguments.workers;
  options.settings.record_tasks = !arguments.trace_file.empty();
  if (!arguments.solver.empty()) options.settings.solver.kind = parse_solver(arguments.solver);
  if (arguments.measure) options.settings.measure_steps = true;
  if (arguments.substeps) options.settings.solver.substeps = *arguments.substeps;
  if (arguments.no_sleep) options.settings.sleep.enabled = false;
  options.dt = arguments.dt ? checked_dt(*arguments.dt) : scene.defaults.dt;
  options.steps = arguments.steps.value_or(scene.defaults.steps);
  options.warmup = arguments.warmup.value_or(scene.defaults.warmup);
  options.hash_every = arguments.hash_every;
  options.keep_tasks = options.settings.record_tasks;
  return options;
}

void print_warnings(const std::vector<std::string>& warnings, std::FILE* out) {
  constexpr std::size_t kShown = 5;
  for (std::size_t i = 0; i < std::min(kShown, warnings.size()); ++i) {
    fmt::print(out, "  warning  {}\n", warnings[i]);
  }
  if (warnings.size() > kShown) {
    fmt::print(out, "  warning  ... and {} more\n", warnings.size() - kShown);
  }
}

void print_measures(const measure::RunMeasures& run, std::FILE* out) {
  fmt::print(out, "  steps    penetration mean {:.3f} max {:.3f} mm, energy {:.6g} to {:.6g} J\n",
             1e3 * run.penetration_mean, 1e3 * run.penetration_max, run.energy_first,
             run.energy_last);
  const ContactLaw& law = run.law;
  fmt::print(out,
             "  contacts took {:.6g} J; off their law by mean/max: normal {:.2g}/{:.2g}, friction "
             "{:.2g}/{:.2g}, cone {:.2g}/{:.2g}\n",
             run.energy_lost, law.normal_mean, law.normal_max, law.friction_mean, law.friction_max,
             law.cone_mean, law.cone_max);
}

void print_summary(const RunIdentity& identity, const measure::RunResult& result, std::FILE* out) {
  const measure::Summary step = measure::summarize(result.step_ms);
  const auto steps = static_cast<double>(std::max<std::size_t>(1, result.step_ms.size()));
  fmt::print(out, "{}: {} steps{} of {:.6g} s, {}, {} worker{}{}\n", identity.scene,
             result.step_ms.size(),
             identity.warmup > 0 ? fmt::format(" after {}", identity.warmup) : "", identity.dt,
             to_string(identity.mode), identity.workers, identity.workers == 1 ? "" : "s",
             result.interrupted ? ", INTERRUPTED" : "");
  if (identity.solver != SolverKind::soft_step_tgs) {
    fmt::print(out, "  solver   {}\n", to_string(identity.solver));
  }
  fmt::print(out, "  {} bodies, {} awake, {} contacts, {} islands, largest {}\n", result.bodies,
             result.last.awake_bodies, result.last.contacts, result.last.islands,
             result.last.largest_island);
  fmt::print(out, "  step     mean {:.3f}  p50 {:.3f}  p95 {:.3f}  p99 {:.3f}  max {:.3f} ms\n",
             step.mean, step.p50, step.p95, step.p99, step.max);
  for (const measure::StageMean& stage : result.stages) {
    fmt::print(out, "    {:<22} {:8.3f} ms\n", stage.name, stage.wall_ms);
  }
  fmt::print(out, "  process  {:.3f} ms CPU and {:.1f} allocations per step, peak {:.0f} MB\n",
             result.cpu_ms / steps, static_cast<double>(result.allocations) / steps,
             measure::peak_rss_mb());
  fmt::print(out, "  state    penetration mean {:.3f} max {:.3f} mm, kinetic energy {:.6g} J\n",
             1e3 * result.measures.penetration_mean, 1e3 * result.measures.penetration_max,
             result.measures.kinetic_energy);
  if (result.measured.steps > 0) print_measures(result.measured, out);
  print_warnings(result.warnings, out);
  fmt::print(out, "  hash     {}\n", report::hash_text(result.state_hash));
}

int run_scene_command(const RunArguments& arguments) {
  const scenes::SceneDesc scene = load(arguments.scene, arguments.seed);
  const measure::RunOptions options = options_of(arguments, scene);
  check_writable(arguments.json_file);
  check_writable(arguments.trace_file);

  const RunIdentity identity = {
      .scene = scene.name,
      .mode = options.settings.mode,
      .workers = measure::effective_workers(options.settings.mode, arguments.workers),
      .solver = options.settings.solver.kind,
      .substeps = options.settings.solver.substeps,
      .dt = options.dt,
      .warmup = options.warmup,
      .seed = arguments.seed.value_or(scenes::kDefaultSeed),
      .sleep = options.settings.sleep.enabled};
  const InterruptGuard guard;
  measure::RunResult result;
  {
    Progress progress(scene.name);
    result = measure::run_scene(scene, options, progress.watcher());
  }
  // JSON on standard output stays clean.
  print_summary(identity, result, arguments.json_file == "-" ? stderr : stdout);
  if (!arguments.json_file.empty()) {
    write_text(arguments.json_file, to_json(identity, result).dump(2) + "\n");
  }
  if (!arguments.trace_file.empty()) {
    write_text(arguments.trace_file, to_trace(identity, result).dump() + "\n");
  }
  return kOk;
}

}  // namespace

void add_run_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("run", "Run a scene and time every step");
  const auto a = std::make_shared<RunArguments>();
  command->add_option("SCENE", a->scene, "Built-in name (see `skerry scenes`) or file")->required();
  command
      ->add_option("--mode", a->mode,
                   "serial, dedicated_thread, dedicated_thread_jobs, fork_join or job_system")
      ->capture_default_str();
  command->add_option("--workers", a->workers, "Threads that run the step; 0: automatic")
      ->check(CLI::Range(0, kMaxWorkers));
  command->add_option("--steps", a->steps, "Steps to time; default: the scene's")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000}));
  command->add_option("--warmup", a->warmup, "Steps before them, not timed")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1'000'000'000}));
  command->add_option("--dt", a->dt, "Seconds per step");
  command->add_option("--solver", a->solver, "soft_step_tgs, pgs or penalty; default: the scene's");
  command->add_option("--substeps", a->substeps, "Solver substeps")->check(CLI::Range(1, 64));
  command->add_flag("--measure", a->measure,
                    "Energy, penetration and contact law of every timed step");
  command->add_flag("--no-sleep", a->no_sleep, "Bodies never sleep");
  command->add_option("--seed", a->seed, "Of the scene's jitter")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{0xffffffff}));
  command->add_option("--json", a->json_file, "Write all figures to this file; -: standard output")
      ->check(needs_name());
  command->add_option("--trace", a->trace_file, "Write a Chrome trace of the timed steps' tasks")
      ->check(needs_name());
  command
      ->add_option("--hash-every", a->hash_every, "State hash every N steps, in the JSON; 0: none")
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1'000'000'000}));
  command->callback([a, &action] { action = [a] { return run_scene_command(*a); }; });
}

}  // namespace skerry::app
