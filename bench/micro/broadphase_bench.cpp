// What the broadphase costs per body and step, all its stages on one thread unless said otherwise, by kind.
//
//   resting   2D pyramids of unit boxes, 20 wide, on one ground box; nothing moves, all are awake
//   falling   a 1.2 m grid of unit boxes at -5 m/s: most pairs persist, every box moves
//   mixing    the same grid, every box with its own velocity of up to 5 m/s: pairs come and go
//   shared    the pair search of mixing, shared out to one and to two workers as in a step: wall time of
//             each stage and of all, in the mean and at most, of 120 steps after 8; for each step the
//             least of five runs. Boxes are enlarged in bursts: all began as one
//   sleepers  resting, asleep, with 100 falling boxes among them: what bystanders cost (per body
//             that falls)
//
//   skerry_bench_micro --benchmark_filter=broadphase
#include <algorithm>
#include <ctime>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <skerry/jobs/executor.h>

#include "collision/broadphase.h"

namespace {

using namespace skerry;
using collision::Broadphase;

class OneWorker final : public core::Task {
 public:
  std::uint32_t worker() const override { return 0; }
  void run_phases(jobs::PhaseProgram& program) override {
    for (std::uint32_t phase = 0; phase < program.phase_count(); ++phase)
      for (std::uint32_t block = 0; block < program.block_count(phase); ++block)
        program.run_block(phase, block, 0);
  }
};

struct BenchWorld {
  core::Bodies bodies;
  core::Colliders colliders;
  core::ContactTable contacts;
  core::Joints joints;
  std::unique_ptr<Broadphase> broadphase;
  OneWorker task;

  explicit BenchWorld(BroadphaseKind kind) : broadphase(collision::make_broadphase(kind)) {}

  core::BodyIndex add_box(std::uint32_t flags, const Vec3& center, const core::V3f& half) {
    const core::BodyIndex body = core::take_row(bodies);
    bodies.flags[body] |= flags;
    bodies.pose[body].center = center;
    bodies.first_collider[body] = static_cast<core::ColliderIndex>(colliders.rows.size());
    core::Collider collider;
    collider.alive = true;
    collider.type = core::ShapeType::box;
    collider.body = body;
    collider.size = half;
    colliders.rows.push_back(collider);
    bodies.awake_stale = true;
    return body;
  }

  void add_all() {
    for (core::BodyIndex body = 0; body < bodies.rows(); ++body)
      broadphase->add(bodies, colliders, body);
    core::refresh_awake(bodies);
  }

  core::StepContext context_of_step() {
    core::StepContext context;
    context.dt = 1.0 / 60;
    context.bodies = &bodies;
    context.colliders = &colliders;
    context.contacts = &contacts;
    context.joints = &joints;
    context.broadphase = broadphase.get();
    return context;
  }

  void step() {
    const core::StepContext context = context_of_step();
    collision::update_bounds(context, {0, static_cast<std::uint32_t>(bodies.awake.size())}, task);
    collision::refit_broadphase(context, {0, 1}, task);
    collision::query_pairs(context, {0, broadphase->moved_count()}, task);
    collision::merge_pairs(context, {0, 1}, task);
  }

  void fly() {
    for (const core::BodyIndex body : bodies.awake)
      bodies.pose[body].center += bodies.motion[body].linear / 60;
  }
};

constexpr core::V3f kUnit = {0.5f, 0.5f, 0.5f};
constexpr std::uint32_t kFlying = core::kDynamic | core::kAwake;

void build_pyramids(BenchWorld& world, int count, std::uint32_t flags) {
  world.add_box(0, {0, -1, 0}, {1000, 1, 1000});
  constexpr int kBase = 20;
  const int pyramids = count / (kBase * (kBase + 1) / 2);
  for (int p = 0; p < pyramids; ++p)
    for (int row = 0; row < kBase; ++row)
      for (int i = 0; i < kBase - row; ++i)
        world.add_box(flags, {24.0 * (p % 8) + i + 0.5 * row, 0.5 + row, 3.0 * (p / 8)}, kUnit);
}

void build_grid(BenchWorld& world, int count) {
  const int side = static_cast<int>(std::lround(std::cbrt(count)));
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z) world.add_box(kFlying, {1.2 * x, 1.2 * y, 1.2 * z}, kUnit);
}

