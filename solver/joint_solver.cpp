#include "solver/joint_solver.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/growth.h"

namespace skerry::solver {
namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

void JointBatch::begin(std::uint32_t first_body, std::uint32_t rows, std::uint32_t dynamic_end,
                       std::uint32_t grain, std::span<const std::uint8_t> yields) {
  chunks_.clear();
  colour_chunks_.assign(1, 0);
  if (refs_.empty()) return;
  grain_ = grain;
  set_passes();
  bodies.begin(rows, dynamic_end);
  trees_.begin(static_cast<std::uint32_t>(refs_.size()), rows, dynamic_end);
  find_clusters(dynamic_end);
  own_bodies(first_body, yields);
  add_trees();
  find_stiffness();
  add_loops(dynamic_end);
  place_rows();
}

void JointBatch::set_passes() {
  const SolverSettings& solver = step_->settings->solver;
  substeps_ = static_cast<std::uint32_t>(solver.substeps);
  const double h = step_->dt / solver.substeps;
  rigid_.h = h;
  rigid_.inv_h = 1 / h;
  soft_ = rigid_;
  // Stiffer than half the substep rate would ring.
  const double omega = 2 * kPi * std::min(solver.joint_hertz, 0.5 / h);
  const double a1 = 2 * solver.joint_damping_ratio + h * omega, a2 = h * omega * a1;
  rigid_.bias_rate = soft_.bias_rate = omega / a1;
  rigid_.mass_scale = soft_.mass_scale = a2 / (1 + a2);
  rigid_.keep = soft_.keep = a2 / (1 + a2);
}

// ---- Clusters: joints connected through bodies that can move.

std::uint32_t JointBatch::root_of(std::uint32_t row) {
  while (parent_[row] != row) {
    parent_[row] = parent_[parent_[row]];
    row = parent_[row];
  }
  return row;
}

void JointBatch::find_clusters(std::uint32_t dynamic_end) {
  core::grow(parent_, dynamic_end);
  core::grow(looped_, dynamic_end);
  core::grow(size_, dynamic_end);
  for (std::uint32_t row = 0; row < dynamic_end; ++row) parent_[row] = row;
  std::fill_n(looped_.begin(), dynamic_end, std::uint8_t{0});
  std::fill_n(size_.begin(), dynamic_end, ClusterSize{0, 0});
  closing_.clear();
  const auto can_move = [&](std::uint32_t row) { return row - 1 < dynamic_end - 1; };
  // Those with locks first: only they can close a loop.
  for (const bool locking : {true, false}) {
    for (const JointRef& ref : refs_) {
      if ((ref.lock_count > 0) != locking || !can_move(ref.row_a) || !can_move(ref.row_b)) continue;
      const std::uint32_t a = root_of(ref.row_a), b = root_of(ref.row_b);
      if (a != b) {
        parent_[std::max(a, b)] = std::min(a, b);
      } else if (locking) {
        closing_.push_back({a, ref.lock_count});
      }
    }
  }
  for (JointRef& ref : refs_) {
    ref.cluster = root_of(can_move(ref.row_a) ? ref.row_a : ref.row_b);
    ++size_[ref.cluster].joints;
  }
  for (const Closing& closing : closing_) size_[root_of(closing.row)].closing_rows += closing.locks;
  for (const Closing& closing : closing_) {
    const std::uint32_t root = root_of(closing.row);
    const auto [joints, rows] = size_[root];
    looped_[root] = rows > kMostClosingRows || rows * joints > kMostClosingWork;
  }
}

void JointBatch::own_bodies(std::uint32_t first_body, std::span<const std::uint8_t> yields) {
  core::grow(answers_, parent_.size());
  for (std::uint32_t i = 0; i < island_count_; ++i) {
    const core::Island& island = step_->islands->islands[first_island_ + i];
    if (island.joint_count == 0) continue;
    // Without contacts an island is one cluster.
    const std::uint32_t row = island.first_body - first_body + 1;
    const bool smooth = island.contact_count == 0 && !looped_[root_of(row)];
    bodies.own(row, island.body_count, smooth, island.contact_count > 0);
    std::fill_n(answers_.begin() + row, island.body_count, island.contact_count > 0 && !yields[i]);
  }
}

// ---- Order of constraints: trees, then colours.

void JointBatch::add_trees() {
  loops_.clear();
  std::erase_if(refs_, [&](const JointRef& ref) {
    if (looped_[ref.cluster]) loops_.push_back(ref);
    return looped_[ref.cluster] != 0;
  });
  std::sort(refs_.begin(), refs_.end(), [](const JointRef& a, const JointRef& b) {
    return std::tie(a.cluster, a.joint) < std::tie(b.cluster, b.joint);
  });
  tree_list_.clear();
  const auto count = static_cast<std::uint32_t>(refs_.size());
  std::uint32_t first_tree = 0;
  const auto close_chunk = [&] {
    const auto end = static_cast<std::uint32_t>(tree_list_.size());
    if (end > first_tree) chunks_.push_back({first_tree, end, true});
    first_tree = end;
  };
  for (std::uint32_t first = 0, end = 0; first < count; first = end) {
    while (end < count && refs_[end].cluster == refs_[first].cluster) ++end;
    tree_list_.push_back(trees_.add({refs_.data() + first, end - first}, first));
    tree_list_.back().smooth = bodies.smooth(refs_[first].cluster);
    if (end - tree_list_[first_tree].first >= grain_) close_chunk();
  }
  close_chunk();
}

void JointBatch::add_loops(std::uint32_t dynamic_end) {
  const auto count = static_cast<std::uint32_t>(loops_.size());
  row_a_.clear();
  row_b_.clear();
  for (const JointRef& ref : loops_) {
    row_a_.push_back(ref.row_a);
    row_b_.push_back(ref.row_b);
  }
  colouring_.run(row_a_.data(), row_b_.data(), count, dynamic_end);
  const std::uint32_t colours = colouring_.colours;
  // Counting sort by colour, stable.
  const auto trees = static_cast<std::uint32_t>(refs_.size());
  colour_end_.assign(colours + 1, trees);
  for (std::uint32_t i = 0; i < count; ++i) ++colour_end_[colouring_.colour[i] + 1];
  for (std::uint32_t c = 0; c < colours; ++c) colour_end_[c + 1] += colour_end_[c] - trees;
  refs_.resize(trees + count);
  for (std::uint32_t i = 0; i < count; ++i) {
    refs_[colour_end_[colouring_.colour[i]]++] = loops_[i];
  }
  std::uint32_t first = trees;
  for (std::uint32_t c = 0; c < colours; ++c) {
    for (const std::uint32_t end = colour_end_[c]; first < end;) {
      const std::uint32_t until = end - first < 2 * grain_ ? end : first + grain_;
      chunks_.push_back({first, until, false});
      first = until;
    }
    colour_chunks_.push_back(static_cast<std::uint32_t>(chunks_.size()));
  }
  if (colours == 0) colour_chunks_.push_back(static_cast<std::uint32_t>(chunks_.size()));
}

// Forces that pull at arms which turn are springs too (geometric stiffness: Tournier, Nesme, Gilles and
// Faure, "Stable constrained dynamics", 2015; adaptive as in Andrews, Teichmann and Kovecses,
// "Geometric stiffness for real-time constrained multibody dynamics", 2017). As of the last step.
void JointBatch::find_stiffness() {
  const auto add = [&](std::uint32_t row, core::BodyIndex body, const Vec3& anchor,
                       const V3d& force) {
    if (!bodies.solved(row)) return;
    const V3d arm = rotate(scalars(step_->bodies->pose[body].orientation), scalars(anchor));
    const double along = dot(arm, force);
    bodies.add_stiffness(row,
                         {along - arm.x * force.x, -0.5 * (arm.x * force.y + arm.y * force.x),
                          -0.5 * (arm.x * force.z + arm.z * force.x), along - arm.y * force.y,
                          -0.5 * (arm.y * force.z + arm.z * force.y), along - arm.z * force.z});
  };
  for (const JointRef& ref : refs_) {
    const core::Joint& joint = step_->joints->rows[ref.joint];
    const V3d force = scalars(joint.force);
    add(ref.row_a, joint.a, joint.anchor_a, -force);
    add(ref.row_b, joint.b, joint.anchor_b, force);
  }
}

void JointBatch::place_rows() {
  core::grow(constraints_, refs_.size());
  std::uint32_t lock = 0, axis = 0;
  for (std::size_t i = 0; i < refs_.size(); ++i) {
    constraints_[i].first_lock = lock;
    constraints_[i].first_axis = axis;
    lock += refs_[i].lock_count;
    axis += refs_[i].axis_count;
  }
  core::grow(locks_, lock);
  core::grow(axes_, axis);
}

// ---- In and out.

void JointBatch::prepare(std::uint32_t index) {
  const JointRef& ref = refs_[index];
  const core::Joint& joint = step_->joints->rows[ref.joint];
  JointConstraint& c = constraints_[index];
  c.joint = ref.joint;
  c.row_a = ref.row_a;
  c.row_b = ref.row_b;
  c.lock_count = joint.lock_count;
  c.axis_count = static_cast<std::uint8_t>(joint.axes.size());
  c.in_tree = !looped_[ref.cluster];
  c.mounts = {scalars(joint.anchor_a), scalars(joint.anchor_b), scalars(joint.frame_a),
              scalars(joint.frame_b)};
  // Row 0 is the world frame: what is mounted on a fixed body is mounted there.
  const auto mount_in_world = [&](std::uint32_t row, core::BodyIndex body, V3d& anchor,
                                  Q4d& frame) {
    if (row != 0 || body == core::kNone) return;
    const core::BodyPose& pose = step_->bodies->pose[body];
    anchor = scalars(pose.center) + rotate(scalars(pose.orientation), anchor);
    frame = scalars(pose.orientation) * frame;
  };
  mount_in_world(ref.row_a, joint.a, c.mounts.anchor_a, c.mounts.frame_a);
  mount_in_world(ref.row_b, joint.b, c.mounts.anchor_b, c.mounts.frame_b);
  c.with_angles = false;
  for (int i = 0; i < joint.lock_count; ++i) {
    c.with_angles = c.with_angles || is_angular(joint.locks[static_cast<std::size_t>(i)]);
    c.impulse[i] = joint.impulse[static_cast<std::size_t>(i)];
  }
  for (std::size_t i = 0; i < joint.axes.size(); ++i) {
    const core::DrivenAxis& desc = joint.axes[i];
    c.with_angles = c.with_angles || is_angular(desc.coordinate);
    JointAxisState& axis = axes_[c.first_axis + i];
    axis = {};
    for (std::size_t law = 0; law < core::kJointLaws; ++law) {
      axis.law[law].impulse = desc.impulse[law];
      axis.law[law].active = is_active(desc, static_cast<core::JointLaw>(law));
    }
  }
  c.force = c.torque = {0, 0, 0};
}

void JointBatch::store(std::uint32_t index) {
  const JointConstraint& c = constraints_[index];
  core::Joint& joint = step_->joints->rows[c.joint];
  // A joint whose bodies went non-finite starts cold.
  const bool finite = std::isfinite(dot(c.force, c.force) + dot(c.torque, c.torque));
  const bool smooth = bodies.smooth(c.row_a) || bodies.smooth(c.row_b);
  const double whole = smooth ? 1 / kHalfKick : 1;
  for (std::size_t i = 0; i < c.lock_count; ++i) joint.impulse[i] = finite ? c.impulse[i] : 0.0;
  for (std::size_t i = 0; i < c.axis_count; ++i) {
    for (std::size_t law = 0; law < core::kJointLaws; ++law) {
      const double impulse = axes_[c.first_axis + i].law[law].impulse * whole;
      joint.axes[i].impulse[law] = finite && std::isfinite(impulse) ? impulse : 0.0;
    }
  }
  joint.force = finite ? vector(c.force * (1 / step_->dt)) : Vec3::Zero();
  joint.torque = finite ? vector(c.torque * (1 / step_->dt)) : Vec3::Zero();
  joint.broken =
      joint.force.norm() > joint.breaks.force || joint.torque.norm() > joint.breaks.torque;
}

// ---- Passes.

void JointBatch::run(JointOp op, std::uint32_t substep, std::uint32_t index) {
  const Chunk& chunk = chunks_[index];
  if (op == JointOp::prepare) return for_constraints(chunk, &JointBatch::prepare);
  if (op == JointOp::store) return for_constraints(chunk, &JointBatch::store);
  for (std::uint32_t i = chunk.first; i < chunk.end; ++i) {
    if (chunk.trees) {
      run_tree(op, substep, tree_list_[i]);
    } else {
      run_loop(op, constraints_[i]);
    }
  }
}

void JointBatch::for_constraints(const Chunk& chunk, void (JointBatch::*visit)(std::uint32_t)) {
  const std::uint32_t first = chunk.trees ? tree_list_[chunk.first].first : chunk.first;
  const std::uint32_t end = chunk.trees ? tree_list_[chunk.end - 1].end : chunk.end;
  for (std::uint32_t i = first; i < end; ++i) (this->*visit)(i);
}

bool JointBatch::answers(const JointConstraint& c) const {
  return answers_[bodies.solved(c.row_a) ? c.row_a : c.row_b] != 0;
}

void JointBatch::run_tree(JointOp op, std::uint32_t substep, const JointTree& tree) {
  if (op == JointOp::close && !tree.smooth) return;
  if (op == JointOp::answer && !answers(constraints_[tree.first])) return;
  const std::span<JointConstraint> all(constraints_);
  const JointArrays shared = arrays();
  JointPass pass = rigid_;
  pass.use_bias = op == JointOp::warm_start || op == JointOp::solve || op == JointOp::answer;
  double before = 1;  // kick that the impulses belong to
  if (tree.smooth) {
    const bool close = op == JointOp::close;
    pass.kick = close ? kHalfKick : kick(substep);
    before = close ? kick(substeps_ - 1) : substep == 0 ? 1 : kick(substep - 1);
  }
  for (std::uint32_t i = tree.first; i < tree.end; ++i) {
    JointConstraint& c = all[i];
    if (op == JointOp::close) restart_drives(step_->joints->rows[c.joint], pass, shared, c);
    if (op == JointOp::warm_start || op == JointOp::relax) {
      refresh(step_->joints->rows[c.joint], pass, shared, c);
    }
    if (c.axis_count == 0) continue;
    if (op == JointOp::warm_start || op == JointOp::close) {
      warm_start(shared, c, pass.kick / before);
    }
    if (op != JointOp::warm_start) solve(pass, shared, c);
  }
  if (op == JointOp::warm_start || op == JointOp::relax) {
    trees_.factorise(shared, all, tree);
  }
  if (op != JointOp::warm_start) trees_.solve(pass, shared, all, tree);
  if (op != JointOp::solve || !tree.smooth) return;
  // Once more with the gaps that turning arms leave (a second step of Newton's method).
  for (std::uint32_t i = tree.first; i < tree.end; ++i) {
    look_ahead(step_->joints->rows[all[i].joint], pass, bodies, all[i]);
  }
  trees_.correct(pass, shared, all, tree);
}

void JointBatch::run_loop(JointOp op, JointConstraint& c) {
  if (op == JointOp::close || (op == JointOp::answer && !answers(c))) return;
  JointPass pass = soft_;
  pass.use_bias = op != JointOp::relax;
  if (op == JointOp::warm_start || op == JointOp::relax)
    refresh(step_->joints->rows[c.joint], pass, arrays(), c);
  if (op == JointOp::warm_start) {
    warm_start(arrays(), c, 1);
  } else {
    solve(pass, arrays(), c);
  }
}

}  // namespace skerry::solver
