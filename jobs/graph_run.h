// One run of a task graph after another, shared by the caller and whoever comes to help.
//
// Ready chains of stages are open: anybody inside may claim their chunks, in stage order, first of
// its own share of them. Whoever finishes the last chunk of a stage releases the stages that wait for it. A
// released stage of one chunk is run on the spot by the thread that released it; a wider one is
// opened, and only then are helpers invited. An invited helper brings a ticket, works, spins a
// little while for more, and leaves. So a small graph costs no scheduling, the caller finishes alone
// if nobody comes, and a ticket that comes late finds nothing.
//
// Claims are safe against threads that were delayed anywhere, as in PhaseTeam: a share is one atomic
// word, in which a chunk exists only while its stage is open; a run cannot end before its claimed
// chunks are finished; and all else is read after the claim.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include <skerry/jobs/executor.h>

#include "jobs/event_count.h"
#include "jobs/phase_team.h"
#include "jobs/recorder.h"
#include "jobs/share.h"
#include "jobs/worker_indices.h"

namespace skerry::jobs {

// Where helpers come from.
class HelperSource {
 public:
  virtual ~HelperSource() = default;
  // Asks for `count` calls of GraphRun::redeem_ticket(), each from a thread that has time, now or
  // later, or at once on this thread; returns how many of these calls will come. From any thread
  // that has a ticket, or the caller's.
  virtual std::uint32_t invite(std::uint32_t count, const char* name) noexcept = 0;
};

class GraphRun final : private TeamHost {
 public:
  // workers >= 2. `helpers` may be set later with set_helpers(), before the first run.
  GraphRun(std::uint32_t workers, const WaitPolicy& wait);
  void set_helpers(HelperSource* helpers) { helpers_ = helpers; }

  std::uint32_t workers() const { return workers_; }

  // ---- the caller: prepare, then run_here or (start_away, finish) or run_stage..., then conclude

  void prepare(const TaskGraph& graph, void* context, const RunOptions& options);
  // Runs the graph, this thread too.
  void run_here();
  // Opens the first stages and invites helpers; runs no kernel on this thread, unless the helper
  // source does.
  void start_away();
  // Helps until the run is over, as worker 0.
  void finish();
  // Reports and throws what there is to throw.
  void conclude();
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }

  // Stage by stage, for fork-join: opens the stage and returns its number of chunks; 1: it has been
  // run here already. With more, every participant of the parallel region calls participate(), and
  // the caller participate_as_caller(); the stage is over when finish() has returned.
  std::uint32_t open_stage(std::uint32_t stage);
  void participate(std::uint32_t preferred_index);
  void participate_as_caller();
  Recorder& recorder() { return recorder_; }

  // ---- helpers

  // Works for as long as there is something to do. Safe at any time, from any thread, also on a
  // thread that is inside already (returns at once). One call per invitation.
  void redeem_ticket(std::uint32_t preferred_index);

  // Helpers that were invited and are not gone yet.
  std::uint32_t tickets_out() const { return tickets_out_.load(std::memory_order_acquire); }

  // Invites helpers before there is work; they spin for up to 2 ms for a run to begin.
  void wake();

 private:
  struct alignas(64) StageState {
    std::atomic<std::uint32_t> unfinished{0};  // chunks
    std::atomic<std::uint32_t> waiting{0};     // for so many stages
    std::uint32_t chunks = 0;
    std::uint32_t items = 0;
  };

  struct alignas(64) ChunkShare {
    Share chunks;
  };

  // Grows only; older boards are kept, for a delayed thread may still look at one (and find nothing).
  struct Board {
    Board(std::uint32_t stages, std::uint32_t shares_each)
        : states(stages), shares(std::size_t{stages} * shares_each), open((stages + 63) / 64) {}
    std::vector<StageState> states;
    std::vector<ChunkShare> shares;                // [stage][share]
    std::vector<std::atomic<std::uint64_t>> open;  // bit per stage: look here for chunks
  };

  struct Work {
    std::uint32_t stage = 0;
    std::uint32_t chunk = 0;
  };

