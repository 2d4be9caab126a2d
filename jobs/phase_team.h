// Several workers on one item: runs PhasePrograms with whoever has nothing else to do.
//
// A program opens in a slot. Its owner, the kernel that called run_phases, and any idle worker claim
// blocks of the phase at hand; whoever reports the last block of a phase opens the next one. Nobody
// ever waits for a worker that has not claimed a block.
//
// Claims are safe against threads that were delayed anywhere: a share is one atomic word in which an
// open block exists only while its phase is open, and a phase cannot end before its claimed blocks
// are reported. So everything else (which program, which phase) is read after the
// claim, and no epoch is needed.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <vector>

#include "jobs/event_count.h"
#include "jobs/recorder.h"
#include "jobs/share.h"

namespace skerry::jobs {

// Where a team belongs.
class TeamHost {
 public:
  // A phase with several blocks is open (and over already, perhaps, as may be the run): get more
  // workers, if any are to be had.
  virtual void phase_opened(const char* name, std::uint32_t blocks) = 0;
  // The run is cancelled: programs stop at the next phase.
  virtual bool interrupted() = 0;

 protected:
  ~TeamHost() = default;
};

// The item whose kernel runs a program.
struct ProgramOwner {
  const char* name = "";
  std::uint32_t stage = 0;
  std::uint32_t item = 0;
};

class PhaseTeam {
 public:
  // `event` is signalled when blocks are to be had or a program is over. `spin_ns`: how long an
  // owner spins for the blocks of others before it sleeps.
  PhaseTeam(std::uint32_t workers, std::int64_t spin_ns, TeamHost& host, EventCount& event,
            Recorder& recorder);

  // Runs all phases; rethrows the exception of the earliest phase and block seen; throws Cancelled
  // if the host was interrupted.
  void run(PhaseProgram& program, std::uint32_t worker, const ProgramOwner& owner);

  // Runs blocks of open programs until none is to be had now; false if there was none.
  bool help(std::uint32_t worker);
  bool has_blocks() const;

 private:
  static constexpr std::uint32_t kSlots = 8;  // programs at once; any more run alone

  // Plain members here and in Slot are written while no block is claimable, and read by whoever
  // holds a claim. What changes from phase to phase sits in the cache line that the claim has
  // fetched anyhow.
  struct alignas(64) PhaseShare {
    Share blocks;
    std::uint32_t phase = 0;
  };

  struct Claim {
    std::uint32_t phase = 0;
    std::uint32_t block = 0;
  };

  struct alignas(64) Slot {
    PhaseProgram* program = nullptr;
    std::uint64_t program_number = 0;
    std::uint32_t phase_count = 0;
    ProgramOwner owner;
    std::uint32_t owner_worker = 0;
    bool interrupted = false;
    std::atomic<bool> failed{false};
    std::atomic<bool> over{false};
    std::mutex failure_mutex;
    std::exception_ptr failure;
    std::uint64_t failed_at = 0;                           // phase << 32 | block
    alignas(64) std::atomic<std::uint32_t> unreported{0};  // blocks of the phase at hand
    std::array<PhaseShare, Share::kMost> shares;
  };

  std::optional<std::uint32_t> take_slot();
  void run_alone(PhaseProgram& program, std::uint32_t worker);
  void open(Slot& slot, std::uint32_t phase, std::uint32_t blocks);
  void open_next(Slot& slot, std::uint32_t phase);
  void close(Slot& slot);
  bool run_claimable(Slot& slot, std::uint32_t worker);
  void run_block(Slot& slot, const Claim& claim, std::uint32_t worker);
  void report(Slot& slot, std::uint32_t phase, std::uint32_t blocks);
  void wait_for_blocks_or_end(Slot& slot);
  std::optional<Claim> claim(Slot& slot, std::uint32_t worker);
  bool has_blocks(const Slot& slot) const;
  void fail(Slot& slot, std::uint32_t phase, std::uint32_t block);

  const std::uint32_t shares_;
  const std::int64_t spin_ns_;
  TeamHost& host_;
  EventCount& event_;
  Recorder& recorder_;
  std::atomic<std::uint64_t> programs_started_{0};
  alignas(64) std::atomic<std::uint32_t> taken_{0};  // bit per slot: in use
  std::atomic<std::uint32_t> open_{0};               // bit per slot: idle workers look here
  std::array<Slot, kSlots> slots_;
};

}  // namespace skerry::jobs
