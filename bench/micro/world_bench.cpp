// What stages of whole steps cost, on one thread, where one number alone would say little.
//
//   plate      500 boxes side by side on a slab: of one body, or of 500 (`compound` 1 or 0)
//     plate_add    putting them into a world, and taking them out again
//     plate_rest   at rest: 500 touching pairs
//     plate_fly    thrown, nothing near: new fat boxes every few steps, no pairs
//   slide      1,000 boxes slide without friction at `speed` (m/s; fast from some 8 on) over flat
//              ground: a box (0), a mesh of 100,352 triangles (1), a height field of as many (2)
//
//   skerry_bench_micro --benchmark_filter='^(plate|slide)'
#include <algorithm>
#include <array>
#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <skerry/world.h>

#include "scenes/geometry.h"

namespace {

using namespace skerry;

constexpr double kDt = 1.0 / 60;
constexpr int kColumns = 25, kRows = 20;  // of a plate
constexpr int kChildren = kColumns * kRows;
constexpr double kHalf = 0.2, kSpacing = 0.5;  // m

// What stages took in ten steps in a row, the least of all such tens: what else the machine does only
// adds, and what happens every few steps is in each.
class StageMinima {
 public:
  void add(const StepReport& report) {
    step_ms_ += report.step_ms;
    for (std::size_t i = 0; i < report.stages().size(); ++i) {
      names_[i] = report.stages()[i].name;
      stage_ms_[i] += report.stages()[i].cpu_ms;
    }
    contacts_ = report.contacts;
    if (++steps_ % kSteps != 0) return;
    least_step_ms_ = std::min(least_step_ms_, std::exchange(step_ms_, 0));
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const double ms = std::exchange(stage_ms_[i], 0);
      least_ms_[i] = steps_ == kSteps ? ms : std::min(least_ms_[i], ms);
    }
  }
  // Per step.
  double us(std::initializer_list<std::string_view> stages) const {
    double sum = 0;
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (std::ranges::count(stages, names_[i])) sum += least_ms_[i];
    return 1e3 * sum / kSteps;
  }
  double step_us() const { return 1e3 * least_step_ms_ / kSteps; }
  std::uint32_t contacts() const { return contacts_; }

 private:
  static constexpr int kSteps = 10;
  std::array<std::string_view, StepReport::kMaxStages> names_ = {};
  std::array<double, StepReport::kMaxStages> stage_ms_ = {}, least_ms_ = {};
  double step_ms_ = 0, least_step_ms_ = 1e9;
  std::uint32_t contacts_ = 0;  // of the last step
  int steps_ = 0;
};

void run(benchmark::State& state, World& world, int warm_up) {
  for (int i = 0; i < warm_up; ++i) world.step(kDt);
  StageMinima minima;
  for (auto _ : state) {
    const StepReport& report = world.step(kDt);
    state.SetIterationTime(1e-3 * report.step_ms);
    minima.add(report);
  }
  state.counters["step_us"] = minima.step_us();
  state.counters["bounds_us"] = minima.us({"update_bounds"});
  state.counters["broadphase_us"] = minima.us({"refit_broadphase", "query_pairs", "merge_pairs"});
  state.counters["narrowphase_us"] = minima.us({"narrowphase"});
  state.counters["sweeps_us"] = minima.us({"find_fast", "sweep_fast", "stop_fast"});
  state.counters["solve_us"] = minima.us({"build_islands", "solve_islands"});
  state.counters["contacts"] = minima.contacts();
}

// ---- Plates.

std::vector<Vec3> places() {
  std::vector<Vec3> all;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column)
      all.push_back(
          {kSpacing * (column - 0.5 * (kColumns - 1)), 0, kSpacing * (row - 0.5 * (kRows - 1))});
  return all;
}

// The bodies of a plate whose centre is at `height`.
std::vector<BodyDesc> plate(bool compound, double height, const Vec3& linear, const Vec3& angular) {
  BodyDesc body = {.linear_velocity = linear, .angular_velocity = angular, .allow_sleep = false};
  std::vector<BodyDesc> bodies;
  for (const Vec3& place : places()) {
    const Box box = {.half_extents = {kHalf, kHalf, kHalf}};
    if (compound) {
      body.shapes.push_back({box, {.local_pose = {.position = place}}});
    } else {
      body.shapes = {box};
      body.position = place + Vec3(0, height, 0);
      bodies.push_back(body);
    }
  }
  body.position = {0, height, 0};
  if (compound) bodies.push_back(body);
  return bodies;
}