  // What the end of a stage set free.
  struct Released {
    std::optional<Work> here;         // a stage of one chunk for this thread
    std::uint32_t opened_chunks = 0;  // for anyone
    const char* wide = nullptr;       // name of one among them with several chunks
  };

  class KernelTask;
  class Inside;

  void work(std::uint32_t worker);
  void serve(std::uint32_t worker);
  std::optional<Work> claim(std::uint32_t worker);
  std::optional<Work> claim_from(Board& board, std::uint32_t stage, std::uint32_t worker);
  ChunkShare* shares_of(Board& board, std::uint32_t stage) const {
    return &board.shares[std::size_t{stage} * shares_];
  }
  bool has_work() const;
  bool is_over() const { return !running_.load(std::memory_order_seq_cst); }
  void wait_for_work_or_end();
  bool spin_for_work();

  void run_from(Work work, std::uint32_t worker);
  std::optional<Work> run_chunk(Work work, std::uint32_t worker);
  void run_kernel(std::uint32_t stage, std::uint32_t chunk, std::uint32_t worker);
  std::optional<Work> run_chunks(Work first, std::uint32_t worker);
  std::optional<Work> finish_chunks(std::uint32_t stage, std::uint32_t count, bool may_keep);
  void finish_stage(std::uint32_t stage, Released& released, bool may_keep);
  void release(std::uint32_t head, Released& released, bool may_keep);
  std::uint32_t run_alone();
  void run_stage_alone(std::uint32_t stage);
  void release_roots(Released& released, bool may_keep);
  void open(std::uint32_t stage);
  void end_run();
  std::uint32_t item_count(std::uint32_t stage);
  std::uint32_t count_chunks(std::uint32_t head);
  std::uint32_t chunk_count(std::uint32_t stage, std::uint32_t items) const;
  StageState& state(std::uint32_t stage) {
    return board_.load(std::memory_order_acquire)->states[stage];
  }

  // `name` was looked up while the run could not end; by now it may have.
  void invite(std::uint32_t wanted, const char* name);
  const char* ticket_name(std::uint32_t stage) const {
    return name_ ? name_ : graph_->stages()[stage].name;
  }
  std::uint32_t reserve_tickets(std::uint32_t wanted);

  void fail(std::uint32_t stage, std::uint32_t item);
  bool should_skip();

  void phase_opened(const char* name, std::uint32_t blocks) override;
  bool interrupted() override { return should_skip(); }

  const std::uint32_t workers_;
  const std::uint32_t shares_;  // of each stage
  const std::int64_t spin_ns_;
  HelperSource* helpers_ = nullptr;

  // The run. Written by prepare(), read by whoever holds a claim.
  const TaskGraph* graph_ = nullptr;
  void* context_ = nullptr;
  std::stop_token stop_;
  const char* name_ = nullptr;
  bool by_stage_ = false;
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::uint32_t first_shared_ = 0;    // the stages before it have run on the caller alone
  std::uint32_t counted_ = kNone;     // the stage whose chunks run_alone() has counted ahead
  std::vector<std::uint32_t> roots_;  // scratch of release_roots()

  std::mutex failure_mutex_;
  std::exception_ptr failure_;
  std::uint64_t failed_at_ = 0;  // stage << 32 | item
  bool stop_seen_ = false;       // under failure_mutex_

  std::vector<std::unique_ptr<Board>> boards_;
  WorkerIndices indices_;
  Recorder recorder_;
  EventCount event_;  // work to be had, or the end of the run
  PhaseTeam team_;

  alignas(64) std::atomic<Board*> board_{nullptr};
  std::atomic<bool> running_{false};
  std::atomic<bool> cancelled_{false};
  std::atomic<std::int64_t> awake_until_ns_{0};
  alignas(64) std::atomic<std::uint32_t> stages_left_{0};
  alignas(64) std::atomic<std::uint32_t> tickets_out_{0};  // invited and not yet gone
};

}  // namespace skerry::jobs
