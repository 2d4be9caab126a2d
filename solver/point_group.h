// Bodies and contacts of one island group in plain double rows, for the solvers that are there to be
// measured against soft-step TGS (solver/pgs_solver.h, solver/penalty_solver.h). Contacts lie in the
// order of their colours, so that those of a colour can be worked on at once and every way of running
// them gives the same bits.
#pragma once

#include <cstdint>
#include <vector>

#include <skerry/jobs/task_graph.h>

#include "core/step_context.h"
#include "solver/colouring.h"
#include "solver/effect_watch.h"

namespace skerry::solver {

struct PointBody : ContactSide {
  core::BodyIndex body = core::kNone;
  bool solved = false;  // dynamic; others move by their velocity and take no impulse
  bool pushed = false;  // by a contact in this step
  Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s about the centre
  Vec3 center = Vec3::Zero();            // m, from where the step began
  Quat orientation = Quat::Identity();
  Vec3 angle = Vec3::Zero();  // rad: sum of all small turns since the step began
  Vec3 acceleration = Vec3::Zero(), torque = Vec3::Zero();                   // external
  Vec3 impulse = Vec3::Zero(), angular_impulse = Vec3::Zero();               // by contacts so far
  Vec3 correction_linear = Vec3::Zero(), correction_angular = Vec3::Zero();  // see PgsSolver
};

struct PointContact {
  std::uint32_t row_a = 0, row_b = 0, manifold = 0, count = 0;
  Vec3 offset;            // m, centre of b from centre of a at the start
  Vec3 normal, t1, t2;    // n = t1 x t2, from a to b
  Vec3 arm_a, arm_b;      // m, of the mean of the points, at the start
  Vec3 points[4];         // m, arms from a at the start
  double separation[4];   // m, at the start
  double lever[4];        // m, of the points from their mean
  double approach = 0;    // m/s, fastest of the points, at the start
  double start_speed[4];  // m/s, of the points along the normal, at the start
  double friction = 0, restitution = 0, rolling = 0;
  double impulse[4] = {};    // N s, as the solver last had them
  double slide[2] = {0, 0};  // N s along t1, t2
  double twist = 0;          // N m s about n
  double roll[2] = {0, 0};   // N m s about t1, t2
  double total = 0;          // N s along n over the step
};

class PointGroup {
 public:
  static constexpr std::uint32_t kGrain = 64;  // contacts or bodies per block of a wide island

  // Rows for the islands of `group`, which have no joints. Serial.
  void begin(const core::StepContext& step, const core::IslandGroup& group);

  std::vector<PointBody> bodies;  // [0] does not move
  std::vector<PointContact> contacts;
  std::uint32_t colours() const { return static_cast<std::uint32_t>(colour_end_.size()); }
  core::IndexRange colour(std::uint32_t c) const {
    return {c == 0 ? 0 : colour_end_[c - 1], colour_end_[c]};
  }
  std::uint32_t grain() const { return grain_; }
  const core::StepContext& step() const { return *step_; }

  // Impulse on b at world arms from the two centres, the opposite on a.
  void push(PointContact& contact, const Vec3& arm_a, const Vec3& arm_b, const Vec3& impulse);
  void twist(PointContact& contact, const Vec3& angular_impulse);
  Vec3 velocity_at(const PointContact& contact, const Vec3& arm_a, const Vec3& arm_b) const;
  // Velocity of b against a along `out` from a unit impulse along `in`.
  double response(const PointContact& contact, const Vec3& arm_a, const Vec3& arm_b, const Vec3& in,
                  const Vec3& out) const;

  // External forces for h s, before the contacts' impulses.
  void kick(std::uint32_t row, double h);
  // Moves a body by its velocity for h s; a solved one keeps its angular momentum while it turns.
  void drift(std::uint32_t row, double h);

  // Impulses of the last `h` s into the manifold; `gap` of the points now, m.
  void store(const PointContact& contact, const double gap[4], double h);
  void finish(std::uint32_t row);

 private:
  std::uint32_t row_of(core::BodyIndex body);
  void add_body(core::BodyIndex body);
  void add_kinematic(core::BodyIndex body, std::uint32_t kinematic);
  void add_contact(const core::ContactRef& ref, std::uint32_t row_a, std::uint32_t row_b);

  const core::StepContext* step_ = nullptr;
  std::uint32_t first_body_ = 0, body_count_ = 0;
  std::uint32_t grain_ = 0;
  std::vector<Vec3> start_center_;
  std::vector<std::uint32_t> kinematic_row_, used_kinematics_;
  std::vector<std::uint32_t> row_a_, row_b_, order_, colour_end_;
  Colouring colouring_;
};

// Work on one colour, or on all bodies, as phases of blocks.
class PointProgram : public jobs::PhaseProgram {
 public:
  std::uint32_t phase_count() const override { return static_cast<std::uint32_t>(phases_.size()); }
  std::uint32_t block_count(std::uint32_t phase) const override;
  void run_block(std::uint32_t phase, std::uint32_t block, std::uint32_t worker) override;
  void run_serially();

 protected:
  using Op = std::uint8_t;
  virtual void run_contact(Op op, PointContact& contact) = 0;
  virtual void run_body(Op op, std::uint32_t row) = 0;

  void clear_phases() { phases_.clear(); }
  void add_contacts(Op op);  // colour by colour
  void add_bodies(Op op);

  PointGroup group_;

 private:
  struct Phase {
    Op op;
    bool bodies;
    core::IndexRange items;
  };
  std::vector<Phase> phases_;
};

// New value of a two-component impulse p inside a circle, given the velocities v that it should bring
// to rest and their response k11 k12 k22 to it.
void limit_to_disc(double k11, double k12, double k22, double limit, double v1, double v2,
                   double p[2]);

}  // namespace skerry::solver
