#include "tests/support/shuffling_executor.h"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "core/clock.h"

namespace skerry::test {

using jobs::IndexRange;
using jobs::Stage;

class ShufflingExecutor::ShuffledTask : public jobs::Task {
 public:
  ShuffledTask(ShufflingExecutor& executor, std::uint32_t worker)
      : executor_(executor), worker_(worker) {}
  std::uint32_t worker() const override { return worker_; }
  void run_phases(jobs::PhaseProgram& program) override {
    for (std::uint32_t phase = 0; phase < program.phase_count(); ++phase) {
      std::vector<std::uint32_t> blocks(program.block_count(phase));
      std::iota(blocks.begin(), blocks.end(), 0);
      std::shuffle(blocks.begin(), blocks.end(), executor_.random_);
      for (const std::uint32_t block : blocks) {
        program.run_block(phase, block, executor_.draw(executor_.shuffle_.workers));
      }
    }
  }

 private:
  ShufflingExecutor& executor_;
  std::uint32_t worker_;
};

ShufflingExecutor::ShufflingExecutor(const Shuffle& shuffle)
    : shuffle_(shuffle), random_(shuffle.seed) {
  if (shuffle.workers == 0) throw std::invalid_argument("ShufflingExecutor: no workers");
}

void ShufflingExecutor::run(const jobs::TaskGraph& graph, void* context,
                            const jobs::RunOptions& options) {
  begin(graph, context, options);
  end();
}

void ShufflingExecutor::begin(const jobs::TaskGraph& graph, void* context,
                              const jobs::RunOptions& options) {
  if (graph_) throw std::logic_error("executor: a run is in progress");
  graph_ = &graph;
  context_ = context;
  options_ = options;
  stages_.assign(graph.stages().size(), {});
  ready_.clear();
}

void ShufflingExecutor::end() {
  if (!graph_) throw std::logic_error("executor: end() without begin()");
  fill_report();
  struct Leave {
    ~Leave() {
      executor.graph_ = nullptr;
      if (executor.options_.report) executor.options_.report->end_ns = core::now_ns();
    }
    ShufflingExecutor& executor;
  } leave{*this};
  for (release_stages(); !ready_.empty(); release_stages()) {
    std::swap(ready_[draw(static_cast<std::uint32_t>(ready_.size()))], ready_.back());
    const Ready next = ready_.back();
    ready_.pop_back();
    run_task(next);
    release_followers(next);
  }
}

// Stages without items finish as they are released, and may release others.
void ShufflingExecutor::release_stages() {
  for (std::uint32_t i = 0; i < stages_.size(); ++i) {
    if (!stages_[i].released && may_release(i)) release(i);
  }
}

bool ShufflingExecutor::may_release(std::uint32_t stage) const {
  if (graph_->follows_per_item(stage)) return stages_[graph_->chain_head(stage)].released;
  for (std::uint32_t i = 0; i < stage; ++i) {
    if (graph_->depends(stage, i) && !stages_[i].is_finished()) return false;
  }
  return true;
}

void ShufflingExecutor::release(std::uint32_t stage) {
  const Stage& what = graph_->stages()[stage];
  StageState& state = stages_[stage];
  const std::uint32_t head = graph_->chain_head(stage);
  if (head != stage) {
    state.items = stages_[head].items;
  } else {
    state.items = what.count ? what.count(context_) : 1;
  }
  state.released = true;
  state.chunks = state.items / what.chunk + (state.items % what.chunk != 0);
  state.chunk_finished.assign(state.chunks, false);
  for (std::uint32_t i = 0; i < state.chunks; ++i) {
    if (head == stage || chunk_may_follow(stage, i)) ready_.push_back({stage, i});
  }
  if (options_.report) options_.report->stages[stage].items = state.items;
}

// A chunk of a chain follows when the same chunk of all that it depends on in the chain is done.
bool ShufflingExecutor::chunk_may_follow(std::uint32_t stage, std::uint32_t chunk) const {
  for (const std::uint32_t earlier : graph_->chain(graph_->chain_head(stage))) {
    if (!graph_->depends(stage, earlier)) continue;
    if (!stages_[earlier].released || !stages_[earlier].chunk_finished[chunk]) return false;
  }
  return true;
}

void ShufflingExecutor::release_followers(const Ready& done) {
  for (const std::uint32_t stage : graph_->chain(graph_->chain_head(done.stage))) {
    if (stages_[stage].released && graph_->depends(stage, done.stage) &&
        chunk_may_follow(stage, done.chunk)) {
      ready_.push_back({stage, done.chunk});
    }
  }
}

void ShufflingExecutor::run_task(const Ready& ready) {
  if (options_.stop.stop_requested()) throw jobs::Cancelled();
  maybe_sleep();
  const Stage& what = graph_->stages()[ready.stage];
  StageState& state = stages_[ready.stage];
  const std::uint32_t first = ready.chunk * what.chunk;
  const IndexRange items{first, first + std::min(what.chunk, state.items - first)};
  ShuffledTask task(*this, draw(shuffle_.workers));
  const std::int64_t begin_ns = core::now_ns();
  what.kernel(context_, items, task);
  state.chunk_finished[ready.chunk] = true;
  ++state.finished;
  if (!options_.report) return;
  jobs::StageTiming& timing = options_.report->stages[ready.stage];
  if (timing.tasks++ == 0) timing.begin_ns = begin_ns;
  timing.end_ns = core::now_ns();
  timing.busy_ns += timing.end_ns - begin_ns;
}

void ShufflingExecutor::maybe_sleep() {
  if (shuffle_.longest_sleep_us == 0 || draw(8) != 0) return;
  std::this_thread::sleep_for(std::chrono::microseconds(draw(shuffle_.longest_sleep_us + 1)));
}

// Not std::uniform_int_distribution: its results differ between libraries.
std::uint32_t ShufflingExecutor::draw(std::uint32_t below) {
  return static_cast<std::uint32_t>(random_() % below);
}

void ShufflingExecutor::fill_report() {
  if (!options_.report) return;
  jobs::RunReport& report = *options_.report;
  report.stages.assign(stages_.size(), {});
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    report.stages[i].name = graph_->stages()[i].name;
  }
  report.tasks.clear();
  report.begin_ns = core::now_ns();
}

}  // namespace skerry::test
