#include "jobs/serial_executor.h"

#include <algorithm>
#include <vector>

#include "jobs/recorder.h"
#include "jobs/run_state.h"

namespace skerry::jobs {
namespace {

class SerialTask final : public Task {
 public:
  explicit SerialTask(const std::stop_token& stop) : stop_(stop) {}
  std::uint32_t worker() const override { return 0; }
  void run_phases(PhaseProgram& program) override {
    const std::uint32_t phases = program.phase_count();
    for (std::uint32_t phase = 0; phase < phases; ++phase) {
      if (stop_.stop_requested()) throw Cancelled();
      const std::uint32_t blocks = program.block_count(phase);
      for (std::uint32_t block = 0; block < blocks; ++block) program.run_block(phase, block, 0);
    }
  }

 private:
  const std::stop_token& stop_;
};

class SerialExecutor final : public Executor {
 public:
  void run(const TaskGraph& graph, void* context, const RunOptions& options) override {
    begin(graph, context, options);
    end();
  }

  void begin(const TaskGraph& graph, void* context, const RunOptions& options) override {
    state_.enter();
    pending_ = {&graph, context, options};
  }

  void end() override {
    state_.check_begun();
    const LeaveRun leave(state_);
    recorder_.begin_run(*pending_.graph, pending_.options.report);
    const EndRun end_run{*this};
    run_stages();
  }

  std::uint32_t worker_count() const override { return 1; }

 private:
  // Fills the report however the run ends.
  struct EndRun {
    ~EndRun() {
      executor.recorder_.end_run();
      executor.pending_ = {};
    }
    SerialExecutor& executor;
  };

  void run_stages() {
    const TaskGraph& graph = *pending_.graph;
    const auto stages = graph.stages();
    items_.resize(stages.size());
    for (std::uint32_t i = 0; i < stages.size(); ++i) {
      const std::uint32_t head = graph.chain_head(i);
      if (head != i) {
        items_[i] = items_[head];
      } else {
        if (pending_.options.stop.stop_requested()) throw Cancelled();
        items_[i] = stages[i].count ? stages[i].count(pending_.context) : 1;
      }
      recorder_.items(i, items_[i]);
      run_stage(i, stages[i]);
    }
  }

  void run_stage(std::uint32_t index, const Stage& stage) {
    SerialTask task(pending_.options.stop);
    for (std::uint32_t first = 0; first < items_[index];) {
      if (pending_.options.stop.stop_requested()) throw Cancelled();
      const IndexRange items{first, first + std::min(stage.chunk, items_[index] - first)};
      const std::int64_t begin_ns = recorder_.now();
      stage.kernel(pending_.context, items, task);
      recorder_.kernel(0, index, items, begin_ns, recorder_.now());
      first = items.end;
    }
  }

  RunState state_;
  Pending pending_;
  Recorder recorder_{1};
  std::vector<std::uint32_t> items_;  // [stage]
};

}  // namespace

std::unique_ptr<Executor> make_serial_executor() { return std::make_unique<SerialExecutor>(); }

}  // namespace skerry::jobs
