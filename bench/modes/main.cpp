// Every threading mode on every speed scene, as Google Benchmark rows; a row whose state differs from
// serial's fails. `skerry compare` tells more (frames, age of the state); this is for tools that read
// Google Benchmark's output. Options are Google Benchmark's, for example
//   --benchmark_filter=islands --benchmark_enable_random_interleaving=true --benchmark_out=modes.json
#include <benchmark/benchmark.h>

#include <map>
#include <string>

#include "apps/measure/machine.h"
#include "apps/measure/process_meter.h"
#include "apps/measure/session.h"
#include "scenes/catalogue.h"

namespace {

using skerry::ThreadingMode;
using skerry::WorldSettings;
using namespace skerry::measure;

constexpr int kWarmup = 30;
constexpr int kSteps = 60;

const skerry::scenes::SceneDesc& scene_of(const std::string& name) {
  static std::map<std::string, skerry::scenes::SceneDesc> made;
  const auto found = made.find(name);
  return found != made.end() ? found->second
                             : made.emplace(name, skerry::scenes::make_scene(name)).first->second;
}

WorldSettings settings_of(const skerry::scenes::SceneDesc& scene, ThreadingMode mode, int workers) {
  WorldSettings settings = skerry::scenes::world_settings(scene);
  settings.mode = mode;
  settings.workers = workers;
  settings.sleep.enabled = false;
  settings.affinity = skerry::Affinity::spread;
  return settings;
}

// Serial's state after the steps that every row makes.
std::uint64_t reference(const std::string& name) {
  static std::map<std::string, std::uint64_t> known;
  const auto found = known.find(name);
  if (found != known.end()) return found->second;
  const auto& scene = scene_of(name);
  Session session(scene, settings_of(scene, ThreadingMode::serial, 1), scene.defaults.dt);
  for (int i = 0; i < kWarmup + kSteps; ++i) session.advance();
  return known[name] = session.world().state_hash();
}

void run_mode(benchmark::State& state, const std::string& name, ThreadingMode mode, int workers) {
  const std::uint64_t expected = reference(name);
  const auto& scene = scene_of(name);
  Session session(scene, settings_of(scene, mode, workers), scene.defaults.dt);
  for (int i = 0; i < kWarmup; ++i) session.advance();
  const std::uint64_t allocations = allocation_count();
  for (auto _ : state) session.advance();
  state.counters["allocations"] = benchmark::Counter(
      static_cast<double>(allocation_count() - allocations), benchmark::Counter::kAvgIterations);
  state.counters["contacts"] = session.world().last_report().contacts;
  if (session.world().state_hash() != expected)
    state.SkipWithError("the state differs from serial's");
}

void register_rows() {
  for (const char* scene : {"large_pyramid", "many_pyramids", "box_pile", "box_bricks",
                            "sphere_rain", "convex_pile", "islands"}) {
    for (const ThreadingMode mode : kAllModes) {
      const int workers = effective_workers(mode, 0);
      const std::string name =
          std::string(scene) + "/" + to_string(mode) + "/workers:" + std::to_string(workers);
      benchmark::RegisterBenchmark(name.c_str(),
                                   [scene, mode, workers](benchmark::State& state) {
                                     run_mode(state, scene, mode, workers);
                                   })
          ->Iterations(kSteps)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime()
          ->MeasureProcessCPUTime();
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Machine machine = this_machine();
  benchmark::AddCustomContext("cpu", machine.cpu);
  benchmark::AddCustomContext("compiler", machine.compiler);
  benchmark::AddCustomContext("flags", machine.flags);
  benchmark::AddCustomContext("commit", machine.commit);
  register_rows();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
