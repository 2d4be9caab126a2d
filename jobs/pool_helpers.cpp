// Helpers from a host's own pool.
#include <algorithm>
#include <atomic>
#include <vector>

#include "jobs/ticket_executor.h"

namespace skerry::jobs {
namespace {

// Tickets per run. Enough for a long run whose helpers come and go; beyond it the run goes on with
// those it has. A pool that runs everything inline uses one up at every wide stage.
constexpr std::uint32_t kMostTickets = 1024;

class PoolHelpers final : public Helpers {
 public:
  PoolHelpers(GraphRun& run, TaskPool& pool) : run_(run), pool_(pool), handles_(kMostTickets) {}

  std::uint32_t invite(std::uint32_t count, const char* name) noexcept override {
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t ticket = ticket_count_.fetch_add(1, std::memory_order_relaxed);
      if (ticket >= kMostTickets || !submit(handles_[ticket], name)) return i;
    }
    return count;
  }

  // In order of invitation: whoever invites is the caller or has an earlier ticket, so that the
  // handle at hand has been written, and no ticket can be added behind our back.
  void end_run() override {
    for (std::uint32_t i = 0; i < std::min(kMostTickets, ticket_count_.load()); ++i) {
      if (handles_[i].submitted) pool_.wait(handles_[i].handle);
      handles_[i] = {};
    }
    ticket_count_.store(0);
  }

  bool can_wake() const override { return false; }

 private:
  struct Ticket {
    TaskPool::Handle handle = nullptr;
    bool submitted = false;
  };

  bool submit(Ticket& ticket, const char* name) {
    try {
      ticket.handle = pool_.submit([](void* run) { static_cast<GraphRun*>(run)->redeem_ticket(1); },
                                   &run_, name);
      ticket.submitted = true;
    } catch (...) {
      // A pool that takes no more work is a pool without free workers.
    }
    return ticket.submitted;
  }

  GraphRun& run_;
  TaskPool& pool_;
  std::vector<Ticket> handles_;
  std::atomic<std::uint32_t> ticket_count_{0};
};

}  // namespace

std::unique_ptr<Helpers> make_pool_helpers(GraphRun& run, TaskPool& pool) {
  return std::make_unique<PoolHelpers>(run, pool);
}

}  // namespace skerry::jobs
