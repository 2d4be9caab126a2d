#include "jobs/graph_run.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "jobs/spin.h"

namespace skerry::jobs {
namespace {

// How long helpers that were woken early wait for the run to begin.
constexpr std::int64_t kAwakeNs = 2'000'000;

// Spinning longer than an hour is for ever.
std::int64_t spin_ns(const WaitPolicy& wait) {
  return static_cast<std::int64_t>(std::clamp(wait.spin_us, 0.0, 3.6e9) * 1000);
}

constexpr std::uint64_t bit_of(std::uint32_t stage) { return std::uint64_t{1} << (stage % 64); }

}  // namespace

// The runs that this thread is inside of. A helper source may run a ticket on such a thread; it
// would run chunks in the middle of another chunk, or just do what the thread does next anyhow.
class GraphRun::Inside {
 public:
  explicit Inside(const GraphRun* run) : run_(run), outer_(t_innermost) { t_innermost = this; }
  ~Inside() { t_innermost = outer_; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  static bool is_inside(const GraphRun* run) {
    for (const Inside* i = t_innermost; i; i = i->outer_) {
      if (i->run_ == run) return true;
    }
    return false;
  }

 private:
  static thread_local const Inside* t_innermost;
  const GraphRun* run_;
  const Inside* outer_;
};

thread_local const GraphRun::Inside* GraphRun::Inside::t_innermost = nullptr;

class GraphRun::KernelTask final : public Task {
 public:
  KernelTask(GraphRun& run, std::uint32_t worker, std::uint32_t stage, std::uint32_t first_item)
      : run_(run), worker_(worker), stage_(stage), first_item_(first_item) {}
  std::uint32_t worker() const override { return worker_; }
  void run_phases(PhaseProgram& program) override {
    run_.team_.run(program, worker_, {run_.ticket_name(stage_), stage_, first_item_});
  }