// The stages run on one thread, so its processor time is what they cost; unlike wall time it does
// not count what else the machine does.
double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Times the broadphase alone; `per` bodies share it.
void run(benchmark::State& state, BenchWorld& world, std::size_t per) {
  world.add_all();
  for (int i = 0; i < 8; ++i) {
    world.fly();
    world.step();
  }
  std::uint64_t steps = 0, moved = 0;
  double seconds = 0;
  for (auto _ : state) {
    world.fly();
    const double begin = thread_seconds();
    world.step();
    const double took = thread_seconds() - begin;
    state.SetIterationTime(took);
    seconds += took;
    ++steps;
    moved += world.broadphase->moved_count();
  }
  const double items = static_cast<double>(steps) * static_cast<double>(per);
  state.counters["ns_per_body"] = 1e9 * seconds / items;
  state.counters["moved_part"] = static_cast<double>(moved) / items;
  state.counters["pairs"] = static_cast<double>(world.contacts.pairs.size());
}

BroadphaseKind kind_of(const benchmark::State& state) {
  return static_cast<BroadphaseKind>(state.range(1));
}

void broadphase_resting(benchmark::State& state) {
  BenchWorld world(kind_of(state));
  build_pyramids(world, static_cast<int>(state.range(0)), kFlying);
  run(state, world, world.bodies.rows());
}

void broadphase_falling(benchmark::State& state) {
  BenchWorld world(kind_of(state));
  build_grid(world, static_cast<int>(state.range(0)));
  for (core::BodyMotion& motion : world.bodies.motion) motion.linear = {0, -5, 0};
  run(state, world, world.bodies.rows());
}

void give_speeds(BenchWorld& world) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> speed(-5, 5);
  for (core::BodyMotion& motion : world.bodies.motion)
    motion.linear = {speed(random), speed(random), speed(random)};
}

void broadphase_mixing(benchmark::State& state) {
  BenchWorld world(kind_of(state));
  build_grid(world, static_cast<int>(state.range(0)));
  give_speeds(world);
  run(state, world, world.bodies.rows());
}

template <void (*kernel)(const core::StepContext&, core::IndexRange, core::Task&)>
void of_step(void* context, core::IndexRange items, core::Task& task) {
  kernel(*static_cast<const core::StepContext*>(context), items, task);
}

// Each stage waits for the one before.
jobs::TaskGraph pair_search() {
  const auto awake = [](void* context) {
    const core::Bodies& bodies = *static_cast<const core::StepContext*>(context)->bodies;
    return static_cast<std::uint32_t>(bodies.awake.size());
  };
  const auto moved = [](void* context) {
    return static_cast<const core::StepContext*>(context)->broadphase->moved_count();
  };
  jobs::TaskGraph graph;
  graph.stage({"update_bounds", 1, of_step<collision::update_bounds>, awake, 512, 0, 1});
  graph.stage({"refit", jobs::kOnce, of_step<collision::refit_broadphase>, nullptr, 1, 0, 1});
  graph.stage({"query", 2, of_step<collision::query_pairs>, moved, 128, 0, 1});
  graph.stage({"merge", jobs::kOnce, of_step<collision::merge_pairs>, nullptr, 1, 0, 1});
  return graph;
}

// What each stage took (us), and the whole, in each step.
using StageTimes = std::vector<std::vector<double>>;

