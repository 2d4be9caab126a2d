#include "solver/group_solver.h"

#include <algorithm>
#include <numbers>

#include "core/growth.h"
#include "core/rounding.h"

namespace skerry::solver {
namespace {

using namespace core;

constexpr std::uint32_t kWideLaneGrain = 128;  // manifolds per task of a wide island: about 1 us
constexpr std::uint32_t kWideBodyGrain = 256;  // rows; a multiple of kMaxWidth
constexpr std::uint32_t kWideJointGrain = 64;  // joints per task
constexpr std::uint32_t kUnbounded = 0x7fffffff;

// Solving and relaxing once per substep answers slow waves like springs of frequency sqrt(2) / h. A soft
// contact damps them only if it is the weaker of the two: (2 pi contact_hertz h)^2 / 2 = 0.6
// (docs/decisions/0007).
constexpr double kStiffest = 0.175;  // contact_hertz times h

// Time in which contacts come to carry a load: so slowly that it feeds no wave.
constexpr double kCarryTime = 1.5;  // s

// It gives way to this force per effective mass at most, and carries the rest rigidly: until a load
// many times the body's weight has become the usual one, the body must sink in by no more than this
// over (2 pi contact_hertz)^2. The lowest contacts of a pyramid of 100 rows reach 1000 m/s^2, of which they
// come to carry half at least.
constexpr double kSoftLoad = 800;  // m/s^2

// What is pressed in deeper than by this force per effective mass comes to carry more than its share, and
// soon: corners that bear what faces should, towers that sway (docs/decisions/0029).
constexpr double kDeepLoad = 240;       // m/s^2
constexpr double kDeepCarryTime = 0.3;  // s

// An impact reaches bodies that are this many contacts away or more, by what strikes them and by what
// they pass on (docs/decisions/0024).
constexpr int kStrikePasses = 4, kReflectPasses = 8;
// Over contacts whose bodies would fly into each other, each by max_push_velocity times a substep at most
// (docs/decisions/0025).
constexpr int kPartPasses = 4;

Softness soft(double hertz, double damping_ratio, double h) {
  const double omega = 2 * std::numbers::pi * hertz;
  const double a1 = 2 * damping_ratio + h * omega;
  const double a2 = h * omega * a1;
  const double a3 = 1 / (1 + a2);
  return {core::rounded_to_float(omega / a1), core::rounded_to_float(a2 * a3),
          core::rounded_to_float(a3)};
}

}  // namespace

void GroupSolver::begin(const StepContext& step, const IslandGroup& group,
                        const ContactKernels& kernels, jobs::Task& task) {
  group_.step = &step;
  group_.islands = group;
  kernels_ = &kernels;
  const bool wide = group.kind == GroupKind::wide;
  block_grain_ = wide ? kWideLaneGrain / kernels.width : kUnbounded;
  body_grain_ = wide ? kWideBodyGrain : kUnbounded - kMaxWidth + 1;
  assign_rows();
  collect(task);
  const bool rests = group_.has_reloaded || has_placed_.load(std::memory_order_relaxed) ||
                     has_unsettled_.load(std::memory_order_relaxed);
  loads_.set_efforts(group_);
  if (rests) loads_.share();
  make_rows();
  impacts_.begin(group_, has_bounces_.load(std::memory_order_relaxed));
  balance_.begin(group_, impacts_);
  set_constants();
  colouring_.run(group_.row_a.data(), group_.row_b.data(), group_.contact_count, pass_.dynamic_end);
  bucket_contacts();
  make_chunks();
  list_phases();
}

void GroupSolver::make_rows() {
  group_.padded_rows = (group_.row_count + kMaxWidth - 1) / kMaxWidth * kMaxWidth;
  core::grow(group_.velocity, group_.padded_rows);
  core::grow(start_, group_.padded_rows);
  core::grow(forced_, group_.padded_rows);
  core::grow(group_.delta, group_.padded_rows);
  core::grow(group_.mass, group_.padded_rows);
  core::grow(base_, group_.padded_rows);
  core::grow(spin_, group_.padded_rows);
  core::grow(group_.ledger, group_.row_count);
  core::grow(group_.outlook, group_.row_count);
  joints_.begin(group_.first_body, group_.row_count, 1 + group_.body_count,
                group_.islands.kind == GroupKind::wide ? kWideJointGrain : kUnbounded,
                loads_.yields());
  joints_.bodies.bind(group_.velocity.data(), group_.delta.data());
}

void GroupSolver::set_constants() {
  const SolverSettings& settings = group_.step->settings->solver;
  const double h = group_.step->dt / settings.substeps;
  pass_.velocity = group_.velocity.data();
  pass_.start = start_.data();
  pass_.forced = forced_.data();
  pass_.delta = group_.delta.data();
  pass_.flown = impacts_.flown();
  pass_.mass = group_.mass.data();
  pass_.base = base_.data();
  pass_.spin = spin_.data();
  pass_.dynamic_end = 1 + group_.body_count;
  pass_.substep = core::rounded_to_float(h);
  pass_.substeps = static_cast<float>(settings.substeps);
  pass_.inv_substep = core::rounded_to_float(1 / h);
  pass_.max_push = core::rounded_to_float(settings.max_push_velocity);
  pass_.restitution_threshold = core::rounded_to_float(settings.restitution_threshold);
  const double hertz = std::min(settings.contact_hertz, kStiffest / h);
  pass_.soft_load = core::rounded_to_float(kSoftLoad * h);
  pass_.soft = soft(hertz, settings.contact_damping_ratio, h);
  const double omega = 2 * std::numbers::pi * hertz;
  pass_.deflection = core::rounded_to_float(std::min(1 / (h * omega * omega), 1e30));
  carrying_.dt = pass_.substep * pass_.substeps;
  carrying_.part = core::rounded_to_float(std::min(1.0, group_.step->dt / kCarryTime));
  carrying_.deep_part = core::rounded_to_float(std::min(1.0, group_.step->dt / kDeepCarryTime));
  carrying_.deep = core::rounded_to_float(std::min(kDeepLoad / (omega * omega), 1e30));
  unbooked_pass_ = pass_;
  unbooked_pass_.books = false;
  last_pass_ = pass_;
  last_pass_.last = true;
}

void GroupSolver::add_phase(Op op) {
  std::uint32_t blocks = 1;
  if (op == Op::gather || op == Op::finish || op == Op::integrate_velocities ||
      op == Op::integrate_and_repeat || op == Op::integrate_positions ||
      op == Op::close_velocities || op == Op::rebalance || op == Op::fly) {
    blocks = (group_.padded_rows + body_grain_ - 1) / body_grain_;
  } else if (op == Op::prepare_joints || op == Op::store_joints) {
    blocks = joints_.chunks();
  }
  if (blocks > 0) phases_.push_back({op, 0, blocks, substep_});
}

void GroupSolver::add_colours(Op op) {
  for (std::uint32_t effort = 0; effort < loads_.efforts(); ++effort) {
    const std::uint32_t passes = op == Op::solve || op == Op::relax ? 1u << effort : 1u;
    for (std::uint32_t pass = 0; pass < passes; ++pass) {
      for (std::uint32_t colour = 0; colour < colouring_.colours; ++colour) {
        const std::uint32_t* chunk = &colour_chunks_[effort * colouring_.colours + colour];
        if (chunk[1] == chunk[0]) continue;
        phases_.push_back({op, chunk[0], chunk[1] - chunk[0], substep_, pass + 1 == passes});
      }
    }
  }
}

void GroupSolver::add_joint_colours(Op op) {
  for (std::uint32_t colour = 0; colour < joints_.colours(); ++colour) {
    const std::uint32_t first = joints_.first_chunk(colour);
    phases_.push_back({op, first, joints_.first_chunk(colour + 1) - first, substep_});
  }
}

void GroupSolver::list_phases() {
  phases_.clear();
  substep_ = 0;
  add_phase(Op::gather);
  add_phase(Op::prepare_joints);
  const auto substeps = static_cast<std::uint32_t>(group_.step->settings->solver.substeps);
  for (; substep_ < substeps; ++substep_) {
    // The rows of contacts are the same in all substeps, so that impulses change the velocities
    // alike. Those of joints turn with the bodies.
    const bool repeats = substep_ > 0 && joints_.empty();
    add_phase(repeats ? Op::integrate_and_repeat : Op::integrate_velocities);
    add_joint_colours(Op::warm_start_joints);
    // A block is written by the worker that will work on it: both go by colours.
    if (!repeats) add_colours(substep_ == 0 ? Op::prepare_and_start : Op::warm_start);
    add_joint_colours(Op::solve_joints);
    add_colours(Op::solve);
    if (group_.contact_count > 0) add_joint_colours(Op::answer_joints);
    add_phase(Op::integrate_positions);
    add_joint_colours(Op::relax_joints);
    add_colours(Op::relax);
  }
  if (!joints_.empty() && joints_.bodies.any_smooth()) {
    add_phase(Op::close_velocities);
    add_joint_colours(Op::close_joints);
  }
  const bool bounces = has_bounces_.load(std::memory_order_relaxed);
  const bool timed = bounces && joints_.empty();
  if (timed) {
    add_colours(Op::count_pushes);
    for (int i = 0; i < kStrikePasses; ++i) add_colours(Op::strike);
    add_colours(Op::take_back);
    add_phase(Op::rebalance);
    for (int i = 0; i < kReflectPasses; ++i) add_colours(Op::reflect);
  }
  if (bounces) add_colours(Op::restitute);
  add_colours(Op::store);
  if (balance_.acts()) add_phase(Op::lessen);
  if (timed) {
    add_phase(Op::fly);
    for (int i = 0; i < kPartPasses; ++i) add_colours(Op::part);
  }
  if (balance_.acts()) add_phase(Op::settle);
  add_phase(Op::store_joints);
  add_phase(Op::finish);
}

void GroupSolver::run_serially() {
  for (std::uint32_t phase = 0; phase < phases_.size(); ++phase) {
    for (std::uint32_t block = 0; block < phases_[phase].blocks; ++block) {
      run_block(phase, block, 0);
    }
  }
}

void GroupSolver::run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t) {
  const Phase& p = phases_[phase];
  const std::uint32_t begin = block * body_grain_;
  const std::uint32_t end = std::min(group_.padded_rows, begin + body_grain_);
  switch (p.op) {
    case Op::gather:
      return gather_rows(begin, end);
    case Op::integrate_velocities:
      return integrate_velocities(begin, end, p.substep);
    case Op::integrate_and_repeat:
      return kernels_->integrate_and_repeat(pass_, begin, end);
    case Op::integrate_positions:
      return integrate_positions(begin, end);
    case Op::close_velocities:
      return joints_.bodies.kick(begin, end, joints_.h(), JointBatch::kHalfKick, true);
    case Op::rebalance:
      return impacts_.rebalance(std::max(begin, 1u), std::min(end, pass_.dynamic_end));
    case Op::fly:
      return impacts_.fly(begin, std::min(end, group_.row_count));
    case Op::lessen:
      return balance_.lessen();
    case Op::settle:
      return balance_.settle();
    case Op::finish:
      return finish_rows(begin, std::min(end, pass_.dynamic_end));
    case Op::prepare_joints:
    case Op::warm_start_joints:
    case Op::solve_joints:
    case Op::answer_joints:
    case Op::relax_joints:
    case Op::close_joints:
    case Op::store_joints:
      return run_joints(p, block);
    default:
      return run_contacts(p, chunks_[p.first + block]);
  }
}

