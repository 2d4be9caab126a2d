#include "jobs/serial_executor.h"

#include <algorithm>
#include <vector>

#include "jobs/recorder.h"
#include "jobs/run_state.h"

namespace skerry::jobs {
namespace {

class SerialTask final : public Task {
 public:
  // With `timed` it finds out what phase programs would gain from more workers.
  SerialTask(const std::stop_token& stop, bool timed) : stop_(stop), timed_(timed) {}
  std::uint32_t worker() const override { return 0; }
  std::int64_t spared_ns() const { return spared_ns_; }
  void run_phases(PhaseProgram& program) override {
    const std::uint32_t phases = program.phase_count();
    for (std::uint32_t phase = 0; phase < phases; ++phase) {
      if (stop_.stop_requested()) throw Cancelled();
      const std::uint32_t blocks = program.block_count(phase);
      if (timed_) {
        run_timed(program, phase, blocks);
      } else {
        for (std::uint32_t block = 0; block < blocks; ++block) program.run_block(phase, block, 0);
      }
    }
  }

 private:
  void run_timed(PhaseProgram& program, std::uint32_t phase, std::uint32_t blocks) {
    std::int64_t longest_ns = 0;
    const std::int64_t begin_ns = core::now_ns();
    std::int64_t now_ns = begin_ns;
    for (std::uint32_t block = 0; block < blocks; ++block) {
      const std::int64_t block_begin_ns = now_ns;
      program.run_block(phase, block, 0);
      now_ns = core::now_ns();
      longest_ns = std::max(longest_ns, now_ns - block_begin_ns);
    }
    spared_ns_ += now_ns - begin_ns - longest_ns;
  }

  const std::stop_token& stop_;
  const bool timed_;
  std::int64_t spared_ns_ = 0;
};

class SerialExecutor final : public MadeInEnd {
 public:
  std::uint32_t worker_count() const override { return 1; }

 private:
  // Fills the report however the run ends.
  struct EndRun {
    ~EndRun() { recorder.end_run(); }
    Recorder& recorder;
  };

  void make_run(const Pending& run) override {
    recorder_.begin_run(*run.graph, run.options.report);
    const EndRun end_run{recorder_};
    run_stages(run);
  }

  void run_stages(const Pending& run) {
    const TaskGraph& graph = *run.graph;
    const auto stages = graph.stages();
    items_.resize(stages.size());
    for (std::uint32_t i = 0; i < stages.size(); ++i) {
      const std::uint32_t head = graph.chain_head(i);
      if (head != i) {
        items_[i] = items_[head];
      } else {
        if (run.options.stop.stop_requested()) throw Cancelled();
        items_[i] = stages[i].count ? stages[i].count(run.context) : 1;
      }
      recorder_.items(i, items_[i]);
      run_stage(run, i, stages[i]);
    }
  }

  void run_stage(const Pending& run, std::uint32_t index, const Stage& stage) {
    for (std::uint32_t first = 0; first < items_[index];) {
      if (run.options.stop.stop_requested()) throw Cancelled();
      const IndexRange items{first, first + std::min(stage.chunk, items_[index] - first)};
      SerialTask task(run.options.stop, recorder_.keeps_tasks());
      const std::int64_t begin_ns = recorder_.now();
      stage.kernel(run.context, items, task);
      recorder_.kernel(0, index, items, begin_ns, recorder_.now(), task.spared_ns());
      first = items.end;
    }
  }

  Recorder recorder_{1};
  std::vector<std::uint32_t> items_;  // [stage]
};

}  // namespace

std::unique_ptr<Executor> make_serial_executor() { return std::make_unique<SerialExecutor>(); }

}  // namespace skerry::jobs