 private:
  GraphRun& run_;
  std::uint32_t worker_;
  std::uint32_t stage_;
  std::uint32_t first_item_;
};

GraphRun::GraphRun(std::uint32_t workers, const WaitPolicy& wait)
    : workers_(workers),
      shares_(std::min(workers, Share::kMost)),
      spin_ns_(spin_ns(wait)),
      indices_(workers),
      recorder_(workers),
      team_(workers, spin_ns_, *this, event_, recorder_) {
  boards_.push_back(std::make_unique<Board>(16, shares_));
  board_.store(boards_.back().get());
}

// ---- the caller ---------------------------------------------------------------------------------

void GraphRun::prepare(const TaskGraph& graph, void* context, const RunOptions& options) {
  const auto stages = static_cast<std::uint32_t>(graph.stages().size());
  Board* board = board_.load(std::memory_order_relaxed);
  if (board->states.size() < stages) {
    boards_.push_back(std::make_unique<Board>(
        std::max<std::uint32_t>(stages, 2 * board->states.size()), shares_));
    board = boards_.back().get();
    board_.store(board, std::memory_order_release);
  }
  for (std::uint32_t i = 0; i < stages; ++i) {
    board->states[i].waiting.store(graph.wait_count(i), std::memory_order_relaxed);
  }
  recorder_.begin_run(graph, options.report);
  graph_ = &graph;
  context_ = context;
  stop_ = options.stop;
  name_ = options.name;
  by_stage_ = false;
  first_shared_ = 0;
  counted_ = kNone;
  failure_ = nullptr;
  stop_seen_ = false;
  cancelled_.store(false, std::memory_order_relaxed);
  stages_left_.store(stages + 1, std::memory_order_relaxed);  // one for the start itself
}

void GraphRun::run_here() {
  const Inside inside(this);
  if (run_alone() == graph_->stages().size()) return;
  Released released;
  release_roots(released, true);
  if (released.wide) invite(released.opened_chunks - (released.here ? 0 : 1), released.wide);
  if (released.here) run_from(*released.here, 0);
  finish();
}

void GraphRun::start_away() {
  running_.store(true, std::memory_order_seq_cst);
  Released released;
  const char* first = graph_->stages().empty() ? "" : ticket_name(0);
  release_roots(released, false);
  const char* name = released.wide ? released.wide : first;
  if (released.opened_chunks > 0) invite(released.opened_chunks, name);
}

// All stages before the returned one have run here, one after the other, without a claim or a count
// that threads share: none of them had two chunks. Phase programs in them find helpers.
std::uint32_t GraphRun::run_alone() {
  const auto stages = static_cast<std::uint32_t>(graph_->stages().size());
  running_.store(true, std::memory_order_seq_cst);
  std::uint32_t stage = 0;
  for (; stage < stages; ++stage) {
    if (graph_->chain_head(stage) != stage) continue;  // has run behind its head
    if (count_chunks(stage) > 1) break;
    for (const std::uint32_t link : graph_->chain(stage)) run_stage_alone(link);
  }
  first_shared_ = stage;
  counted_ = stage;
  if (stage == stages) end_run();
  return stage;
}

void GraphRun::run_stage_alone(std::uint32_t stage) {
  if (state(stage).chunks > 0) run_kernel(stage, 0, 0);
  for (const std::uint32_t head : graph_->successors(stage)) {
    auto& waiting = state(head).waiting;
    waiting.store(waiting.load(std::memory_order_relaxed) - 1, std::memory_order_relaxed);
  }
  stages_left_.store(stages_left_.load(std::memory_order_relaxed) - 1, std::memory_order_relaxed);
}

// Releases the stages that wait for nothing. The count of stages left starts one too high, so that
// the run cannot end half way through this.
void GraphRun::release_roots(Released& released, bool may_keep) {
  const auto stages = static_cast<std::uint32_t>(graph_->stages().size());
  roots_
      .clear();  // all of them before the first release: others come to wait for nothing meanwhile
  for (std::uint32_t i = first_shared_; i < stages; ++i) {
    if (graph_->chain_head(i) != i || state(i).waiting.load(std::memory_order_relaxed) > 0)
      continue;
    roots_.push_back(i);
  }
  for (const std::uint32_t root : roots_) release(root, released, may_keep);
  if (stages_left_.fetch_sub(1, std::memory_order_acq_rel) == 1) end_run();
}

void GraphRun::finish() {
  const Inside inside(this);
  for (work(0); !is_over(); work(0)) {
    const std::int64_t begin_ns = recorder_.now();
    wait_for_work_or_end();
    recorder_.blocked(recorder_.now() - begin_ns);
  }
}

void GraphRun::conclude() {
  recorder_.end_run();
  stop_ = {};
  const std::exception_ptr failure = std::exchange(failure_, nullptr);
  if (failure) std::rethrow_exception(failure);
  if (stop_seen_) throw Cancelled();
}

std::uint32_t GraphRun::open_stage(std::uint32_t stage) {
  const Inside inside(this);
  by_stage_ = true;
  const std::uint32_t head = graph_->chain_head(stage);
  const std::uint32_t items = head == stage ? item_count(stage) : state(head).items;
  const std::uint32_t chunks = chunk_count(stage, items);
  state(stage).items = items;
  state(stage).chunks = chunks;
  recorder_.items(stage, items);
  if (chunks == 0) return 0;
  running_.store(true, std::memory_order_seq_cst);
  if (chunks == 1) {
    run_kernel(stage, 0, 0);
    end_run();
  } else {
    state(stage).unfinished.store(chunks, std::memory_order_relaxed);
    open(stage);
  }
  return chunks;
}

void GraphRun::participate_as_caller() {
  if (Inside::is_inside(this)) return;
  const Inside inside(this);
  serve(0);
}

void GraphRun::participate(std::uint32_t preferred_index) {
  if (Inside::is_inside(this)) return;
  const auto index = indices_.acquire(preferred_index);
  if (!index) return;
  {
    const Inside inside(this);
    serve(*index);
  }
  indices_.release(*index);
}

// ---- helpers ------------------------------------------------------------------------------------

void GraphRun::redeem_ticket(std::uint32_t preferred_index) {
  const bool inside_already = Inside::is_inside(this);
  do {
    if (!inside_already) participate(preferred_index);
    tickets_out_.fetch_sub(1, std::memory_order_seq_cst);
    // Work that came up while this thread still counted as being here: whoever opened it either
    // saw the ticket gone, or is seen now.
    std::atomic_thread_fence(std::memory_order_seq_cst);
  } while (!inside_already && has_work() && reserve_tickets(1) == 1);
}

void GraphRun::wake() {
  awake_until_ns_.store(core::now_ns() + kAwakeNs, std::memory_order_relaxed);
  invite(workers_ - 1, "wake");
}

void GraphRun::invite(std::uint32_t wanted, const char* name) {
  const std::uint32_t reserved = reserve_tickets(wanted);
  if (reserved == 0) return;
  const std::uint32_t refused = reserved - helpers_->invite(reserved, name);
  if (refused > 0) tickets_out_.fetch_sub(refused, std::memory_order_seq_cst);
}

std::uint32_t GraphRun::reserve_tickets(std::uint32_t wanted) {
  std::uint32_t out = tickets_out_.load(std::memory_order_seq_cst);
  while (true) {
    const std::uint32_t reserved = std::min(wanted, workers_ - 1 - out);
    if (reserved == 0) return 0;
    if (tickets_out_.compare_exchange_weak(out, out + reserved, std::memory_order_seq_cst)) {
      return reserved;
    }
  }
}

// ---- working ------------------------------------------------------------------------------------

// Chunks before programs: they need no barrier.
void GraphRun::work(std::uint32_t worker) {
  while (true) {
    if (const auto work = claim(worker)) {
      run_from(*work, worker);
    } else if (!team_.help(worker)) {
      return;
    }
  }
}

void GraphRun::serve(std::uint32_t worker) {
  do {
    work(worker);
  } while (spin_for_work());
}

std::optional<GraphRun::Work> GraphRun::claim(std::uint32_t worker) {
  Board& board = *board_.load(std::memory_order_acquire);
  for (std::uint32_t word = 0; word < board.open.size(); ++word) {
    std::uint64_t open = board.open[word].load(std::memory_order_acquire);
    for (; open; open &= open - 1) {
      const std::uint32_t stage = word * 64 + std::uint32_t(std::countr_zero(open));
      if (const auto work = claim_from(board, stage, worker)) return work;
    }
  }
  return std::nullopt;
}

std::optional<GraphRun::Work> GraphRun::claim_from(Board& board, std::uint32_t stage,
                                                   std::uint32_t worker) {
  ChunkShare* const shares = shares_of(board, stage);
  const std::uint32_t own = worker % shares_;
  if (const auto chunk = shares[own].chunks.take_front()) return Work{stage, *chunk};
  for (std::uint32_t i = 1; i < shares_; ++i) {
    const auto chunk = shares[(own + i) % shares_].chunks.take_back();
    if (chunk) return Work{stage, *chunk};
  }
  return std::nullopt;
}

bool GraphRun::has_work() const {
  Board& board = *board_.load(std::memory_order_acquire);
  for (std::uint32_t word = 0; word < board.open.size(); ++word) {
    std::uint64_t open = board.open[word].load(std::memory_order_relaxed);
    for (; open; open &= open - 1) {
      const auto* shares = shares_of(board, word * 64 + std::uint32_t(std::countr_zero(open)));
      for (std::uint32_t i = 0; i < shares_; ++i) {
        if (!shares[i].chunks.is_empty()) return true;
      }
    }
  }
  return team_.has_blocks();
}

void GraphRun::wait_for_work_or_end() {
  const auto ready = [this] { return is_over() || has_work(); };
  if (spin_until(ready, spin_ns_)) return;
  EventCount::Sleeper sleeper(event_);
  if (!ready()) sleeper.sleep();
}

// False when there was nothing for a while, or no run.
bool GraphRun::spin_for_work() {
  const auto begun = [this] { return !is_over(); };
  if (!begun()) {
    const std::int64_t awake_ns = awake_until_ns_.load(std::memory_order_relaxed) - core::now_ns();
    if (!spin_until(begun, awake_ns)) return false;
  }
  // A run has begun, so the early wake has served.
  if (awake_until_ns_.load(std::memory_order_relaxed) != 0) {
    awake_until_ns_.store(0, std::memory_order_relaxed);
  }
  spin_until([this] { return has_work() || is_over(); }, spin_ns_);
  return has_work();
}

void GraphRun::run_from(Work work, std::uint32_t worker) {
  std::optional<Work> next = work;
  while (next) next = run_chunk(*next, worker);
}

// Runs a chunk through its chain of stages; returns what it set free for this thread. After the
// last finish_chunks() the run may be over and the graph gone.
std::optional<GraphRun::Work> GraphRun::run_chunk(Work work, std::uint32_t worker) {
  const auto chain = graph_->chain(work.stage);
  if (by_stage_ || chain.size() == 1) return run_chunks(work, worker);
  for (const std::uint32_t stage : chain.first(chain.size() - 1)) {
    run_kernel(stage, work.chunk, worker);
    finish_chunks(stage, 1, false);
  }
  const std::uint32_t last = chain.back();
  run_kernel(last, work.chunk, worker);
  return finish_chunks(last, 1, true);
}

// A stage that is a chain by itself: as many of its chunks as there are to be had, reported at once.
std::optional<GraphRun::Work> GraphRun::run_chunks(Work first, std::uint32_t worker) {
  Board& board = *board_.load(std::memory_order_relaxed);
  std::uint32_t count = 0;
  for (std::optional<Work> work = first; work; work = claim_from(board, first.stage, worker)) {
    run_kernel(first.stage, work->chunk, worker);
    ++count;
  }
  return finish_chunks(first.stage, count, true);
}

void GraphRun::run_kernel(std::uint32_t stage, std::uint32_t chunk, std::uint32_t worker) {
  if (should_skip()) return;
  const Stage& what = graph_->stages()[stage];
  const std::uint32_t first = chunk * what.chunk;
  const IndexRange items{first, first + std::min(what.chunk, state(stage).items - first)};
  KernelTask task(*this, worker, stage, first);
  const std::int64_t begin_ns = recorder_.now();
  try {
    what.kernel(context_, items, task);
  } catch (const Cancelled&) {
    // From run_phases() in a cancelled run; the cause is known already.
    if (!cancelled_.load(std::memory_order_relaxed)) fail(stage, first);
  } catch (...) {
    fail(stage, first);
  }
  recorder_.kernel(worker, stage, items, begin_ns, recorder_.now());
}

// ---- order --------------------------------------------------------------------------------------

std::optional<GraphRun::Work> GraphRun::finish_chunks(std::uint32_t stage, std::uint32_t count,
                                                      bool may_keep) {
  if (state(stage).unfinished.fetch_sub(count, std::memory_order_acq_rel) != count) {
    return std::nullopt;
  }
  Board& board = *board_.load(std::memory_order_relaxed);
  board.open[stage / 64].fetch_and(~bit_of(stage), std::memory_order_relaxed);
  if (by_stage_) {
    end_run();
    return std::nullopt;
  }
  Released released;
  finish_stage(stage, released, may_keep);
  if (released.wide) invite(released.opened_chunks - (released.here ? 0 : 1), released.wide);
  return released.here;
}

void GraphRun::finish_stage(std::uint32_t stage, Released& released, bool may_keep) {
  for (const std::uint32_t head : graph_->successors(stage)) {
    if (state(head).waiting.fetch_sub(1, std::memory_order_acq_rel) == 1) {
      release(head, released, may_keep);
    }
  }
  if (stages_left_.fetch_sub(1, std::memory_order_acq_rel) == 1) end_run();
}

// The items of a chain, asked once; returns its number of chunks.
std::uint32_t GraphRun::count_chunks(std::uint32_t head) {
  const std::uint32_t items = item_count(head);
  const std::uint32_t chunks = chunk_count(head, items);
  for (const std::uint32_t stage : graph_->chain(head)) {
    state(stage).items = items;
    state(stage).chunks = chunks;
    state(stage).unfinished.store(chunks, std::memory_order_relaxed);
    recorder_.items(stage, items);
  }
  return chunks;
}

// Everything the chain waits for is finished: opens it, or keeps it for this thread.
void GraphRun::release(std::uint32_t head, Released& released, bool may_keep) {
  const std::uint32_t chunks = head == counted_ ? state(head).chunks : count_chunks(head);
  const auto chain = graph_->chain(head);
  if (chunks == 0) {
    // The last of these may end the run.
    for (std::size_t i = 0, count = chain.size(); i < count; ++i) {
      finish_stage(chain[i], released, may_keep);
    }
  } else if (chunks == 1 && may_keep && !released.here) {
    released.here = Work{head, 0};
  } else {
    released.opened_chunks += chunks;
    if (chunks > 1) released.wide = ticket_name(head);
    open(head);
  }
}

// The moment the last share is filled others may finish the stage; signal() is the fence between
// that and the look for tickets.
void GraphRun::open(std::uint32_t stage) {
  Board& board = *board_.load(std::memory_order_relaxed);
  board.open[stage / 64].fetch_or(bit_of(stage), std::memory_order_relaxed);
  const std::uint32_t chunks = board.states[stage].chunks;
  ChunkShare* const shares = shares_of(board, stage);
  for (std::uint32_t i = 0; i < shares_; ++i) {
    const std::uint32_t begin = Share::begin_of(i, shares_, chunks);
    const std::uint32_t end = Share::begin_of(i + 1, shares_, chunks);
    if (begin < end) shares[i].chunks.fill(begin, end);
  }
  event_.signal();
}

void GraphRun::end_run() {
  running_.store(false, std::memory_order_seq_cst);
  event_.signal();
}

// Not asked in a cancelled run: what it would count may not be there.
std::uint32_t GraphRun::item_count(std::uint32_t stage) {
  if (should_skip()) return 0;
  const Stage& what = graph_->stages()[stage];
  if (!what.count) return 1;
  try {
    return what.count(context_);
  } catch (...) {
    fail(stage, 0);
    return 0;
  }
}

std::uint32_t GraphRun::chunk_count(std::uint32_t stage, std::uint32_t items) const {
  const std::uint32_t chunk = graph_->stages()[stage].chunk;
  return items / chunk + (items % chunk != 0);
}

// ---- failure ------------------------------------------------------------------------------------

void GraphRun::fail(std::uint32_t stage, std::uint32_t item) {
  const std::uint64_t at = std::uint64_t{stage} << 32 | item;
  const std::lock_guard lock(failure_mutex_);
  cancelled_.store(true, std::memory_order_relaxed);
  if (failure_ && failed_at_ <= at) return;
  failure_ = std::current_exception();
  failed_at_ = at;
}

bool GraphRun::should_skip() {
  if (cancelled_.load(std::memory_order_relaxed)) return true;
  if (!stop_.stop_requested()) return false;
  const std::lock_guard lock(failure_mutex_);
  stop_seen_ = true;
  cancelled_.store(true, std::memory_order_relaxed);
  return true;
}

void GraphRun::phase_opened(const char* name, std::uint32_t blocks) {
  if (tickets_out_.load(std::memory_order_relaxed) + 1 < workers_) invite(blocks - 1, name);
}

}  // namespace skerry::jobs