// Passes that change nothing where no contact may bounce.
bool GroupSolver::is_bounce(Op op) {
  return op == Op::count_pushes || op == Op::strike || op == Op::take_back || op == Op::reflect ||
         op == Op::restitute || op == Op::part;
}

void GroupSolver::run_contacts(const Phase& phase, const Chunk& chunk) {
  if (is_bounce(phase.op) && !impacts_.bounces()) return;
  const auto& kernel = kernels_->kind[static_cast<std::size_t>(chunk.kind)];
  std::byte* blocks = block_memory() + chunk.memory;
  switch (phase.op) {
    case Op::prepare_and_start:
      prepare_chunk(chunk);
      return kernel.warm_start(pass_, blocks, chunk.count);
    case Op::warm_start:
      return kernel.warm_start(pass_, blocks, chunk.count);
    case Op::solve:
      return kernel.solve(pass_, blocks, chunk.count);
    case Op::relax:
      return kernel.relax(relax_pass(phase), blocks, chunk.count);
    case Op::count_pushes:
      return kernel.count_pushes(pass_, blocks, chunk.count);
    case Op::strike:
      return kernel.strike(pass_, blocks, chunk.count);
    case Op::take_back:
      return take_back_chunk(chunk);
    case Op::reflect:
      return kernel.reflect(pass_, blocks, chunk.count);
    case Op::restitute:
      return kernel.restitute(pass_, blocks, chunk.count);
    case Op::part:
      return kernel.part(pass_, blocks, chunk.count);
    default:
      return store_chunk(chunk);
  }
}

