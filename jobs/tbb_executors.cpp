// The only file that knows oneTBB: helpers for the job system, and the fork-join executor.
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "jobs/ticket_executor.h"

namespace skerry::jobs {
namespace {

// An arena of our own, created once: waiting for a run never runs a task of the host, and the host
// never waits behind ours. One slot is the caller's.
class Arena {
 public:
  Arena(std::uint32_t workers, const ExecutorSettings& settings, std::vector<int> processors)
      : spread_(settings.affinity == Affinity::spread), processors_(std::move(processors)) {
    // oneTBB counts the processors when it starts, from the affinity of the thread that asks. Ask
    // now, while nothing is pinned. With fewer than our workers it would never let them all run.
    const int slots = static_cast<int>(workers);
    if (oneapi::tbb::info::default_concurrency() < slots) {
      more_threads_.emplace(oneapi::tbb::global_control::max_allowed_parallelism, slots);
    }
    arena_.initialize(slots, 1);
  }

  oneapi::tbb::task_arena* operator->() { return &arena_; }

  // What a worker's task begins with: settles the thread; returns its slot, 1 or above.
  //
  // A worker stays pinned while it sleeps, or the kernel would wake it on the caller's processor,
  // where it waits for the next scheduler tick. So it is still pinned when it next works for the
  // host; an arena of ours without pinning sets it free again.
  static std::uint32_t settle(bool spread, const std::vector<int>& processors) {
    const int slot = std::max(0, oneapi::tbb::this_task_arena::current_thread_index());
    // Slot 0 is the caller's, whose affinity is PinScope's business: it may run a late ticket too.
    if (slot > 0) settle_thread(spread ? processors[slot % processors.size()] : -1, processors);
    return static_cast<std::uint32_t>(slot);
  }
  std::uint32_t settle() const { return settle(spread_, processors_); }

  bool spread() const { return spread_; }
  const std::vector<int>& processors() const { return processors_; }

 private:
  bool spread_;
  std::vector<int> processors_;
  std::optional<oneapi::tbb::global_control> more_threads_;
  oneapi::tbb::task_arena arena_;
};

class TbbHelpers final : public Helpers {
 public:
  TbbHelpers(const std::shared_ptr<GraphRun>& run, const ExecutorSettings& settings,
             std::vector<int> processors)
      : home_(std::make_shared<Home>(Home{run, settings.affinity == Affinity::spread, processors})),
        arena_(run->workers(), settings, std::move(processors)) {}

  // Late tickets are harmless, but better behind us: a host may unload this code, and a hundred
  // dead arenas would keep oneTBB's workers busy. Where no worker comes we do not insist.
  ~TbbHelpers() override {
    const std::int64_t deadline = core::now_ns() + 100'000'000;
    while (home_->run->tickets_out() > 0 && core::now_ns() < deadline) std::this_thread::yield();
    if (home_->run->tickets_out() > 0) remember(home_);
  }

  std::uint32_t invite(std::uint32_t count, const char*) noexcept override {
    for (std::uint32_t i = 0; i < count; ++i) {
      try {
        // A ticket may be redeemed after the executor is gone: it keeps alive what it needs.
        arena_->enqueue([home = home_] {
          home->run->redeem_ticket(Arena::settle(home->spread, home->processors));
        });
      } catch (...) {
        return i;  // no memory for a task
      }
    }
    return count;
  }

  Arena& arena() { return arena_; }

 private:
  struct Home {
    std::shared_ptr<GraphRun> run;
    bool spread;
    std::vector<int> processors;
  };

  // Tickets that the process ends with are never run, and oneTBB keeps them where no leak checker
  // looks: what they hold would count as lost. So it can be found from here; the list is never
  // destroyed, and forgets what has been freed since.
  static void remember(const std::shared_ptr<const Home>& home) {
    static std::mutex& mutex = *new std::mutex;
    static std::vector<std::weak_ptr<const Home>>& late =
        *new std::vector<std::weak_ptr<const Home>>;
    const std::lock_guard lock(mutex);
    std::erase_if(late, [](const auto& one) { return one.expired(); });
    late.push_back(home);
  }

  std::shared_ptr<const Home> home_;
  Arena arena_;
};

// Stage by stage: a parallel region over the chunks, and oneTBB's join at its end. The chunks of a
// stage are handed out by the same shares as in the job system, so that the two differ in barriers
// alone. Helpers that phase programs invite come through the same arena.
class ForkJoinExecutor final : public MadeInEnd {
 public:
  ForkJoinExecutor(std::uint32_t workers, const ExecutorSettings& settings)
      : processors_(allowed_processors()),
        run_(std::make_shared<GraphRun>(workers, settings.wait)),
        helpers_(run_, settings, processors_) {
    run_->set_helpers(&helpers_);
  }

  std::uint32_t worker_count() const override { return run_->workers(); }

  void wake() override {
    if (!in_run()) run_->wake();
  }

 private:
  void make_run(const Pending& run) override {
    run_->prepare(*run.graph, run.context, run.options);
    {
      const PinScope pin(arena().spread() ? processors_[0] : -1);
      arena()->execute([&] { run_stages(*run.graph); });
    }
    run_->conclude();
  }

  Arena& arena() { return helpers_.arena(); }

  void run_stages(const TaskGraph& graph) {
    const auto stages = static_cast<std::uint32_t>(graph.stages().size());
    for (std::uint32_t stage = 0; stage < stages; ++stage) {
      const std::uint32_t chunks = run_->open_stage(stage);
      if (chunks <= 1) continue;
      parallel_region(std::min(chunks, run_->workers()));
      // A helper that an earlier stage's phases invited may hold a chunk of this one: it is not part
      // of the region, so the region's end is not yet the stage's.
      run_->finish();
    }
  }

  void parallel_region(std::uint32_t participants) {
    const std::thread::id caller = std::this_thread::get_id();
    std::int64_t dry_ns = 0;  // since when the caller has had nothing to run
    bool caller_was_in = false;
    const auto body = [&](std::uint32_t) {
      if (std::this_thread::get_id() != caller) return run_->participate(arena().settle());
      if (std::exchange(caller_was_in, true)) return;
      run_->participate_as_caller();
      dry_ns = run_->recorder().now();
    };
    // Every index is a task of its own; the caller begins with the first.
    oneapi::tbb::parallel_for(0u, participants, body, oneapi::tbb::simple_partitioner());
    run_->recorder().blocked(run_->recorder().now() - dry_ns);
  }

  std::vector<int> processors_;
  std::shared_ptr<GraphRun> run_;
  TbbHelpers helpers_;
};

}  // namespace

std::unique_ptr<Helpers> make_tbb_helpers(const std::shared_ptr<GraphRun>& run,
                                          const ExecutorSettings& settings,
                                          const std::vector<int>& processors) {
  return std::make_unique<TbbHelpers>(run, settings, processors);
}

std::unique_ptr<Executor> make_tbb_fork_join_executor(std::uint32_t workers,
                                                      const ExecutorSettings& settings) {
  return std::make_unique<ForkJoinExecutor>(workers, settings);
}

}  // namespace skerry::jobs
