#include "solver/joint_tree.h"

#include <algorithm>

namespace skerry::solver {
namespace {

using core::kNone;

// Part of a lock's own inverse mass that is added to its pivot: locks that say the same thing twice
// then share the load. A velocity error of as much per unit of impulse is all it costs.
constexpr double kGive = 1e-6;

// The six components of a row on one body; the row's rate is their product with its velocity.
void side_of(const JointRow& row, bool is_a, double (&out)[6]) {
  const V3d& angular = is_a ? row.angular_a : row.angular_b;
  const double sign = is_a ? -1 : 1;
  out[0] = sign * row.linear.x;
  out[1] = sign * row.linear.y;
  out[2] = sign * row.linear.z;
  out[3] = sign * angular.x;
  out[4] = sign * angular.y;
  out[5] = sign * angular.z;
}
void copy_velocity(const JointBody& body, double* out) {
  const double v[6] = {body.linear.x,  body.linear.y,  body.linear.z,
                       body.angular.x, body.angular.y, body.angular.z};
  std::copy_n(v, 6, out);
}
double dot6(const double* a, const double* b) {
  return ((a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])) + (a[4] * b[4] + a[5] * b[5]);
}
// A lock's inverse mass between the bare bodies.
double bare(const JointRow& row, const JointBody& a, const JointBody& b) {
  return dot(row.linear, scaled(a.inv_mass + b.inv_mass, row.linear)) +
         (dot(row.angular_a, a.inv_inertia * row.angular_a) +
          dot(row.angular_b, b.inv_inertia * row.angular_b));
}

}  // namespace

void JointTrees::begin(std::uint32_t constraints, std::uint32_t rows, std::uint32_t dynamic_end) {
  if (links_.size() < constraints) {
    links_.resize(constraints);
    eliminations_.resize(constraints);
  }
  if (nodes_.size() < rows) {
    nodes_.resize(rows);
    slot_.resize(rows, kNone);
  }
  dynamic_end_ = dynamic_end;
}

std::uint32_t JointTrees::slot_of(std::uint32_t row) {
  if (slot_[row] == kNone) {
    slot_[row] = static_cast<std::uint32_t>(rows_.size());
    rows_.push_back(row);
  }
  return slot_[row];
}

void JointTrees::add(std::span<JointRef> joints, std::uint32_t first) {
  rows_.clear();
  for (const JointRef& joint : joints) {
    if (can_move(joint.row_a)) slot_of(joint.row_a);
    if (can_move(joint.row_b)) slot_of(joint.row_b);
  }
  // Joints by body.
  first_at_.assign(rows_.size() + 1, 0);
  const auto for_sides = [&](auto visit) {
    for (std::uint32_t j = 0; j < joints.size(); ++j) {
      if (joints[j].lock_count == 0) continue;
      if (can_move(joints[j].row_a)) visit(slot_[joints[j].row_a], j);
      if (can_move(joints[j].row_b)) visit(slot_[joints[j].row_b], j);
    }
  };
  for_sides([&](std::uint32_t slot, std::uint32_t) { ++first_at_[slot + 1]; });
  for (std::size_t i = 1; i < first_at_.size(); ++i) first_at_[i] += first_at_[i - 1];
  at_.resize(first_at_.back());
  for_sides([&](std::uint32_t slot, std::uint32_t j) { at_[first_at_[slot]++] = j; });
  for (std::size_t i = first_at_.size() - 1; i > 0; --i) first_at_[i] = first_at_[i - 1];
  first_at_[0] = 0;

  order_.clear();
  reached_by_.assign(rows_.size(), kNone);
  seen_.assign(rows_.size(), 0);
  for (std::uint32_t slot = 0; slot < rows_.size(); ++slot) {
    if (!seen_[slot]) visit(joints, slot);
  }
  // Leaves first; into each body what holds it to the unmovable, then it into its parent.
  sorted_.clear();
  for (auto slot = order_.rbegin(); slot != order_.rend(); ++slot) {
    const std::uint32_t row = rows_[*slot];
    for (std::uint32_t i = first_at_[*slot]; i < first_at_[*slot + 1]; ++i) {
      const JointRef& joint = joints[at_[i]];
      const std::uint32_t other = joint.row_a == row ? joint.row_b : joint.row_a;
      if (!can_move(other)) eliminate(joint, row, first);
    }
    if (reached_by_[*slot] == kNone) continue;
    const JointRef& joint = joints[reached_by_[*slot]];
    eliminate(joint, joint.row_a == row ? joint.row_b : joint.row_a, first);
  }
  for (const JointRef& joint : joints) {
    if (joint.lock_count == 0) sorted_.push_back(joint);
  }
  std::copy(sorted_.begin(), sorted_.end(), joints.begin());
  for (const std::uint32_t row : rows_) slot_[row] = kNone;
}