const ContactPass& GroupSolver::relax_pass(const Phase& phase) const {
  if (!phase.books) return unbooked_pass_;
  const bool last =
      phase.substep + 1 == static_cast<std::uint32_t>(group_.step->settings->solver.substeps);
  return last ? last_pass_ : pass_;
}

void GroupSolver::run_joints(const Phase& phase, std::uint32_t block) {
  const auto op_of = [](Op op) {
    switch (op) {
      case Op::prepare_joints:
        return JointOp::prepare;
      case Op::warm_start_joints:
        return JointOp::warm_start;
      case Op::solve_joints:
        return JointOp::solve;
      case Op::answer_joints:
        return JointOp::answer;
      case Op::relax_joints:
        return JointOp::relax;
      case Op::close_joints:
        return JointOp::close;
      default:
        return JointOp::store;
    }
  };
  joints_.run(op_of(phase.op), phase.substep, phase.first + block);
}

void GroupSolver::integrate_velocities(std::uint32_t begin, std::uint32_t end,
                                       std::uint32_t substep) {
  if (joints_.empty()) return kernels_->integrate_velocities(pass_, begin, end);
  joints_.bodies.kick(begin, end, joints_.h(), JointBatch::kick(substep), false);
  kernels_->integrate_velocities(pass_, begin, end);
  joints_.bodies.publish_velocities(begin, std::min(end, pass_.dynamic_end));
}

void GroupSolver::integrate_positions(std::uint32_t begin, std::uint32_t end) {
  kernels_->integrate_positions(pass_, begin, end);
  if (!joints_.empty()) joints_.bodies.drift(begin, std::min(end, group_.row_count), joints_.h());
}

}  // namespace skerry::solver
