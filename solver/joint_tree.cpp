#include "solver/joint_tree.h"

#include <algorithm>

namespace skerry::solver {
namespace {

using core::kNone;

// Part of a lock's own inverse mass that is added to its pivot: a velocity error of as much per unit
// of impulse. Locks that say the same thing twice share the load, and a chain drawn straight between
// two walls meets a weight with forces that have bounds (docs/decisions/0012).
constexpr double kGive = 5e-3;

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
// What an impulse (linear, angular) changes of a body's velocity.
void answer_of(const JointBody& body, const double* impulse, double* out) {
  const V3d linear = scaled(body.inv_mass, {impulse[0], impulse[1], impulse[2]});
  const V3d angular = body.inv_inertia * V3d{impulse[3], impulse[4], impulse[5]};
  const double v[6] = {linear.x, linear.y, linear.z, angular.x, angular.y, angular.z};
  std::copy_n(v, 6, out);
}

// L D L^T of a positive semidefinite matrix in place, its lower triangle row by row; the diagonal
// becomes 1 / D. As factorise() of blocks.
void factorise_packed(double* m, const double* scale, std::uint32_t n, double lost) {
  double* row = m;
  for (std::uint32_t i = 0; i < n; row += ++i) {
    double pivot = row[i];
    const double* other = m;
    for (std::uint32_t j = 0; j < i; other += ++j) {
      for (std::uint32_t k = 0; k < j; ++k) row[j] -= row[k] * other[k];
    }
    other = m;
    for (std::uint32_t j = 0; j < i; other += ++j) {
      const double part = row[j];
      row[j] *= other[j];
      pivot -= part * row[j];
    }
    row[i] = pivot > lost * scale[i] ? 1 / pivot : 0.0;
  }
}
void solve_packed(const double* m, std::uint32_t n, double* x) {
  const double* row = m;
  for (std::uint32_t i = 0; i < n; row += ++i) {
    for (std::uint32_t j = 0; j < i; ++j) x[i] -= row[j] * x[j];
  }
  for (std::uint32_t i = n; i-- > 0;) {
    row -= i + 1;
    x[i] *= row[i];
    for (std::uint32_t j = i + 1; j < n; ++j) x[i] -= m[j * (j + 1) / 2 + i] * x[j];
  }
}

// A lock's inverse mass between the bare bodies.
double bare(const JointRow& row, const JointBody& a, const JointBody& b) {
  return dot(row.linear, scaled(a.inv_mass + b.inv_mass, row.linear)) +
         (dot(row.angular_a, a.inv_inertia * row.angular_a) +
          dot(row.angular_b, b.inv_inertia * row.angular_b));
}

// The rate of a lock between two velocities.
double rate_of(const JointRow& lock, const double* a, const double* b) {
  double side_a[6], side_b[6];
  side_of(lock, true, side_a);
  side_of(lock, false, side_b);
  return dot6(side_a, a) + dot6(side_b, b);
}
double rate_of(const JointRow& lock, const JointBody& a, const JointBody& b) {
  double va[6], vb[6];
  copy_velocity(a, va);
  copy_velocity(b, vb);
  return rate_of(lock, va, vb);
}

// Calls visit(constraint, lock's number in it, lock, number of the row) for all closing locks.
template <class Constraint, class Visit>
void for_closing(const JointArrays& arrays, std::span<Constraint> constraints,
                 const JointTree& tree, Visit visit) {
  std::uint32_t row = 0;
  for (std::uint32_t k = tree.closing; k < tree.closed; ++k) {
    for (std::uint32_t i = 0; i < constraints[k].lock_count; ++i) {
      visit(constraints[k], i, arrays.locks[constraints[k].first_lock + i], row++);
    }
  }
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
  closing_.clear();
}

std::uint32_t JointTrees::slot_of(std::uint32_t row) {
  if (slot_[row] == kNone) {
    slot_[row] = static_cast<std::uint32_t>(rows_.size());
    rows_.push_back(row);
  }
  return slot_[row];
}

JointTree JointTrees::add(std::span<JointRef> joints, std::uint32_t first) {
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
  in_tree_.assign(joints.size(), 0);
  // Leaves first; into each body what holds it to the unmovable, then it into its parent.
  sorted_.clear();
  for (auto slot = order_.rbegin(); slot != order_.rend(); ++slot) {
    const std::uint32_t row = rows_[*slot];
    for (std::uint32_t i = first_at_[*slot]; i < first_at_[*slot + 1]; ++i) {
      const JointRef& joint = joints[at_[i]];
      const std::uint32_t other = joint.row_a == row ? joint.row_b : joint.row_a;
      if (can_move(other)) continue;
      in_tree_[at_[i]] = 1;
      eliminate(joint, row, first);
    }
    if (reached_by_[*slot] == kNone) continue;
    const JointRef& joint = joints[reached_by_[*slot]];
    in_tree_[reached_by_[*slot]] = 1;
    eliminate(joint, joint.row_a == row ? joint.row_b : joint.row_a, first);
  }
  JointTree tree;
  tree.first = first;
  tree.end = first + static_cast<std::uint32_t>(joints.size());
  tree.closing = first + static_cast<std::uint32_t>(sorted_.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    if (in_tree_[j] || joints[j].lock_count == 0) continue;
    sorted_.push_back(joints[j]);
    tree.closing_rows += joints[j].lock_count;
  }
  tree.closed = first + static_cast<std::uint32_t>(sorted_.size());
  for (const JointRef& joint : joints) {
    if (joint.lock_count == 0) sorted_.push_back(joint);
  }
  tree.closing_factor = closing_.size();
  closing_.resize(closing_.size() + std::size_t{tree.closing_rows} * (tree.closing_rows + 1) / 2);
  std::copy(sorted_.begin(), sorted_.end(), joints.begin());
  for (const std::uint32_t row : rows_) slot_[row] = kNone;
  return tree;
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
                           const JointTree& tree) {
  for (std::uint32_t k = tree.first; k < tree.end; ++k) {
    if (can_move(constraints[k].row_a)) load_mobility(arrays.bodies, constraints[k].row_a);
    if (can_move(constraints[k].row_b)) load_mobility(arrays.bodies, constraints[k].row_b);
  }
  for (std::uint32_t k = tree.first; k < tree.closing; ++k) {
    const JointConstraint& c = constraints[k];
    const int n = c.lock_count;
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
  if (tree.closing_rows > 0) factorise_closing(arrays, constraints, tree);
}

void JointTrees::load_velocities(const JointArrays& arrays,
                                 std::span<const JointConstraint> constraints,
                                 const JointTree& tree) {
  for (std::uint32_t k = tree.first; k < tree.end; ++k) {
    for (const std::uint32_t row : {constraints[k].row_a, constraints[k].row_b}) {
      if (!can_move(row)) continue;
      copy_velocity(arrays.bodies.load(row), nodes_[row].velocity);
      std::fill_n(nodes_[row].impulse, 6, 0.0);
    }
  }
}

void JointTrees::start_at_rest(std::span<const JointConstraint> constraints,
                               const JointTree& tree) {
  for (std::uint32_t k = tree.first; k < tree.end; ++k) {
    for (const std::uint32_t row : {constraints[k].row_a, constraints[k].row_b}) {
      if (!can_move(row)) continue;
      std::fill_n(nodes_[row].velocity, 6, 0.0);
      std::fill_n(nodes_[row].impulse, 6, 0.0);
    }
  }
}

void JointTrees::solve(const JointPass& pass, const JointArrays& arrays,
                       std::span<JointConstraint> constraints, const JointTree& tree) {
  const auto goal = [&pass](const JointConstraint& c, std::uint32_t i) {
    return pass.use_bias ? -(pass.inv_h * c.error[i] + c.drift[i]) : 0.0;
  };
  load_velocities(arrays, constraints, tree);
  run(arrays, constraints, tree, false, goal);
  if (tree.closing_rows == 0) return;
  double lacking[kMostClosingRows];
  for_closing(
      arrays, constraints, tree,
      [&](const JointConstraint& c, std::uint32_t i, const JointRow& lock, std::uint32_t row) {
        lacking[row] =
            goal(c, i) - rate_of(lock, arrays.bodies.at(c.row_a), arrays.bodies.at(c.row_b));
      });
  close(arrays, constraints, tree, lacking);
}

void JointTrees::correct(const JointPass& pass, const JointArrays& arrays,
                         std::span<JointConstraint> constraints, const JointTree& tree) {
  const auto goal = [&pass](const JointConstraint& c, std::uint32_t i) {
    return -(pass.inv_h * c.error[i]);
  };
  double lacking[kMostClosingRows];
  const auto rates = [&](double sign) {
    for_closing(
        arrays, constraints, tree,
        [&](const JointConstraint& c, std::uint32_t, const JointRow& lock, std::uint32_t row) {
          lacking[row] +=
              sign * rate_of(lock, arrays.bodies.at(c.row_a), arrays.bodies.at(c.row_b));
        });
  };
  for_closing(arrays, constraints, tree,
              [&](const JointConstraint& c, std::uint32_t i, const JointRow&, std::uint32_t row) {
                lacking[row] = goal(c, i);
              });
  rates(1);
  start_at_rest(constraints, tree);
  run(arrays, constraints, tree, true, goal);
  if (tree.closing_rows == 0) return;
  rates(-1);
  close(arrays, constraints, tree, lacking);
}

template <class Goal>
void JointTrees::eliminate_up(const JointArrays& arrays,
                              std::span<const JointConstraint> constraints, const JointTree& tree,
                              bool still, Goal goal) {
  for (std::uint32_t k = tree.first; k < tree.closing; ++k) {
    const JointConstraint& c = constraints[k];
    const std::uint32_t n = c.lock_count;
    const Link& link = links_[k];
    Elimination& e = eliminations_[k];
    Node& parent = nodes_[link.parent];
    double there[6] = {};
    if (!can_move(link.child) && !still) copy_velocity(arrays.bodies.at(link.child), there);
    const double* child = can_move(link.child) ? nodes_[link.child].velocity : there;
    double y[kMaxLocks];
    for (std::uint32_t i = 0; i < n; ++i) {
      const JointRow& lock = arrays.locks[c.first_lock + i];
      double p[6], q[6];
      side_of(lock, link.parent_is_a, p);
      side_of(lock, !link.parent_is_a, q);
      e.rest[i] = goal(c, i) - (dot6(p, parent.velocity) + dot6(q, child));
      y[i] = e.rest[i];
    }
    solve_factored(e.factor, static_cast<int>(n), y);
    for (std::uint32_t i = 0; i < n; ++i)
      for (int r = 0; r < 6; ++r) parent.velocity[r] += e.answer[i][r] * y[i];
  }
}

void JointTrees::substitute_down(const JointArrays& arrays,
                                 std::span<const JointConstraint> constraints,
                                 const JointTree& tree) {
  for (std::uint32_t k = tree.closing; k-- > tree.first;) {
    const JointConstraint& c = constraints[k];
    const std::uint32_t n = c.lock_count;
    const Link& link = links_[k];
    Elimination& e = eliminations_[k];
    Node& parent = nodes_[link.parent];
    double nowhere[6] = {};
    double* child = can_move(link.child) ? nodes_[link.child].impulse : nowhere;
    for (std::uint32_t i = 0; i < n; ++i) e.rest[i] -= dot6(e.answer[i], parent.impulse);
    solve_factored(e.factor, static_cast<int>(n), e.rest);
    for (std::uint32_t i = 0; i < n; ++i) {
      const JointRow& lock = arrays.locks[c.first_lock + i];
      double p[6], q[6];
      side_of(lock, link.parent_is_a, p);
      side_of(lock, !link.parent_is_a, q);
      for (int r = 0; r < 6; ++r) {
        parent.impulse[r] += p[r] * e.rest[i];
        child[r] += q[r] * e.rest[i];
      }
    }
  }
}

template <class Goal>
void JointTrees::run(const JointArrays& arrays, std::span<JointConstraint> constraints,
                     const JointTree& tree, bool still, Goal goal) {
  eliminate_up(arrays, constraints, tree, still, goal);
  substitute_down(arrays, constraints, tree);
  for (std::uint32_t k = tree.first; k < tree.closing; ++k) {
    JointConstraint& c = constraints[k];
    for (std::uint32_t i = 0; i < c.lock_count; ++i)
      book(c, arrays.locks[c.first_lock + i], eliminations_[k].rest[i]);
  }
  for (std::uint32_t k = tree.first; k < tree.end; ++k) {
    for (const std::uint32_t row : {constraints[k].row_a, constraints[k].row_b}) {
      if (!can_move(row)) continue;
      const JointBody& body = arrays.bodies.at(row);
      double* p = nodes_[row].impulse;
      arrays.bodies.store(row, body.linear + scaled(body.inv_mass, V3d{p[0], p[1], p[2]}),
                          body.angular + body.inv_inertia * V3d{p[3], p[4], p[5]});
      std::fill_n(p, 6, 0.0);
    }
  }
}

// -- Loops ------------------------------------------------------------------------------------------

void JointTrees::factorise_closing(const JointArrays& arrays,
                                   std::span<const JointConstraint> constraints,
                                   const JointTree& tree) {
  double* matrix = closing_.data() + tree.closing_factor;
  double scale[kMostClosingRows];
  for_closing(
      arrays, constraints, tree,
      [&](const JointConstraint& c, std::uint32_t, const JointRow& lock, std::uint32_t column) {
        start_at_rest(constraints, tree);
        double from_a[6], from_b[6], side[6];
        side_of(lock, true, side);
        answer_of(arrays.bodies.at(c.row_a), side, from_a);
        side_of(lock, false, side);
        answer_of(arrays.bodies.at(c.row_b), side, from_b);
        std::copy_n(from_a, 6, nodes_[c.row_a].velocity);
        std::copy_n(from_b, 6, nodes_[c.row_b].velocity);
        eliminate_up(arrays, constraints, tree, true,
                     [](const JointConstraint&, std::uint32_t) { return 0.0; });
        substitute_down(arrays, constraints, tree);
        const auto velocity = [&](std::uint32_t row, double* out) {
          answer_of(arrays.bodies.at(row), nodes_[row].impulse, out);
          for (int r = 0; r < 6; ++r)
            out[r] += row == c.row_a ? from_a[r] : row == c.row_b ? from_b[r] : 0.0;
        };
        for_closing(arrays, constraints, tree,
                    [&](const JointConstraint& other, std::uint32_t, const JointRow& other_lock,
                        std::uint32_t row) {
                      if (row < column) return;
                      double va[6], vb[6];
                      velocity(other.row_a, va);
                      velocity(other.row_b, vb);
                      matrix[std::size_t{row} * (row + 1) / 2 + column] =
                          rate_of(other_lock, va, vb);
                    });
        scale[column] = bare(lock, arrays.bodies.at(c.row_a), arrays.bodies.at(c.row_b));
        matrix[std::size_t{column} * (column + 1) / 2 + column] += kGive * scale[column];
      });
  factorise_packed(matrix, scale, tree.closing_rows, 0.5 * kGive);
}

// The impulses of the closing locks, and how the tree answers them.
void JointTrees::close(const JointArrays& arrays, std::span<JointConstraint> constraints,
                       const JointTree& tree, double* lacking) {
  solve_packed(closing_.data() + tree.closing_factor, tree.closing_rows, lacking);
  start_at_rest(constraints, tree);
  for_closing(arrays, constraints, tree,
              [&](JointConstraint& c, std::uint32_t, const JointRow& lock, std::uint32_t row) {
                book(c, lock, lacking[row]);
                for (const bool is_a : {true, false}) {
                  const std::uint32_t at = is_a ? c.row_a : c.row_b;
                  const JointBody& body = arrays.bodies.at(at);
                  double push[6], change[6];
                  side_of(lock, is_a, push);
                  for (double& component : push) component *= lacking[row];
                  answer_of(body, push, change);
                  for (int r = 0; r < 6; ++r) nodes_[at].velocity[r] += change[r];
                  arrays.bodies.store(at, body.linear + V3d{change[0], change[1], change[2]},
                                      body.angular + V3d{change[3], change[4], change[5]});
                }
              });
  run(arrays, constraints, tree, true, [](const JointConstraint&, std::uint32_t) { return 0.0; });
}

}  // namespace skerry::solver
