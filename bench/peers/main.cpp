// The same scenes in Skerry, Bullet and ODE: time of a step and quality of the result.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "bench/peers/report.h"
#include "scenes/catalogue.h"

namespace skerry::peers {
namespace {

const std::vector<std::string> kScenes = {"large_pyramid", "many_pyramids", "box_pile",
                                          "box_bricks",    "sphere_rain",   "convex_pile",
                                          "islands"};
// Until then the spheres fall and settle; after it they lie still.
constexpr std::uint64_t kSphereRainSteps = 432;

constexpr SolverKind kSolvers[] = {SolverKind::soft_step_tgs, SolverKind::pgs, SolverKind::penalty};

// That run unless others are asked for.
std::vector<std::string> engine_names() {
  std::vector<std::string> names = {"skerry"};
  if (SKERRY_HAVE_BULLET) names.emplace_back("bullet");
  if (SKERRY_HAVE_ODE) names.emplace_back("ode");
  return names;
}

// And the engine's other solvers.
std::vector<std::string> all_names() {
  std::vector<std::string> names = engine_names();
  for (const SolverKind solver : kSolvers) {
    const std::string name = skerry_info(solver).name;
    if (name != "skerry") names.push_back(name);
  }
  return names;
}

struct Arguments {
  std::vector<std::string> scenes = kScenes;
  std::vector<std::string> engines = engine_names();
  std::vector<int> workers = {1, 2};
  std::uint64_t steps = 0;
  RaceOptions race;
  std::string ode_space = "sap";
  std::string json_file;
};

void declare(CLI::App& app, Arguments& arguments) {
  app.add_option("--scenes", arguments.scenes, "names, separated by commas")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--engines", arguments.engines, "names, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(all_names()));
  app.add_option("--workers", arguments.workers, "rows of Skerry: 1 is serial, more a job system")
      ->delimiter(',')
      ->check(CLI::Range(1, 1024));
  app.add_option("--steps", arguments.steps, "at most so many; 0: as many as the scene asks for");
  app.add_option("--reps", arguments.race.reps, "repetitions; times are medians over them")
      ->check(CLI::Range(1, 1000));
  app.add_option("--slice", arguments.race.slice, "steps before the next engine has its turn")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--ode-space", arguments.ode_space, "broadphase of ODE: hash or sap")
      ->check(CLI::IsMember({"hash", "sap"}))
      ->capture_default_str();
  app.add_option("--json", arguments.json_file, "file to write the rows to");
}

std::vector<Contestant> contestants_of(const Arguments& arguments) {
  std::vector<Contestant> contestants;
  for (const std::string& name : arguments.engines) {
    for (const SolverKind solver : kSolvers) {
      if (name != skerry_info(solver).name) continue;
      for (const int workers : arguments.workers) {
        contestants.push_back(
            {skerry_info(solver), workers, [=] { return make_skerry(workers, solver); }});
      }
    }
#if SKERRY_HAVE_BULLET
    if (name == "bullet") contestants.push_back({bullet_info(), 1, make_bullet});
#endif
#if SKERRY_HAVE_ODE
    if (name == "ode") {
      const OdeSpace space =
          arguments.ode_space == "sap" ? OdeSpace::sweep_and_prune : OdeSpace::hash;
      contestants.push_back({ode_info(space), 1, [=] { return make_ode(space); }});
    }
#endif
  }
  return contestants;
}

std::uint64_t steps_of(const PeerScene& scene, std::uint64_t limit) {
  const std::string& name = scene.source.name;
  const std::uint64_t own = name == "sphere_rain" ? kSphereRainSteps : scene.source.defaults.steps;
  return limit == 0 ? own : std::min(own, limit);
}

void write_json(const std::string& path, const nlohmann::json& result) {
  std::ofstream file(path);
  file << result.dump(1) << '\n';
  if (!file.flush()) throw std::runtime_error("cannot write " + path);
}

void run(const Arguments& arguments) {
  const std::vector<Contestant> contestants = contestants_of(arguments);
  nlohmann::json result = about(contestants, arguments.race);
  result["rows"] = nlohmann::json::array();
  fmt::print("{}\n", table_header());
  for (const std::string& name : arguments.scenes) {
    const PeerScene scene = make_peer_scene(scenes::make_scene(name));
    RaceOptions options = arguments.race;
    options.steps = steps_of(scene, arguments.steps);
    for (const auto& row : rows_of(scene, race(scene, contestants, options), options)) {
      fmt::print("{}\n", table_line(row));
      result["rows"].push_back(row);
    }
    std::fflush(stdout);
    // After every scene: a run that is broken off leaves what it has.
    if (!arguments.json_file.empty()) write_json(arguments.json_file, result);
  }
}

}  // namespace
}  // namespace skerry::peers

int main(int argc, char** argv) {
  CLI::App app("Steps the same scenes in Skerry and in other engines, in turn.");
  skerry::peers::Arguments arguments;
  skerry::peers::declare(app, arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    skerry::peers::run(arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "skerry_bench_peers: {}\n", error.what());
    return 1;
  }
}
