// Joints that form trees, solved at once: what locks them is satisfied exactly in every pass,
// whatever the masses, in time linear in the number of joints.
//
//   Maths    Elimination from the leaves to the root of the constraint equations J M^-1 J^T, kept
//            linear by carrying along the mobility (inverse inertia) of each body with everything
//            beyond it: the articulated-body idea (Featherstone, "Rigid Body Dynamics Algorithms",
//            2008; Baraff, "Linear-Time Dynamics using Lagrange Multipliers", 1996) written with
//            inverse masses, so that locked axes and bodies that cannot move need no special case.
//   Loops    Bodies that cannot move connect nothing: a bridge is a tree. Joints that close loops
//            between bodies that can move are left out of the tree; the impulses in them follow from
//            how the tree answers a unit impulse along each of their locks (Schur complement), which
//            is exact too. Clusters with too many are solved joint by joint (joint_solver.h).
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

// The constraints of a cluster in their order: those of a tree, those that close loops in it, those
// that lock nothing.
struct JointTree {
  std::uint32_t first = 0, closing = 0, closed = 0, end = 0;
  std::uint32_t closing_rows = 0;  // locks that close loops
  std::size_t closing_factor = 0;  // their matrix in JointTrees
  bool smooth = false;
};

// Clusters are solved at once up to so many locks that close loops, and up to this product of them
// and of joints: the tree is passed once for each, twice a substep (docs/decisions/0021).
inline constexpr std::uint32_t kMostClosingRows = 48;
inline constexpr std::uint32_t kMostClosingWork = 2048;

class JointTrees {
 public:
  // For constraints numbered below `constraints` between rows below `rows`; rows from `dynamic_end`
  // on, and row 0, cannot move.
  void begin(std::uint32_t constraints, std::uint32_t rows, std::uint32_t dynamic_end);
  // The joints of one cluster: brings them into the order of elimination, in which they are
  // constraints `first` and on.
  JointTree add(std::span<JointRef> joints, std::uint32_t first);

  // Once the constraints of a tree are refreshed, and each time that their locks are to be satisfied.
  void factorise(const JointArrays& arrays, std::span<const JointConstraint> constraints,
                 const JointTree& tree);
  void solve(const JointPass& pass, const JointArrays& arrays,
             std::span<JointConstraint> constraints, const JointTree& tree);
  // Changes velocities by what takes the errors away within a substep, whatever the velocities are.
  void correct(const JointPass& pass, const JointArrays& arrays,
               std::span<JointConstraint> constraints, const JointTree& tree);

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
  void load_velocities(const JointArrays& arrays, std::span<const JointConstraint> constraints,
                       const JointTree& tree);
  void start_at_rest(std::span<const JointConstraint> constraints, const JointTree& tree);
  // From the velocities of the nodes to the impulses of the tree's locks and of the nodes; `goal` is
  // what each lock's rate should be.
  template <class Goal>
  void eliminate_up(const JointArrays& arrays, std::span<const JointConstraint> constraints,
                    const JointTree& tree, bool still, Goal goal);
  void substitute_down(const JointArrays& arrays, std::span<const JointConstraint> constraints,
                       const JointTree& tree);
  // Both, then books the impulses and changes the bodies.
  template <class Goal>
  void run(const JointArrays& arrays, std::span<JointConstraint> constraints, const JointTree& tree,
           bool still, Goal goal);
  void load_mobility(const JointBodies& bodies, std::uint32_t row);
  // The locks that close loops.
  void factorise_closing(const JointArrays& arrays, std::span<const JointConstraint> constraints,
                         const JointTree& tree);
  // `lacking`: by how much each one's rate falls short of its goal.
  void close(const JointArrays& arrays, std::span<JointConstraint> constraints,
             const JointTree& tree, double* lacking);

  std::vector<Link> links_;                // [constraints]
  std::vector<Elimination> eliminations_;  // [constraints]
  std::vector<Node> nodes_;                // [rows]
  std::vector<double> closing_;            // factors of the trees, lower triangles row by row
  std::uint32_t dynamic_end_ = 1;

  // Of add(): the bodies of a cluster and their joints.
  std::vector<std::uint32_t> slot_;        // [rows] into rows_, kNone elsewhere
  std::vector<std::uint32_t> rows_;        // of the cluster
  std::vector<std::uint32_t> first_at_;    // [slots + 1] into at_
  std::vector<std::uint32_t> at_;          // joints by body
  std::vector<std::uint32_t> order_;       // slots, breadth first
  std::vector<std::uint32_t> reached_by_;  // [slots] joint from the parent, kNone: root
  std::vector<std::uint8_t> seen_;         // [slots]
  std::vector<std::uint8_t> in_tree_;      // [joints]
  std::vector<JointRef> sorted_;
};

}  // namespace skerry::solver
