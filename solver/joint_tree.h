// Joints that form trees, solved at once: what locks them is satisfied exactly in every pass,
// whatever the masses, in time linear in the number of joints.
//
//   Maths    Elimination from the leaves to the root of the constraint equations J M^-1 J^T, kept
//            linear by carrying along the mobility (inverse inertia) of each body with everything
//            beyond it: the articulated-body idea (Featherstone, "Rigid Body Dynamics Algorithms",
//            2008; Baraff, "Linear-Time Dynamics using Lagrange Multipliers", 1996) written with
//            inverse masses, so that locked axes and bodies that cannot move need no special case.
//   Loops    Bodies that cannot move connect nothing: a bridge is a tree. Where dynamic bodies close
//            a loop the whole cluster is solved joint by joint instead (joint_solver.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/joint_constraint.h"

namespace skerry::solver {

// A joint of a group on its way into the solver.
struct JointRef {
  std::uint32_t joint = 0;  // row of core::Joints
  std::uint32_t row_a = 0, row_b = 0;
  std::uint32_t lock_count = 0, axis_count = 0;
  std::uint32_t cluster = 0;
};

class JointTrees {
 public:
  // For constraints numbered below `constraints` between rows below `rows`; rows from `dynamic_end`
  // on, and row 0, cannot move.
  void begin(std::uint32_t constraints, std::uint32_t rows, std::uint32_t dynamic_end);
  // The joints of one cluster, whose locks close no loop between bodies that can move: brings them
  // into the order of elimination, in which they are constraints `first` and on.
  void add(std::span<JointRef> joints, std::uint32_t first);

  // Of the constraints [first, end), whole trees: once they are refreshed, and each time that their
  // locks are to be satisfied.
  void factorise(const JointArrays& arrays, std::span<const JointConstraint> constraints,
                 std::uint32_t first, std::uint32_t end);
  void solve(const JointPass& pass, const JointArrays& arrays,
             std::span<JointConstraint> constraints, std::uint32_t first, std::uint32_t end);
  // Changes velocities by what takes the errors away within a substep, whatever the velocities are.
  void correct(const JointPass& pass, const JointArrays& arrays,
               std::span<JointConstraint> constraints, std::uint32_t first, std::uint32_t end);

 private:
  // How a constraint is eliminated: the child's side into the parent's.
  struct Link {
    std::uint32_t parent = 0, child = 0;  // rows; the parent can move, the child need not
    bool parent_is_a = false;
  };
  struct Elimination {
    BlockFactor factor;
    double answer[kMaxLocks][6];  // mobility of the parent times its rows
    double rest[kMaxLocks];       // velocity to lose, then the impulse
  };
  // A body with all that was eliminated into it: its velocity (linear, angular), the response of that
  // to an impulse, and the impulse it is given.
  struct Node {
    double mobility[6][6];
    double velocity[6];
    double impulse[6];
  };
  bool can_move(std::uint32_t row) const { return row - 1 < dynamic_end_ - 1; }
  std::uint32_t slot_of(std::uint32_t row);
  void visit(std::span<const JointRef> joints, std::uint32_t root);
  void eliminate(const JointRef& joint, std::uint32_t parent, std::uint32_t first);
  void load_velocity(JointBodies& bodies, std::uint32_t row);
  void start_at_rest(std::uint32_t row);
  // From the velocities of the nodes on; `goal` is what each lock's rate should be.
  template <class Goal>
  void run(const JointArrays& arrays, std::span<JointConstraint> constraints, std::uint32_t first,
           std::uint32_t end, bool still, Goal goal);
  void load_mobility(const JointBodies& bodies, std::uint32_t row);

  std::vector<Link> links_;                // [constraints]
  std::vector<Elimination> eliminations_;  // [constraints]
  std::vector<Node> nodes_;                // [rows]
  std::uint32_t dynamic_end_ = 1;

  // Of add(): the bodies of a cluster and their joints.
  std::vector<std::uint32_t> slot_;        // [rows] into rows_, kNone elsewhere
  std::vector<std::uint32_t> rows_;        // of the cluster
  std::vector<std::uint32_t> first_at_;    // [slots + 1] into at_
  std::vector<std::uint32_t> at_;          // joints by body
  std::vector<std::uint32_t> order_;       // slots, breadth first
  std::vector<std::uint32_t> reached_by_;  // [slots] joint from the parent, kNone: root
  std::vector<std::uint8_t> seen_;         // [slots]
  std::vector<JointRef> sorted_;
};

}  // namespace skerry::solver
