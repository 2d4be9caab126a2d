// Joints of one island group over the substeps of a step.
//
//   Kinds    Clusters of joints whose locks form trees, or trees and a few loops, are solved at once
//            and exactly (solver/joint_tree.h). Those with many loops are solved joint by joint as
//            soft constraints with a relax pass (Catto, "Soft Constraints", GDC 2011; "Solver2D",
//            2024), coloured so that those of a colour share no body that can move. Axes (limits,
//            motors, springs, friction) are solved joint by joint in both.
//   Numbers  All in double, at the poses of each substep (solver/joint_bodies.h).
//   Order    Chunks: trees first, then colour by colour; within a chunk front to back. What a joint
//            meets depends on its own island alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/step_context.h"
#include "solver/colouring.h"
#include "solver/joint_bodies.h"
#include "solver/joint_constraint.h"
#include "solver/joint_tree.h"

namespace skerry::solver {

// What is done with a chunk of joints. Each substep: kick the bodies, warm_start, solve, drift, relax;
// contacts are solved after solve, and answer is solve once more for those that contacts have pushed;
// after the last substep smooth bodies are kicked once more and closed.
enum class JointOp : std::uint8_t { prepare, warm_start, solve, answer, relax, close, store };

class JointBatch {
 public:
  JointBodies bodies;

  // The joints of the step's islands [first, first + count); row_of(BodyIndex) gives the row in the
  // group, 0 for bodies that do not move.
  template <class RowOf>
  void collect(const core::StepContext& step, std::uint32_t first, std::uint32_t count,
               RowOf row_of);
  // Once all rows are known: owned bodies, clusters, colours, chunks of at least `grain` joints.
  // `yields`, of the step's islands: their contacts have the last word, joints do not answer them.
  void begin(std::uint32_t first_body, std::uint32_t rows, std::uint32_t dynamic_end,
             std::uint32_t grain, std::span<const std::uint8_t> yields);
  bool empty() const { return refs_.empty(); }

  // Chunks of one colour may run at once; colours follow each other. Trees are in colour 0.
  std::uint32_t colours() const { return static_cast<std::uint32_t>(colour_chunks_.size()) - 1; }
  std::uint32_t first_chunk(std::uint32_t colour) const { return colour_chunks_[colour]; }
  std::uint32_t chunks() const { return static_cast<std::uint32_t>(chunks_.size()); }
  // `substep` counts from 0.
  void run(JointOp op, std::uint32_t substep, std::uint32_t chunk);

  double h() const { return rigid_.h; }  // s, of a substep
  // Fraction of a substep that smooth bodies are kicked for before this substep, and in the end.
  static double kick(std::uint32_t substep) { return substep == 0 ? kHalfKick : 1; }
  static constexpr double kHalfKick = 0.5;

 private:
  struct Chunk {
    std::uint32_t first, end;  // trees or constraints
    bool trees;
  };
  void set_passes();
  void find_clusters(std::uint32_t dynamic_end);
  std::uint32_t root_of(std::uint32_t row);
  void own_bodies(std::uint32_t first_body, std::span<const std::uint8_t> yields);
  void add_trees();
  void add_loops(std::uint32_t dynamic_end);
  void find_stiffness();
  void place_rows();
  JointArrays arrays() { return {locks_, axes_, bodies}; }
  void for_constraints(const Chunk& chunk, void (JointBatch::*visit)(std::uint32_t));
  void prepare(std::uint32_t constraint);
  void store(std::uint32_t constraint);
  bool answers(const JointConstraint& c) const;
  void run_tree(JointOp op, std::uint32_t substep, const JointTree& tree);
  void run_loop(JointOp op, JointConstraint& c);

  const core::StepContext* step_ = nullptr;
  JointPass rigid_, soft_;
  std::uint32_t grain_ = 1, substeps_ = 1, first_island_ = 0, island_count_ = 0;
  std::vector<JointRef> refs_;  // trees first
  std::vector<JointRef> loops_;
  std::vector<std::uint32_t> parent_;  // [rows] union-find
  std::vector<std::uint8_t> looped_;   // [rows] of cluster roots
  std::vector<std::uint8_t> answers_;  // [rows] whose joints answer contacts
  struct Closing {
    std::uint32_t row, locks;  // at which a joint closed a loop, and with how many locks
  };
  std::vector<Closing> closing_;
  struct ClusterSize {
    std::uint32_t joints, closing_rows;
  };
  std::vector<ClusterSize> size_;  // [rows] of cluster roots
  std::vector<JointTree> tree_list_;
  std::vector<std::uint32_t> row_a_, row_b_;  // of loops_
  Colouring colouring_;
  std::vector<std::uint32_t> colour_end_;
  std::vector<JointConstraint> constraints_;
  std::vector<JointRow> locks_;
  std::vector<JointAxisState> axes_;
  JointTrees trees_;
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> colour_chunks_;  // [colours + 1]
};

template <class RowOf>
void JointBatch::collect(const core::StepContext& step, std::uint32_t first, std::uint32_t count,
                         RowOf row_of) {
  step_ = &step;
  first_island_ = first;
  island_count_ = count;
  refs_.clear();
  const core::Islands& islands = *step.islands;
  const core::Island& last = islands.islands[first + count - 1];
  const std::uint32_t end = last.first_joint + last.joint_count;
  for (std::uint32_t i = islands.islands[first].first_joint; i < end; ++i) {
    const core::Joint& joint = step.joints->rows[islands.joints[i]];
    refs_.push_back({islands.joints[i], row_of(joint.a), row_of(joint.b), joint.lock_count,
                     static_cast<std::uint32_t>(joint.axes.size()), 0});
  }
}

}  // namespace skerry::solver