void JointTrees::visit(std::span<const JointRef> joints, std::uint32_t root) {
  std::size_t next = order_.size();
  order_.push_back(root);
  seen_[root] = 1;
  for (; next < order_.size(); ++next) {
    const std::uint32_t slot = order_[next];
    for (std::uint32_t i = first_at_[slot]; i < first_at_[slot + 1]; ++i) {
      const JointRef& joint = joints[at_[i]];
      const std::uint32_t row = joint.row_a == rows_[slot] ? joint.row_b : joint.row_a;
      if (!can_move(row) || seen_[slot_[row]]) continue;
      seen_[slot_[row]] = 1;
      reached_by_[slot_[row]] = at_[i];
      order_.push_back(slot_[row]);
    }
  }
}

void JointTrees::eliminate(const JointRef& joint, std::uint32_t parent, std::uint32_t first) {
  const bool parent_is_a = joint.row_a == parent;
  links_[first + sorted_.size()] = {parent, parent_is_a ? joint.row_b : joint.row_a, parent_is_a};
  sorted_.push_back(joint);
}

void JointTrees::load_mobility(const JointBodies& bodies, std::uint32_t row) {
  const JointBody& body = bodies.at(row);
  auto& m = nodes_[row].mobility;
  for (auto& line : m) std::fill_n(line, 6, 0.0);
  m[0][0] = body.inv_mass.x;
  m[1][1] = body.inv_mass.y;
  m[2][2] = body.inv_mass.z;
  const Sym3d& i = body.inv_inertia;
  m[3][3] = i.xx;
  m[4][4] = i.yy;
  m[5][5] = i.zz;
  m[3][4] = m[4][3] = i.xy;
  m[3][5] = m[5][3] = i.xz;
  m[4][5] = m[5][4] = i.yz;
}

void JointTrees::factorise(const JointArrays& arrays, std::span<const JointConstraint> constraints,
                           std::uint32_t first, std::uint32_t end) {
  for (std::uint32_t k = first; k < end; ++k) {
    if (can_move(constraints[k].row_a)) load_mobility(arrays.bodies, constraints[k].row_a);
    if (can_move(constraints[k].row_b)) load_mobility(arrays.bodies, constraints[k].row_b);
  }
  for (std::uint32_t k = first; k < end; ++k) {
    const JointConstraint& c = constraints[k];
    const int n = c.lock_count;
    if (n == 0) continue;
    const Link& link = links_[k];
    Elimination& e = eliminations_[k];
    Node& parent = nodes_[link.parent];
    const Node* child = can_move(link.child) ? &nodes_[link.child] : nullptr;
    const JointRow* locks = arrays.locks.data() + c.first_lock;
    double p[kMaxLocks][6], q[kMaxLocks][6], beyond[kMaxLocks][6];
    for (int i = 0; i < n; ++i) {
      side_of(locks[i], link.parent_is_a, p[i]);
      side_of(locks[i], !link.parent_is_a, q[i]);
      for (int r = 0; r < 6; ++r) {
        e.answer[i][r] = dot6(parent.mobility[r], p[i]);
        beyond[i][r] = child ? dot6(child->mobility[r], q[i]) : 0.0;
      }
    }
    double w[kMaxLocks][kMaxLocks], scale[kMaxLocks];
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) w[i][j] = dot6(p[i], e.answer[j]) + dot6(q[i], beyond[j]);
      scale[i] = bare(locks[i], arrays.bodies.at(c.row_a), arrays.bodies.at(c.row_b));
      w[i][i] += kGive * scale[i];
    }
    solver::factorise(w, scale, n, 0.5 * kGive, e.factor);
    for (int r = 0; r < 6; ++r) {
      double y[kMaxLocks];
      for (int i = 0; i < n; ++i) y[i] = e.answer[i][r];
      solve_factored(e.factor, n, y);
      for (int s = r; s < 6; ++s) {
        double sum = 0;
        for (int i = 0; i < n; ++i) sum += y[i] * e.answer[i][s];
        parent.mobility[r][s] -= sum;
        parent.mobility[s][r] = parent.mobility[r][s];
      }
    }
  }
}

