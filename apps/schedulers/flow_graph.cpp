// A oneTBB flow graph: one node per stage, an edge for every stage it waits for, parallel_for over
// the chunks inside the node.
#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "apps/schedulers/fork_join_regions.h"
#include "jobs/machine.h"
#include "jobs/recorder.h"
#include "jobs/run_state.h"

namespace skerry::schedulers {
namespace {

namespace tbb = oneapi::tbb;

std::uint32_t this_worker() {
  return static_cast<std::uint32_t>(std::max(0, tbb::this_task_arena::current_thread_index()));
}

class FlowTask final : public jobs::Task {
 public:
  std::uint32_t worker() const override { return this_worker(); }
  // Isolated: a thread that waits for blocks must not begin another chunk, whose kernel would use
  // the same scratch memory.
  void run_phases(jobs::PhaseProgram& program) override {
    const std::uint32_t phases = program.phase_count();
    for (std::uint32_t phase = 0; phase < phases; ++phase) {
      const std::uint32_t blocks = program.block_count(phase);
      tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(
            0u, blocks,
            [&](std::uint32_t block) { program.run_block(phase, block, this_worker()); },
            tbb::simple_partitioner());
      });
    }
  }
};

class FlowGraph final : public jobs::MadeInEnd {
 public:
  explicit FlowGraph(const jobs::ExecutorSettings& settings)
      : workers_(static_cast<std::uint32_t>(settings.workers)),
        spread_(settings.affinity == jobs::Affinity::spread),
        arena_(settings.workers, 1),
        recorder_(workers_) {
    if (tbb::info::default_concurrency() < settings.workers) {
      more_threads_.emplace(tbb::global_control::max_allowed_parallelism, settings.workers);
    }
    arena_.initialize();
  }

  std::uint32_t worker_count() const override { return workers_; }

 private:
  using Node = tbb::flow::continue_node<tbb::flow::continue_msg>;

  void make_run(const jobs::Pending& run) override {
    run_ = &run;
    if (built_for_ != run.graph) build();
    recorder_.begin_run(*run.graph, run.options.report);
    struct EndRun {
      ~EndRun() { recorder.end_run(); }
      jobs::Recorder& recorder;
    } const end_run{recorder_};
    const jobs::PinScope pin(spread_ ? processors_[0] : -1);
    arena_.execute([this] {
      start_->try_put({});
      graph_->wait_for_all();
    });
  }

  void build() {
    nodes_.clear();
    arena_.execute([this] {  // a graph belongs to the arena it is made in
      graph_ = std::make_unique<tbb::flow::graph>();
      start_ = std::make_unique<tbb::flow::broadcast_node<tbb::flow::continue_msg>>(*graph_);
    });
    const auto stages = static_cast<std::uint32_t>(run_->graph->stages().size());
    for (std::uint32_t i = 0; i < stages; ++i) {
      nodes_.push_back(std::make_unique<Node>(
          *graph_, [this, i](const tbb::flow::continue_msg&) { run_stage(i); }));
      bool waits = false;
      for (std::uint32_t j = 0; j < i; ++j) {
        if (!run_->graph->depends(i, j)) continue;
        tbb::flow::make_edge(*nodes_[j], *nodes_[i]);
        waits = true;
      }
      if (!waits) tbb::flow::make_edge(*start_, *nodes_[i]);
    }
    built_for_ = run_->graph;
  }

  void settle() {
    const std::uint32_t worker = this_worker();
    if (worker == 0) return;  // the caller
    jobs::settle_thread(spread_ ? processors_[worker % processors_.size()] : -1, processors_);
  }

  void run_stage(std::uint32_t index) {
    const jobs::Stage& stage = run_->graph->stages()[index];
    const std::uint32_t items = stage.count ? stage.count(run_->context) : 1;
    recorder_.items(index, items);
    const std::uint32_t chunks = items / stage.chunk + (items % stage.chunk != 0);
    const auto run_chunk = [&](std::uint32_t chunk) {
      settle();
      const std::uint32_t first = chunk * stage.chunk;
      const jobs::IndexRange range{first, std::min(first + stage.chunk, items)};
      FlowTask task;
      const std::uint32_t worker = this_worker();
      const std::int64_t begin_ns = recorder_.now();
      stage.kernel(run_->context, range, task);
      recorder_.kernel(worker, index, range, begin_ns, recorder_.now());
    };
    if (chunks == 1) return run_chunk(0);
    if (chunks > 1) {
      tbb::this_task_arena::isolate(
          [&] { tbb::parallel_for(0u, chunks, run_chunk, tbb::simple_partitioner()); });
    }
  }

  std::uint32_t workers_;
  bool spread_;
  std::vector<int> processors_ = jobs::allowed_processors();
  std::optional<tbb::global_control> more_threads_;
  tbb::task_arena arena_;
  const jobs::Pending* run_ = nullptr;  // what the nodes are to do, during a run
  jobs::Recorder recorder_;
  const jobs::TaskGraph* built_for_ = nullptr;
  std::unique_ptr<tbb::flow::graph> graph_;
  std::unique_ptr<tbb::flow::broadcast_node<tbb::flow::continue_msg>> start_;
  std::vector<std::unique_ptr<Node>> nodes_;
};

}  // namespace

std::unique_ptr<jobs::Executor> make_flow_graph(const jobs::ExecutorSettings& settings) {
  return std::make_unique<FlowGraph>(settings);
}

}  // namespace skerry::schedulers
