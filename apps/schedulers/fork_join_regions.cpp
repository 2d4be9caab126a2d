#include "apps/schedulers/fork_join_regions.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <utility>

#include "jobs/machine.h"
#include "jobs/recorder.h"
#include "jobs/run_state.h"

namespace skerry::schedulers {
namespace {

// The first exception that comes stops what has not begun.
class Failure {
 public:
  template <class Work>
  void guard(const Work& work) {
    if (failed_.load(std::memory_order_relaxed)) return;
    try {
      work();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failed_.exchange(true)) error_ = std::current_exception();
    }
  }
  void rethrow() {
    if (failed_.exchange(false)) std::rethrow_exception(std::exchange(error_, nullptr));
  }

 private:
  std::atomic<bool> failed_{false};
  std::mutex mutex_;
  std::exception_ptr error_;
};

// Phases are loops too, unless a loop over chunks is on its way already: then they run here.
class ForkJoinTask final : public jobs::Task {
 public:
  ForkJoinTask(Regions* regions, std::uint32_t worker) : regions_(regions), worker_(worker) {}
  std::uint32_t worker() const override { return worker_; }
  void run_phases(jobs::PhaseProgram& program) override {
    const std::uint32_t phases = program.phase_count();
    for (std::uint32_t phase = 0; phase < phases; ++phase) {
      const std::uint32_t blocks = program.block_count(phase);
      if (!regions_ || blocks < 2) {
        for (std::uint32_t i = 0; i < blocks; ++i) program.run_block(phase, i, worker_);
        continue;
      }
      Failure failure;
      regions_->loop(blocks, [&](std::uint32_t block, std::uint32_t worker) {
        failure.guard([&] { program.run_block(phase, block, worker); });
      });
      failure.rethrow();
    }
  }

 private:
  Regions* regions_;
  std::uint32_t worker_;
};

class ForkJoin final : public jobs::MadeInEnd {
 public:
  ForkJoin(std::unique_ptr<Regions> regions, jobs::Affinity affinity)
      : regions_(std::move(regions)), affinity_(affinity), recorder_(regions_->workers()) {}

  std::uint32_t worker_count() const override { return regions_->workers(); }

 private:
  void make_run(const jobs::Pending& run) override {
    const jobs::PinScope pin(affinity_ == jobs::Affinity::spread ? processors_[0] : -1);
    recorder_.begin_run(*run.graph, run.options.report);
    for (std::uint32_t i = 0; i < run.graph->stages().size(); ++i) {
      if (run.options.stop.stop_requested()) failure_.guard([] { throw jobs::Cancelled(); });
      run_stage(run, i);
    }
    recorder_.end_run();
    failure_.rethrow();
  }

  void run_stage(const jobs::Pending& run, std::uint32_t index) {
    const jobs::Stage& stage = run.graph->stages()[index];
    std::uint32_t items = 0;
    failure_.guard([&] { items = stage.count ? stage.count(run.context) : 1; });
    recorder_.items(index, items);
    const std::uint32_t chunks = items / stage.chunk + (items % stage.chunk != 0);
    const auto run_chunk = [&](std::uint32_t chunk, std::uint32_t worker, Regions* regions) {
      failure_.guard([&] {
        const std::uint32_t first = chunk * stage.chunk;
        const jobs::IndexRange range{first, std::min(first + stage.chunk, items)};
        ForkJoinTask task(regions, worker);
        const std::int64_t begin_ns = recorder_.now();
        stage.kernel(run.context, range, task);
        recorder_.kernel(worker, index, range, begin_ns, recorder_.now());
      });
    };
    if (chunks == 1) return run_chunk(0, 0, regions_.get());
    if (chunks > 1) {
      regions_->loop(chunks, [&](std::uint32_t chunk, std::uint32_t worker) {
        run_chunk(chunk, worker, nullptr);
      });
    }
  }

  std::unique_ptr<Regions> regions_;
  jobs::Affinity affinity_;
  std::vector<int> processors_ = jobs::allowed_processors();
  jobs::Recorder recorder_;
  Failure failure_;
};

}  // namespace

std::unique_ptr<jobs::Executor> make_fork_join(std::unique_ptr<Regions> regions,
                                               const jobs::ExecutorSettings& settings) {
  return std::make_unique<ForkJoin>(std::move(regions), settings.affinity);
}

}  // namespace skerry::schedulers
