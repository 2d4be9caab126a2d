// What the contact solver costs per manifold, by instruction set, on one thread.
//
//   solve/<scene>/<kernels>   solve_islands over one step (gather, prepare, 4 substeps, store, finish)
//     pyramids   many_pyramids: 196 islands, 28,420 manifolds of four points
//     stacks     islands: 4,096 islands, 20,480 manifolds
//     pyramid    large_pyramid: one island, 14,950 manifolds
//   kernel/<pass>/<kernels>   one kernel over a group of 1,024 manifolds of four points, in cache
//
//   skerry_bench_micro --benchmark_filter='^(solve|kernel)/'       (column ns_per_manifold)
#include <functional>
#include <memory>

#include <benchmark/benchmark.h>

#include "bench/micro/contact_world.h"

namespace skerry::bench {
namespace {

using solver::ContactKernels;
using solver::ContactPass;

void report_per_manifold(benchmark::State& state, double seconds, std::size_t manifolds) {
  state.counters["ns_per_manifold"] =
      1e9 * seconds / (static_cast<double>(state.iterations()) * static_cast<double>(manifolds));
}

double seconds_of(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// ---- A whole solve.

void solve(benchmark::State& state, void (*build)(ContactWorld&), const ContactKernels* kernels) {
  ContactWorld world;
  build(world);
  world.scratch->kernels = kernels;
  world.step(3);
  SerialTask task;
  const core::StepContext step = world.context();
  double total = 0;
  for (auto _ : state) {
    world.collide();
    solver::build_islands(step, {0, 1}, task);
    const double seconds = seconds_of([&] {
      const auto groups = static_cast<std::uint32_t>(world.islands.groups.size());
      solver::solve_islands(step, {0, groups}, task);
    });
    state.SetIterationTime(seconds);
    total += seconds;
  }
  report_per_manifold(state, total, world.islands.contacts.size());
}

// ---- One kernel.

class KernelGroup {
 public:
  static constexpr std::uint32_t kManifolds = 1024, kRows = 768;

  explicit KernelGroup(const ContactKernels& kernels)
      : kernel(kernels.kind[static_cast<std::size_t>(solver::ContactKind::points4)]),
        width(kernels.width),
        blocks(kManifolds / width),
        manifolds_(kManifolds),
        memory_(std::make_unique<Line[]>(blocks * kernel.block_bytes / sizeof(Line) + 1)) {
    set_rows();
    for (std::uint32_t i = 0; i < kManifolds; ++i) set_manifold(manifolds_[i]);
    for (std::uint32_t block = 0; block < blocks; ++block) set_lanes(block);
  }

  void prepare() {
    for (std::uint32_t block = 0; block < blocks; ++block)
      kernel.prepare(pass, inputs_[block], at(block));
  }
  void store() {
    for (std::uint32_t block = 0; block < blocks; ++block) kernel.store(at(block), outputs_[block]);
  }
  void* memory() { return memory_.get(); }

  const ContactKernels::OfKind& kernel;
  std::uint32_t width, blocks;
  ContactPass pass;

 private:
  struct alignas(64) Line {
    std::byte bytes[64];
  };

  void* at(std::uint32_t block) { return memory_.get()->bytes + block * kernel.block_bytes; }

  void set_rows() {
    velocity_.assign(kRows, {{0, 0, 0}, 0, {0, 0, 0}, 0});
    start_ = velocity_;
    delta_.assign(kRows, {{0, 0, 0}, 0, {0, 0, 0, 1}});
    mass_.assign(kRows, {0.01f, {0.06f, 0, 0, 0.06f, 0, 0.06f}, 0});
    base_.assign(kRows, {{0, -10, 0}, 0, {0, 0, 0, 1}});
    pass.velocity = velocity_.data();
    pass.start = start_.data();
    pass.delta = delta_.data();
    pass.mass = mass_.data();
    pass.base = base_.data();
    pass.dynamic_end = kRows;
    pass.substep = 1.0f / 240;
    pass.inv_substep = 240;
    pass.max_push = 3;
    pass.soft = {10, 0.9f, 0.1f};
    pass.soft_load = 5;
  }

  static void set_manifold(core::Manifold& manifold) {
    manifold.normal = {0, 1, 0};
    manifold.point_count = 4;
    for (int i = 0; i < 4; ++i) {
      manifold.points[i] = {{i & 1 ? 0.5f : -0.5f, 0.5f, i & 2 ? 0.5f : -0.5f}, -0.001f};
      manifold.normal_impulse[i] = 1;
    }
    manifold.friction = 0.6f;
  }

  // Lanes of a block share no row, as within a colour.
  void set_lanes(std::uint32_t block) {
    solver::LaneInput& input = inputs_.emplace_back(solver::LaneInput{});
    solver::LaneOutput& output = outputs_.emplace_back();
    for (std::uint32_t k = 0; k < width; ++k) {
      const std::uint32_t i = block * width + k;
      input.manifold[k] = reinterpret_cast<const float*>(&manifolds_[i]);
      output.manifold[k] = reinterpret_cast<float*>(&manifolds_[i]);
      input.row_a[k] = 1 + (2 * i) % (kRows - 2);
      input.row_b[k] = 2 + (2 * i) % (kRows - 2);
      input.offset[0][k] = input.offset[2][k] = 0;
      input.offset[1][k] = 1;
    }
  }

  std::vector<core::Manifold> manifolds_;
  std::unique_ptr<Line[]> memory_;
  std::vector<solver::LaneInput> inputs_;
  std::vector<solver::LaneOutput> outputs_;
  std::vector<solver::VelocityRow> velocity_, start_;
  std::vector<solver::DeltaRow> delta_;
  std::vector<solver::MassRow> mass_;
  std::vector<solver::BaseRow> base_;
};

using Pass = void (*)(KernelGroup&);

void run_kernel(benchmark::State& state, Pass run, const ContactKernels* kernels) {
  KernelGroup group(*kernels);
  group.prepare();
  const double seconds = seconds_of([&] {
    for (auto _ : state) run(group);
  });
  report_per_manifold(state, seconds, KernelGroup::kManifolds);
}

struct NamedScene {
  const char* name;
  void (*build)(ContactWorld&);
};
constexpr NamedScene kScenes[] = {
    {"pyramids", [](ContactWorld& world) { build_pyramids(world, 14, 14, 10); }},
    {"stacks", [](ContactWorld& world) { build_stacks(world, 64, 64, 5); }},
    {"pyramid", [](ContactWorld& world) { build_pyramids(world, 1, 1, 100); }},
};
struct NamedPass {
  const char* name;
  Pass run;
};
constexpr NamedPass kPasses[] = {
    {"prepare", [](KernelGroup& g) { g.prepare(); }},
    {"warm_start", [](KernelGroup& g) { g.kernel.warm_start(g.pass, g.memory(), g.blocks); }},
    {"solve", [](KernelGroup& g) { g.kernel.solve(g.pass, g.memory(), g.blocks); }},
    {"relax", [](KernelGroup& g) { g.kernel.relax(g.pass, g.memory(), g.blocks); }},
    {"store", [](KernelGroup& g) { g.store(); }},
};

const bool registered = [] {
  std::vector<const ContactKernels*> all;
  for (const auto* list = solver::simd_kernels(); *list; ++list) all.push_back(*list);
  all.push_back(solver::reference_kernels(16));
  for (const ContactKernels* kernels : all) {
    for (const NamedScene& scene : kScenes) {
      const std::string name = std::string("solve/") + scene.name + '/' + kernels->name;
      benchmark::RegisterBenchmark(name.c_str(), solve, scene.build, kernels)
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond);
    }
    for (const NamedPass& pass : kPasses) {
      const std::string name = std::string("kernel/") + pass.name + '/' + kernels->name;
      benchmark::RegisterBenchmark(name.c_str(), run_kernel, pass.run, kernels)
          ->Unit(benchmark::kMicrosecond);
    }
  }
  return true;
}();

}  // namespace
}  // namespace skerry::bench