void JointTrees::load_velocity(JointBodies& bodies, std::uint32_t row) {
  if (!can_move(row)) return;
  copy_velocity(bodies.load(row), nodes_[row].velocity);
  std::fill_n(nodes_[row].impulse, 6, 0.0);
}
void JointTrees::start_at_rest(std::uint32_t row) {
  if (!can_move(row)) return;
  std::fill_n(nodes_[row].velocity, 6, 0.0);
  std::fill_n(nodes_[row].impulse, 6, 0.0);
}

void JointTrees::solve(const JointPass& pass, const JointArrays& arrays,
                       std::span<JointConstraint> constraints, std::uint32_t first,
                       std::uint32_t end) {
  for (std::uint32_t k = first; k < end; ++k) {
    load_velocity(arrays.bodies, constraints[k].row_a);
    load_velocity(arrays.bodies, constraints[k].row_b);
  }
  run(arrays, constraints, first, end, false, [&pass](const JointConstraint& c, int i) {
    return pass.use_bias ? -(pass.inv_h * c.error[i] + c.drift[i]) : 0.0;
  });
}

void JointTrees::correct(const JointPass& pass, const JointArrays& arrays,
                         std::span<JointConstraint> constraints, std::uint32_t first,
                         std::uint32_t end) {
  for (std::uint32_t k = first; k < end; ++k) {
    start_at_rest(constraints[k].row_a);
    start_at_rest(constraints[k].row_b);
  }
  run(arrays, constraints, first, end, true,
      [&pass](const JointConstraint& c, int i) { return -(pass.inv_h * c.error[i]); });
}

template <class Goal>
void JointTrees::run(const JointArrays& arrays, std::span<JointConstraint> constraints,
                     std::uint32_t first, std::uint32_t end, bool still, Goal goal) {
  for (std::uint32_t k = first; k < end; ++k) {
    const JointConstraint& c = constraints[k];
    const int n = c.lock_count;
    const Link& link = links_[k];
    Elimination& e = eliminations_[k];
    if (n == 0) continue;
    Node& parent = nodes_[link.parent];
    double there[6] = {};
    if (!can_move(link.child) && !still) copy_velocity(arrays.bodies.at(link.child), there);
    const double* child = can_move(link.child) ? nodes_[link.child].velocity : there;
    double y[kMaxLocks];
    for (int i = 0; i < n; ++i) {
      const JointRow& lock = arrays.locks[c.first_lock + static_cast<std::uint32_t>(i)];
      double p[6], q[6];
      side_of(lock, link.parent_is_a, p);
      side_of(lock, !link.parent_is_a, q);
      e.rest[i] = goal(c, i) - (dot6(p, parent.velocity) + dot6(q, child));
      y[i] = e.rest[i];
    }
    solve_factored(e.factor, n, y);
    for (int i = 0; i < n; ++i)
      for (int r = 0; r < 6; ++r) parent.velocity[r] += e.answer[i][r] * y[i];
  }
  for (std::uint32_t k = end; k-- > first;) {
    JointConstraint& c = constraints[k];
    const int n = c.lock_count;
    if (n == 0) continue;
    const Link& link = links_[k];
    Elimination& e = eliminations_[k];
    Node& parent = nodes_[link.parent];
    double nowhere[6] = {};
    double* child = can_move(link.child) ? nodes_[link.child].impulse : nowhere;
    for (int i = 0; i < n; ++i) e.rest[i] -= dot6(e.answer[i], parent.impulse);
    solve_factored(e.factor, n, e.rest);
    for (int i = 0; i < n; ++i) {
      const JointRow& lock = arrays.locks[c.first_lock + static_cast<std::uint32_t>(i)];
      double p[6], q[6];
      side_of(lock, link.parent_is_a, p);
      side_of(lock, !link.parent_is_a, q);
      for (int r = 0; r < 6; ++r) {
        parent.impulse[r] += p[r] * e.rest[i];
        child[r] += q[r] * e.rest[i];
      }
      book(c, lock, e.rest[i]);
    }
  }
  const auto push = [&](std::uint32_t row) {
    if (!can_move(row)) return;
    const JointBody& body = arrays.bodies.at(row);
    double* p = nodes_[row].impulse;
    arrays.bodies.store(row, body.linear + scaled(body.inv_mass, V3d{p[0], p[1], p[2]}),
                        body.angular + body.inv_inertia * V3d{p[3], p[4], p[5]});
    std::fill_n(p, 6, 0.0);
  };
  for (std::uint32_t k = first; k < end; ++k) {
    push(constraints[k].row_a);
    push(constraints[k].row_b);
  }
}

}  // namespace skerry::solver