// Least of what it took in this run and in those before, whose steps were the same.
void keep_least(StageTimes& least, const StageTimes& run) {
  if (least.empty()) least = run;
  for (std::size_t step = 0; step < run.size(); ++step)
    for (std::size_t i = 0; i < run[step].size(); ++i)
      least[step][i] = std::min(least[step][i], run[step][i]);
}

StageTimes share_out(int bodies, int workers) {
  constexpr int kFirst = 8, kSteps = 120;
  BenchWorld world(BroadphaseKind::tree);
  build_grid(world, bodies);
  give_speeds(world);
  world.add_all();
  const auto executor = jobs::make_executor(
      workers == 1 ? jobs::ExecutorKind::serial : jobs::ExecutorKind::job_system,
      {.workers = workers});
  core::StepContext context = world.context_of_step();
  context.worker_count = executor->worker_count();
  const jobs::TaskGraph graph = pair_search();
  jobs::RunReport report;
  StageTimes times;
  for (int step = 0; step < kFirst + kSteps; ++step) {
    world.fly();
    executor->run(graph, &context, {.report = &report});
    if (step < kFirst) continue;
    const auto us = [](const auto& timed) {
      return 1e-3 * static_cast<double>(timed.end_ns - timed.begin_ns);
    };
    times.emplace_back();
    for (const jobs::StageTiming& stage : report.stages) times.back().push_back(us(stage));
    times.back().push_back(us(report));
  }
  return times;
}

// One worker and two in turn.
void broadphase_shared(benchmark::State& state) {
  StageTimes least[2];
  for (auto _ : state)
    for (const int workers : {1, 2})
      keep_least(least[workers - 1], share_out(static_cast<int>(state.range(0)), workers));
  const jobs::TaskGraph graph = pair_search();
  for (std::size_t i = 0; i <= graph.stages().size(); ++i) {
    const std::string name = i < graph.stages().size() ? graph.stages()[i].name : "all";
    double sum[2] = {}, most[2] = {};
    for (int w = 0; w < 2; ++w)
      for (const std::vector<double>& step : least[w]) {
        sum[w] += step[i];
        most[w] = std::max(most[w], step[i]);
      }
    for (int w = 0; w < 2; ++w) {
      const std::string workers = name + "_x" + std::to_string(w + 1);
      state.counters[workers + "_us"] = sum[w] / static_cast<double>(least[w].size());
      state.counters[workers + "_max_us"] = most[w];
    }
    state.counters[name + "_speed_up"] = sum[0] / sum[1];
  }
}

void broadphase_sleepers(benchmark::State& state) {
  BenchWorld world(kind_of(state));
  build_pyramids(world, static_cast<int>(state.range(0)), core::kDynamic);
  for (int i = 0; i < 100; ++i) {
    const core::BodyIndex body = world.add_box(kFlying, {1.5 * i, 400, 0}, kUnit);
    world.bodies.motion[body].linear = {0, -5, 0};
  }
  run(state, world, 100);
}

#define SKERRY_BROADPHASE_BENCH(function)                                              \
  BENCHMARK(function)                                                                  \
      ->ArgNames({"bodies", "kind"})                                                   \
      ->ArgsProduct({{10000, 100000},                                                  \
                     {int(BroadphaseKind::tree), int(BroadphaseKind::sweep_and_prune), \
                      int(BroadphaseKind::fcl)}})                                      \
      ->UseManualTime()                                                                \
      ->Unit(benchmark::kMicrosecond)                                                  \
      ->MinTime(0.3)
SKERRY_BROADPHASE_BENCH(broadphase_resting);
SKERRY_BROADPHASE_BENCH(broadphase_falling);
SKERRY_BROADPHASE_BENCH(broadphase_mixing);
SKERRY_BROADPHASE_BENCH(broadphase_sleepers);
BENCHMARK(broadphase_shared)
    ->ArgName("bodies")
    ->Arg(100000)
    ->Unit(benchmark::kMillisecond)
    ->Iterations(5);

}  // namespace
