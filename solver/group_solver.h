// Solves the islands of one group over a whole step, as a program of phases. A packed group runs
// its phases one after another on one worker, each in one block; a wide island runs the very same
// phases in smaller blocks on all workers. The order in which a body's constraints are applied is
// that of the colours in both cases, hence the same bits.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include <skerry/jobs/task_graph.h>

#include "core/step_context.h"
#include "solver/colouring.h"
#include "solver/contact_blocks.h"
#include "solver/held_directions.h"
#include "solver/joint_solver.h"
#include "solver/solver_body.h"
#include "solver/standing_loads.h"

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
    balance,
    store,
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
  // What contacts gave to a body over the step, in double.
  struct alignas(64) Ledger {
    double impulse[3] = {}, angular_impulse[3] = {};  // N s, N m s
    float bounce_time = 0;  // s, if it bounced; all else zero to begin with
    bool pushed = false, impact = false, bounced = false, several = false;
    HeldDirections held;
  };
  // What becomes of a body without contacts.
  struct Outlook {
    Vec3 linear;            // m/s after external forces
    Vec3 angular_momentum;  // likewise
    float smooth_change;    // m/s: a velocity change up to this is a force's work, not an impact
    bool from_rows;         // damping: contacts alone do not account for the motion
  };
  struct Contact {
    double offset[3];  // m, centre of b from centre of a at the time of the manifold's geometry
    std::uint32_t manifold;
    ContactKind kind;
    std::uint8_t effort;  // its island's: 2^effort passes instead of one
    // Manifolds that are likely to need the same of solve_normals lie side by side in blocks. No lane
    // knows its neighbours: a matter of speed alone.
    bool loose;
  };
  struct alignas(64) Memory {
    std::byte bytes[64];
  };

  void set_constants();
  void assign_rows();
  void collect(jobs::Task& task);
  void collect_contacts(std::uint32_t begin, std::uint32_t end);
  void seat_kinematics();
  void set_efforts();
  void set_standing_loads();
  void share_loads(const core::Island& island, std::uint32_t begin);
  static bool is_unsettled(const core::Manifold& manifold);
  bool is_reloaded(const core::Island& island) const;
  bool is_slow(const core::Island& island) const;
  bool is_plain(const core::Island& island, std::uint32_t begin) const;
  void add_standing_bodies(const core::Island& island);
  void add_support(std::uint32_t contact);
  double heavy_on_light(std::uint32_t begin, std::uint32_t end) const;
  static std::uint8_t effort_of(double ratio, std::uint32_t contacts);
  static bool is_loose(const core::Manifold& manifold);
  ContactKind kind_of(const core::Manifold& manifold, std::uint32_t row_a,
                      std::uint32_t row_b) const;
  std::uint32_t row_of(core::BodyIndex body);
  std::uint32_t seat(std::uint32_t kinematic, core::BodyIndex body);
  // Row (kNone: not seated yet) and centre of a body whose slot in IslandScratch is known.
  std::uint32_t row_in(std::uint32_t slot) const;
  const Vec3& center_in(std::uint32_t slot, core::BodyIndex body) const;
  void bucket_contacts();
  void make_chunks();
  void list_phases();
  void add_phase(Op op);
  void add_colours(Op op);

  void gather_rows(std::uint32_t begin, std::uint32_t end);
  void gather_body(std::uint32_t row);
  float damping_factor(double damping) const;
  void gather_kinematic(std::uint32_t row);
  void prepare_chunk(const Chunk& chunk);
  void fill_lane(LaneInput& input, std::uint32_t lane, std::uint32_t contact) const;
  void fill_full(LaneInput& input, std::uint32_t lane, std::uint32_t contact, bool impact) const;
  // What turns of a body at some time, world.
  struct Spin {
    core::Sym3f inv_inertia;  // kg^-1 m^-2
    core::V3f angular;        // rad/s
  };
  Spin spin_after(std::uint32_t row, double time) const;
  void fill_side(LaneInput& input, bool is_b, std::uint32_t lane, std::uint32_t row,
                 double time) const;
  void set_impact_times();
  void find_held();
  bool is_forced(std::uint32_t row) const;
  float first_impact(std::uint32_t begin, std::uint32_t end) const;
  float touch_time(std::uint32_t contact) const;
  bool touches(std::uint32_t contact) const;
  double time_of_impacts(std::uint32_t contact) const;
  bool flies(std::uint32_t row) const;
  Vec3 way(std::uint32_t row, double time) const;
  Vec3 offset_after(std::uint32_t contact, double from, double time) const;
  Vec3 torque_on(std::uint32_t row) const;
  double time_of_impact(std::uint32_t row) const;
  void fly_rows(std::uint32_t begin, std::uint32_t end);
  void go_by_substeps(std::uint32_t row, const Vec3& linear, const Vec3& spin,
                      core::BodyPose& next) const;
  void note_push(std::uint32_t index, bool bounced);
  Vec3 parted(std::uint32_t row) const;
  void balance_parted();
  void balance_parted(std::uint32_t begin, std::uint32_t end);
  core::BodyPose pose_after_impact(std::uint32_t row, double time) const;
  void store_chunk(const Chunk& chunk);
  void book(const LaneOutput& output, std::uint32_t lane, std::uint32_t contact);
  void carry(core::Manifold& manifold, float load) const;
  void judge(std::uint32_t contact);
  void finish_rows(std::uint32_t begin, std::uint32_t end);
  void finish_body(std::uint32_t row);
  void add_joint_colours(Op op);
  void run_joints(const Phase& phase, std::uint32_t block);
  void integrate_velocities(std::uint32_t begin, std::uint32_t end, std::uint32_t substep);
  void integrate_positions(std::uint32_t begin, std::uint32_t end);
  void finish_jointed(std::uint32_t row);
  void run_contacts(const Phase& phase, const Chunk& chunk);
  const ContactPass& relax_pass(const Phase& phase) const;
  static bool is_bounce(Op op);
  void take_back_chunk(const Chunk& chunk);
  void rebalance_rows(std::uint32_t begin, std::uint32_t end);

  const core::StepContext* step_ = nullptr;
  core::IslandGroup group_;
  const ContactKernels* kernels_ = nullptr;
  ContactPass pass_, unbooked_pass_, last_pass_;
  std::uint32_t first_body_ = 0, body_count_ = 0;  // in Islands::bodies
  std::uint32_t row_count_ = 0, padded_rows_ = 0;
  std::uint32_t body_grain_ = 0, block_grain_ = 0;
  bool has_locks_ = false, has_reloaded_ = false;
  bool unequal_masses_ = false;  // some body is kHeavyOnLight times as heavy as another
  // Of the contacts: whether materials bounce, whether some begin with their bodies at rest, whether some
  // have pressed for long since loads were shared, whether kinematic bodies have no rows yet.
  std::atomic<bool> has_bounces_ = false, has_placed_ = false, has_unsettled_ = false,
                    meets_kinematics_ = false;
  std::atomic<bool> bounces_ = false;  // in this step
  float carry_part_ =
      0;  // of the way to the present load that Manifold::carried_impulse goes in a step

  std::vector<VelocityRow> velocity_, start_, forced_;
  std::vector<DeltaRow> delta_;
  std::vector<MassRow> mass_;
  std::vector<BaseRow> base_;
  std::vector<SpinRow> spin_;
  std::vector<Ledger> ledger_;
  std::vector<DeltaRow> flown_;        // [rows] see ContactPass; written where contacts may bounce
  std::vector<core::V3f> flown_from_;  // [rows] m, their translation before bodies were parted
  std::vector<Outlook> outlook_;
  std::vector<float> impact_time_;  // [rows] s, when impacts among several of its island happen
  std::vector<std::uint8_t> held_;  // [rows] see find_held
  std::vector<core::BodyIndex> body_;
  std::vector<std::uint32_t> kinematic_row_;  // [kinematics of the step] or 0
  std::vector<std::uint32_t> used_kinematics_;

  std::uint32_t first_contact_ = 0, contact_count_ = 0;  // in Islands::contacts
  std::vector<Contact> contacts_;
  StandingLoads standing_loads_;
  std::vector<std::uint32_t> row_a_, row_b_;
  Colouring colouring_;
  std::uint32_t efforts_ = 1;          // one more than the highest of the group
  std::vector<std::uint8_t> yields_;   // [islands of the group] joints do not answer contacts
  std::vector<std::uint32_t> bucket_;  // [(effort, colour, kind, loose)] first lane
  std::vector<std::uint32_t> lanes_;   // contact of each lane, kNone: padding
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> colour_chunks_;  // [(effort, colour) + 1] first chunk
  std::vector<Memory> memory_;
  std::byte* block_memory() { return reinterpret_cast<std::byte*>(memory_.data()); }
  std::vector<Phase> phases_;

  JointBatch joints_;
  std::uint32_t substep_ = 0;  // that phases are being listed for; in the end, how many there are
};

}  // namespace skerry::solver
