#include "jobs/ticket_executor.h"

#include <utility>

namespace skerry::jobs {
namespace {

class TicketExecutor final : public Executor {
 public:
  TicketExecutor(std::shared_ptr<GraphRun> run, std::unique_ptr<Helpers> helpers, Affinity affinity,
                 std::vector<int> processors)
      : run_(std::move(run)),
        helpers_(std::move(helpers)),
        affinity_(affinity),
        processors_(std::move(processors)) {
    run_->set_helpers(helpers_.get());
  }

  ~TicketExecutor() override {
    if (!state_.in_run()) return;
    run_->cancel();  // begun and never ended
    run_->finish();
    helpers_->end_run();
  }

  void run(const TaskGraph& graph, void* context, const RunOptions& options) override {
    state_.enter();
    const LeaveRun leave(state_);
    run_->prepare(graph, context, options);
    {
      const PinScope pin = pin_caller();
      run_->run_here();
      wait_for_helpers();
    }
    run_->conclude();
  }

  void begin(const TaskGraph& graph, void* context, const RunOptions& options) override {
    state_.enter();
    try {
      run_->prepare(graph, context, options);
    } catch (...) {
      state_.leave();
      throw;
    }
    run_->start_away();
  }

  void end() override {
    state_.check_begun();
    const LeaveRun leave(state_);
    {
      const PinScope pin = pin_caller();
      run_->finish();
      wait_for_helpers();
    }
    run_->conclude();
  }

  std::uint32_t worker_count() const override { return run_->workers(); }

  void wake() override {
    if (helpers_->can_wake() && !state_.in_run()) run_->wake();
  }

 private:
  PinScope pin_caller() const {
    return PinScope(affinity_ == Affinity::spread ? processors_[0] : -1);
  }

  void wait_for_helpers() {
    Recorder& recorder = run_->recorder();
    const std::int64_t begin_ns = recorder.now();
    helpers_->end_run();
    recorder.blocked(recorder.now() - begin_ns);
  }

  std::shared_ptr<GraphRun> run_;
  std::unique_ptr<Helpers> helpers_;
  Affinity affinity_;
  std::vector<int> processors_;
  RunState state_;
};

}  // namespace

std::unique_ptr<Executor> make_ticket_executor(std::shared_ptr<GraphRun> run,
                                               std::unique_ptr<Helpers> helpers, Affinity affinity,
                                               std::vector<int> processors) {
  return std::make_unique<TicketExecutor>(std::move(run), std::move(helpers), affinity,
                                          std::move(processors));
}

}  // namespace skerry::jobs