void plate_add(benchmark::State& state) {
  const std::vector<BodyDesc> bodies = plate(state.range(0) != 0, 1, {0, 0, 0}, {0, 0, 0});
  double least_add = 1e9, least_remove = 1e9;
  for (auto _ : state) {
    World world;
    std::vector<BodyId> ids;
    const auto begin = std::chrono::steady_clock::now();
    for (const BodyDesc& body : bodies) ids.push_back(world.add_body(body));
    const auto added = std::chrono::steady_clock::now();
    for (const BodyId id : ids) world.remove_body(id);
    const auto removed = std::chrono::steady_clock::now();
    const auto us = [](auto from, auto to) {
      return std::chrono::duration<double, std::micro>(to - from).count();
    };
    least_add = std::min(least_add, us(begin, added));
    least_remove = std::min(least_remove, us(added, removed));
    state.SetIterationTime(1e-6 * us(begin, removed));
  }
  state.counters["add_us"] = least_add;
  state.counters["remove_us"] = least_remove;
}

void plate_rest(benchmark::State& state) {
  World world;
  world.add_body({.type = BodyType::fixed,
                  .shapes = {Box{.half_extents = {50, 1, 50}}},
                  .position = {0, -1, 0}});
  for (const BodyDesc& body : plate(state.range(0) != 0, kHalf, {0, 0, 0}, {0, 0, 0}))
    world.add_body(body);
  run(state, world, 60);
}

void plate_fly(benchmark::State& state) {
  World world({.gravity = {0, 0, 0}});
  for (const BodyDesc& body : plate(state.range(0) != 0, 0, {3, 4, 2}, {0, 0, 0}))
    world.add_body(body);
  run(state, world, 60);
}

// ---- Slides.

enum Ground { box_ground, mesh_ground, field_ground };

Shape ground_shape(Ground ground) {
  constexpr int kCells = 224;
  if (ground == box_ground)
    return Shape(Box{.half_extents = {kCells, 1, kCells}},
                 {.local_pose = {.position = {0, -1, 0}}});
  if (ground == mesh_ground)
    return TriangleMesh{std::make_shared<MeshData>(scenes::wavy_ground(kCells, kCells, 0, 0))};
  auto field = std::make_shared<HeightFieldData>();
  field->columns = field->rows = kCells + 1;
  field->heights.assign(std::size_t{field->columns} * field->rows, 0);
  return Shape(HeightField{std::move(field)},
               {.local_pose = {.position = {-kCells / 2.0, 0, -kCells / 2.0}}});
}

void slide(benchmark::State& state) {
  World world;
  world.add_body({.type = BodyType::fixed,
                  .shapes = {ground_shape(static_cast<Ground>(state.range(0)))},
                  .friction = 0});
  for (int x = 0; x < 40; ++x)
    for (int z = 0; z < 25; ++z)
      world.add_body({.shapes = {Box{.half_extents = {0.3, 0.3, 0.3}}},
                      .position = {1.5 * x - 100, 0.3, 1.5 * z - 18},
                      .linear_velocity = {double(state.range(1)), 0, 0},
                      .friction = 0,
                      .allow_sleep = false});
  run(state, world, 10);
}

BENCHMARK(plate_add)
    ->ArgName("compound")
    ->Arg(0)
    ->Arg(1)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(plate_rest)
    ->ArgName("compound")
    ->Arg(0)
    ->Arg(1)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(plate_fly)
    ->ArgName("compound")
    ->Arg(0)
    ->Arg(1)
    ->UseManualTime()
    ->Iterations(400)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(slide)
    ->ArgNames({"ground", "speed"})
    ->ArgsProduct({{box_ground, mesh_ground, field_ground}, {2, 15}})
    ->UseManualTime()
    ->Iterations(40)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
