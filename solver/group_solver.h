// Solves the islands of one group over a whole step, as a program of phases. A packed group runs
// its phases one after another on one worker, each in one block; a wide island runs the very same
// phases in smaller blocks on all workers. The order in which a body's constraints are applied is
// that of the colours in both cases, hence the same bits.
//
//   group_solver.cpp            begin; the phases: their list, and what each runs
//   group_solver_collect.cpp    rows, contacts, and the order in which these are solved
//   group_solver_bodies.cpp     bodies into rows before the substeps, and out of them
//   group_solver_contacts.cpp   contacts into lane blocks, and what they gave to bodies out of them
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include <skerry/jobs/task_graph.h>

#include "core/step_context.h"
#include "solver/balance.h"
#include "solver/carried_loads.h"
#include "solver/colouring.h"
#include "solver/contact_blocks.h"
#include "solver/group_data.h"
#include "solver/impacts.h"
#include "solver/island_loads.h"
#include "solver/joint_solver.h"
#include "solver/solver_body.h"

namespace skerry::solver {

class GroupSolver final : public jobs::PhaseProgram {
 public:
  // Rows, colours and phases for the islands of `group`. The step must outlive the phases.
  void begin(const core::StepContext& step, const core::IslandGroup& group,
             const ContactKernels& kernels, jobs::Task& task);

  std::uint32_t phase_count() const override { return static_cast<std::uint32_t>(phases_.size()); }
  std::uint32_t block_count(std::uint32_t phase) const override { return phases_[phase].blocks; }
  void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t worker) override;

  // All phases on the calling thread.
  void run_serially();

 private:
  enum class Op : std::uint8_t {
    gather,
    prepare_joints,
    integrate_velocities,
    integrate_and_repeat,
    prepare_and_start,
    warm_start,
    warm_start_joints,
    solve,
    solve_joints,
    answer_joints,
    integrate_positions,
    relax,
    relax_joints,
    count_pushes,
    strike,
    take_back,
    rebalance,
    reflect,
    restitute,
    fly,
    part,
    settle,
    store,
    lessen,
    store_joints,
    close_velocities,
    close_joints,
    finish,
  };
  struct Phase {
    Op op;
    std::uint32_t first;  // chunk of contacts or joints
    std::uint32_t blocks;
    std::uint32_t substep;
    bool books = true;  // see ContactPass
  };
  // Consecutive lane blocks of one colour and kind.
  struct Chunk {
    ContactKind kind;
    std::uint32_t count;
    std::size_t memory;        // offset of the first block in `memory_`
    std::uint32_t first_lane;  // into `lanes_`
  };
  struct alignas(64) Memory {
    std::byte bytes[64];
  };

  // Rows and contacts.
  void assign_rows();
  void collect(jobs::Task& task);
  void collect_contacts(std::uint32_t begin, std::uint32_t end);
  void seat_kinematics();
  std::uint32_t row_of(core::BodyIndex body);
  std::uint32_t seat(std::uint32_t kinematic, core::BodyIndex body);
  // Row (kNone: not seated yet) and centre of a body whose slot in IslandScratch is known.
  std::uint32_t row_in(std::uint32_t slot) const;
  const Vec3& center_in(std::uint32_t slot, core::BodyIndex body) const;
  static bool is_loose(const core::Manifold& manifold);
  ContactKind kind_of(const core::Manifold& manifold, std::uint32_t row_a,
                      std::uint32_t row_b) const;
  void bucket_contacts();
  void make_chunks();

  // Phases.
  void make_rows();
  void set_constants();
  void list_phases();
  void add_phase(Op op);
  void add_colours(Op op);
  void add_joint_colours(Op op);
  void run_contacts(const Phase& phase, const Chunk& chunk);
  void run_joints(const Phase& phase, std::uint32_t block);
  void integrate_velocities(std::uint32_t begin, std::uint32_t end, std::uint32_t substep);
  void integrate_positions(std::uint32_t begin, std::uint32_t end);
  const ContactPass& relax_pass(const Phase& phase) const;
  static bool is_bounce(Op op);

  // Bodies in and out.
  void gather_rows(std::uint32_t begin, std::uint32_t end);
  void gather_body(std::uint32_t row);
  void gather_kinematic(std::uint32_t row);
  float damping_factor(double damping) const;
  void finish_rows(std::uint32_t begin, std::uint32_t end);
  void move_unpushed(std::uint32_t row);
  void finish_body(std::uint32_t row);
  void finish_jointed(std::uint32_t row);
  void go_by_substeps(std::uint32_t row, const Vec3& linear, const Vec3& spin,
                      core::BodyPose& next) const;

  // Contacts in and out.
  void prepare_chunk(const Chunk& chunk);
  void take_back_chunk(const Chunk& chunk);
  void move_to_touch(std::span<const std::uint32_t> contacts);
  void fill_lanes(LaneInput& input, std::span<const std::uint32_t> contacts, bool full,
                  bool impact) const;
  void fill_lane(LaneInput& input, std::uint32_t lane, std::uint32_t contact) const;
  void fill_full(LaneInput& input, std::uint32_t lane, std::uint32_t contact, bool impact) const;
  float gap_at_touch(std::uint32_t contact, std::uint32_t point) const;
  void fill_side(LaneInput& input, bool is_b, std::uint32_t lane, std::uint32_t row,
                 double time) const;
  void store_chunk(const Chunk& chunk);
  void book(const LaneOutput& output, std::uint32_t lane, std::uint32_t contact);
  void note_push(std::uint32_t contact, bool bounced);
  void judge(std::uint32_t contact);

  GroupData group_;
  IslandLoads loads_;
  Impacts impacts_;
  Balance balance_;
  JointBatch joints_;

  // Phases, and the constants of their kernels.
  const ContactKernels* kernels_ = nullptr;
  ContactPass pass_, unbooked_pass_, last_pass_;
  std::uint32_t body_grain_ = 0, block_grain_ = 0;
  Carrying carrying_;
  std::vector<Phase> phases_;
  std::uint32_t substep_ = 0;  // that phases are being listed for; in the end, how many there are

  // Rows beside those in GroupData, [padded_rows].
  std::vector<VelocityRow> start_, forced_;
  std::vector<BaseRow> base_;
  std::vector<SpinRow> spin_;

  std::vector<std::uint32_t> kinematic_row_;  // [kinematics of the step] or 0
  std::vector<std::uint32_t> used_kinematics_;

  // Of the contacts: whether materials bounce, whether some begin with their bodies at rest, whether some
  // have pressed for long since loads were shared, whether kinematic bodies have no rows yet.
  std::atomic<bool> has_bounces_ = false, has_placed_ = false, has_unsettled_ = false,
                    meets_kinematics_ = false;
  std::uint32_t first_contact_ = 0;  // in Islands::contacts

  // Contacts in the order in which they are solved.
  Colouring colouring_;
  std::vector<std::uint32_t> bucket_;  // [(effort, colour, kind, loose)] first lane
  std::vector<std::uint32_t> lanes_;   // contact of each lane, kNone: padding
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> colour_chunks_;  // [(effort, colour) + 1] first chunk
  std::vector<Memory> memory_;
  std::byte* block_memory() { return reinterpret_cast<std::byte*>(memory_.data()); }
};

}  // namespace skerry::solver
