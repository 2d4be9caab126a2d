#include "jobs/phase_team.h"

#include <algorithm>
#include <bit>

#include "jobs/spin.h"

namespace skerry::jobs {
namespace {

// Even where the wait policy says to block at once: a phase takes microseconds, a sleep tens of them.
constexpr std::int64_t kLeastPhaseSpinNs = 20'000;

}  // namespace

PhaseTeam::PhaseTeam(std::uint32_t workers, std::int64_t spin_ns, TeamHost& host, EventCount& event,
                     Recorder& recorder)
    : shares_(std::min(workers, Share::kMost)),
      spin_ns_(std::max(spin_ns, kLeastPhaseSpinNs)),
      host_(host),
      event_(event),
      recorder_(recorder) {}

void PhaseTeam::run(PhaseProgram& program, std::uint32_t worker, const ProgramOwner& owner) {
  const auto taken = take_slot();
  if (!taken) return run_alone(program, worker);

  Slot& slot = slots_[*taken];
  slot.program = &program;
  slot.program_number = programs_started_.fetch_add(1, std::memory_order_relaxed) + 1;
  slot.owner = owner;
  slot.owner_worker = worker;
  slot.interrupted = false;
  slot.failed.store(false, std::memory_order_relaxed);
  slot.failure = nullptr;
  slot.over.store(false, std::memory_order_relaxed);
  open_.fetch_or(1u << *taken, std::memory_order_release);

  open_next(slot, 0);
  while (!slot.over.load(std::memory_order_acquire)) {
    if (run_claimable(slot, worker)) continue;
    const std::int64_t begin_ns = recorder_.now();
    wait_for_blocks_or_end(slot);
    recorder_.waited(worker, recorder_.now() - begin_ns);
  }

  const std::exception_ptr failure = std::move(slot.failure);
  const bool interrupted = slot.interrupted;
  open_.fetch_and(~(1u << *taken), std::memory_order_release);
  taken_.fetch_and(~(1u << *taken), std::memory_order_release);
  if (failure) std::rethrow_exception(failure);
  if (interrupted) throw Cancelled();
}

bool PhaseTeam::help(std::uint32_t worker) {
  for (std::uint32_t open = open_.load(std::memory_order_acquire); open; open &= open - 1) {
    if (run_claimable(slots_[std::countr_zero(open)], worker)) return true;
  }
  return false;
}

bool PhaseTeam::has_blocks() const {
  for (std::uint32_t open = open_.load(std::memory_order_acquire); open; open &= open - 1) {
    if (has_blocks(slots_[std::countr_zero(open)])) return true;
  }
  return false;
}

std::optional<std::uint32_t> PhaseTeam::take_slot() {
  std::uint32_t taken = taken_.load(std::memory_order_relaxed);
  while (taken != (1u << kSlots) - 1) {
    const std::uint32_t slot = std::countr_one(taken);
    if (taken_.compare_exchange_weak(taken, taken | 1u << slot, std::memory_order_acquire,
                                     std::memory_order_relaxed)) {
      return slot;
    }
  }
  return std::nullopt;
}

void PhaseTeam::run_alone(PhaseProgram& program, std::uint32_t worker) {
  const std::uint32_t phases = program.phase_count();
  for (std::uint32_t phase = 0; phase < phases; ++phase) {
    if (host_.interrupted()) throw Cancelled();
    const std::uint32_t blocks = program.block_count(phase);
    for (std::uint32_t block = 0; block < blocks; ++block) program.run_block(phase, block, worker);
  }
}

// Opens the first phase from `phase` on that has blocks, or ends the program.
void PhaseTeam::open_next(Slot& slot, std::uint32_t phase) {
  try {
    if (phase == 0) slot.phase_count = slot.program->phase_count();
    for (; phase < slot.phase_count; ++phase) {
      if (slot.failed.load(std::memory_order_relaxed)) break;
      if (host_.interrupted()) {
        slot.interrupted = true;
        break;
      }
      const std::uint32_t blocks = slot.program->block_count(phase);
      if (blocks > 0) return open(slot, phase, blocks);
    }
  } catch (...) {
    fail(slot, phase, 0);
  }
  close(slot);
}

void PhaseTeam::open(Slot& slot, std::uint32_t phase, std::uint32_t blocks) {
  // The moment the last share is filled others may finish the phase, and the program.
  const char* const name = slot.owner.name;
  slot.unreported.store(blocks, std::memory_order_relaxed);
  for (std::uint32_t i = 0; i < shares_; ++i) {
    const std::uint32_t begin = Share::begin_of(i, shares_, blocks);
    const std::uint32_t end = Share::begin_of(i + 1, shares_, blocks);
    if (begin == end) continue;
    slot.shares[i].phase = phase;
    slot.shares[i].blocks.fill(begin, end);
  }
  event_.signal();
  if (blocks > 1) host_.phase_opened(name, blocks);
}

void PhaseTeam::close(Slot& slot) {
  slot.over.store(true, std::memory_order_release);
  event_.signal();
}

bool PhaseTeam::run_claimable(Slot& slot, std::uint32_t worker) {
  const auto first = claim(slot, worker);
  if (!first) return false;
  const std::int64_t begin_ns = recorder_.now();
  std::uint32_t count = 0;
  for (auto claimed = first; claimed; claimed = claim(slot, worker)) {
    run_block(slot, *claimed, worker);
    ++count;
  }
  if (worker != slot.owner_worker && recorder_.on()) {
    recorder_.joined(worker, slot.owner.stage, slot.owner.item, slot.program_number, begin_ns,
                     recorder_.now());
  }
  report(slot, first->phase, count);
  return true;
}

void PhaseTeam::run_block(Slot& slot, const Claim& claim, std::uint32_t worker) {
  if (slot.failed.load(std::memory_order_relaxed)) return;
  try {
    slot.program->run_block(claim.phase, claim.block, worker);
  } catch (...) {
    fail(slot, claim.phase, claim.block);
  }
}

// All blocks that one worker ran in a phase are reported at once: the phase cannot end sooner, and
// the line that all share moves once.
void PhaseTeam::report(Slot& slot, std::uint32_t phase, std::uint32_t blocks) {
  if (slot.unreported.fetch_sub(blocks, std::memory_order_acq_rel) == blocks) {
    open_next(slot, phase + 1);
  }
}

void PhaseTeam::wait_for_blocks_or_end(Slot& slot) {
  const auto ready = [&] { return slot.over.load(std::memory_order_acquire) || has_blocks(slot); };
  if (spin_until(ready, spin_ns_)) return;
  EventCount::Sleeper sleeper(event_);
  if (!ready()) sleeper.sleep();
}

std::optional<PhaseTeam::Claim> PhaseTeam::claim(Slot& slot, std::uint32_t worker) {
  const std::uint32_t own_index = worker % shares_;
  PhaseShare& own = slot.shares[own_index];
  if (const auto block = own.blocks.take_front()) return Claim{own.phase, *block};
  for (std::uint32_t i = 1; i < shares_; ++i) {
    PhaseShare& other = slot.shares[(own_index + i) % shares_];
    if (const auto block = other.blocks.take_back()) return Claim{other.phase, *block};
  }
  return std::nullopt;
}

bool PhaseTeam::has_blocks(const Slot& slot) const {
  for (std::uint32_t i = 0; i < shares_; ++i) {
    if (!slot.shares[i].blocks.is_empty()) return true;
  }
  return false;
}

void PhaseTeam::fail(Slot& slot, std::uint32_t phase, std::uint32_t block) {
  const std::uint64_t at = std::uint64_t{phase} << 32 | block;
  const std::lock_guard lock(slot.failure_mutex);
  if (slot.failure && slot.failed_at <= at) return;
  slot.failure = std::current_exception();
  slot.failed_at = at;
  slot.failed.store(true, std::memory_order_relaxed);
}

}  // namespace skerry::jobs
