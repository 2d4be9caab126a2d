// Bodies and exact contacts without collision detection: boxes standing on boxes or a floor, spheres
// on spheres or a floor. For benchmarks and tests of the solver alone.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "core/mass_properties.h"
#include "core/step_context.h"
#include "solver/islands.h"
#include "solver/solve_islands.h"
#include "solver/solver_scratch.h"

namespace skerry::bench {

// Runs everything on the caller.
class SerialTask final : public jobs::Task {
 public:
  std::uint32_t worker() const override { return 0; }
  void run_phases(jobs::PhaseProgram& program) override {
    for (std::uint32_t p = 0; p < program.phase_count(); ++p) {
      for (std::uint32_t b = 0; b < program.block_count(p); ++b) program.run_block(p, b, 0);
    }
  }
};

struct ContactMaterial {
  double friction = 0.6, restitution = 0, rolling = 0;
};

struct ContactWorld {
  using Material = ContactMaterial;
  enum class Shape { box, sphere, floor };

  WorldSettings settings;
  core::Bodies bodies;
  core::Colliders colliders;
  core::ContactTable contacts;
  core::Joints joints;
  core::ForceFields fields;
  core::Islands islands;
  core::Sleepers sleepers;
  core::CallbackErrors errors;
  std::vector<std::string> warnings;
  solver::SolverScratchPtr scratch = solver::make_solver_scratch(1);
  std::vector<Shape> shape;  // [body]
  std::vector<Vec3> size;    // [body] half extents, or radius in x
  double dt = 1.0 / 60;
  double time = 0;
  double speculative = 0.02;  // m

  core::BodyIndex add(Shape kind, const Vec3& extent, double density, const Vec3& center,
                      const Vec3& linear = Vec3::Zero(), const Vec3& angular = Vec3::Zero(),
                      const Material& material = {}) {
    const core::BodyIndex row = core::take_row(bodies);
    const bool dynamic = density > 0;
    if (dynamic) {
      const core::MassProperties solid = kind == Shape::sphere
                                             ? core::solid_sphere(extent.x(), density)
                                             : core::solid_box(extent, density);
      bodies.flags[row] |= core::kDynamic | core::kAwake;
      core::BodyMass& mass = bodies.mass[row];
      mass.mass = solid.mass;
      mass.inv_mass = 1 / solid.mass;
      mass.inertia_b = solid.inertia;
      mass.inv_inertia_b = solid.inertia.inverse();
      mass.radius = extent.norm();
      if (solid.inertia.isApprox(Mat3::Identity() * solid.inertia(0, 0), 1e-12)) {
        bodies.flags[row] |= core::kIsotropic;
      }
    }
    bodies.pose[row] = {center, Quat::Identity()};
    core::set_motion(bodies, row, linear, angular);
    bodies.awake_stale = true;
    core::refresh_awake(bodies);
    shape.push_back(kind);
    size.push_back(extent);
    core::Collider collider;
    collider.alive = true;
    collider.body = row;
    collider.friction = static_cast<float>(material.friction);
    collider.restitution = static_cast<float>(material.restitution);
    collider.rolling_resistance = static_cast<float>(material.rolling);
    colliders.rows.push_back(collider);  // collider row = body row
    return row;
  }
  // The floor y = 0; its body sits at the origin.
  core::BodyIndex add_floor(const Material& material = {}) {
    return add(Shape::floor, Vec3::Zero(), 0, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), material);
  }
  void make_kinematic(core::BodyIndex body, const Vec3& linear) {
    bodies.flags[body] |= core::kKinematic | core::kAwake;
    core::set_motion(bodies, body, linear, Vec3::Zero());
    bodies.awake_stale = true;
  }

  // Contact to keep an eye on, until `seal`: b stands on a (or both are spheres).
  void link(core::BodyIndex a, core::BodyIndex b) {
    core::ContactPair pair;
    pair.a = std::min(a, b);
    pair.b = std::max(a, b);
    pair.body_a = pair.a;
    pair.body_b = pair.b;
    contacts.pairs.push_back(pair);
    links_.push_back({a, b});
  }
  void seal() {
    std::vector<std::size_t> order(links_.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [this](std::size_t x, std::size_t y) {
      return contacts.pairs[x].key() < contacts.pairs[y].key();
    });
    std::vector<core::ContactPair> pairs;
    std::vector<std::array<core::BodyIndex, 2>> links;
    contacts.active.clear();
    contacts.manifolds.assign(order.size(), {});
    for (std::size_t i : order) {
      contacts.active.push_back(static_cast<std::uint32_t>(pairs.size()));
      pairs.push_back(contacts.pairs[i]);
      core::ContactPair& pair = pairs.back();
      pair.first_manifold = static_cast<std::uint32_t>(pairs.size() - 1);
      core::set_materials(contacts, pair, colliders.rows[pair.a], colliders.rows[pair.b]);
      links.push_back(links_[i]);
    }
    contacts.pairs = pairs;
    links_ = links;
  }

  core::StepContext context() {
    core::StepContext step;
    step.dt = dt;
    step.time = time;
    step.settings = &settings;
    step.bodies = &bodies;
    step.colliders = &colliders;
    step.contacts = &contacts;
    step.joints = &joints;
    step.fields = &fields;
    step.islands = &islands;
    step.sleepers = &sleepers;
    step.callback_errors = &errors;
    step.solver = scratch.get();
    step.warnings = &warnings;
    return step;
  }

  void collide() {
    for (std::size_t i = 0; i < links_.size(); ++i) collide_pair(i);
  }
  void solve() {
    SerialTask task;
    const core::StepContext step = context();
    solver::build_islands(step, {0, 1}, task);
    solver::solve_islands(step, {0, static_cast<std::uint32_t>(islands.groups.size())}, task);
  }
  void step(int count = 1) {
    for (int i = 0; i < count; ++i) {
      collide();
      solve();
      time += dt;
    }
  }

  core::Manifold& manifold(std::size_t link) { return contacts.manifolds[link]; }
  double y(core::BodyIndex body) const { return bodies.pose[body].center.y(); }

 private:
  using Polygon = std::vector<Vec3>;

  void collide_pair(std::size_t i) {
    core::ContactPair& pair = contacts.pairs[i];
    core::Manifold& manifold = contacts.manifolds[pair.first_manifold];
    const auto [below, above] = links_[i];
    found_.clear();
    Vec3 normal(0, 1, 0);  // from below to above
    if (shape[above] == Shape::sphere) {
      meet_sphere(below, above, normal);
    } else if (shape[below] == Shape::floor) {
      for (const Vec3& v : bottom_face(above)) keep(v, Vec3(v.x(), 0, v.z()), v.y());
    } else {
      meet_boxes(below, above, normal);
    }
    const bool flip = pair.body_a != below;
    const Vec3 n = flip ? Vec3(-normal) : normal;
    const Vec3 center = bodies.pose[pair.body_a].center;
    const core::Manifold old = manifold;
    if (found_.empty()) manifold.friction_impulse = manifold.rolling_impulse = {0, 0, 0};
    manifold.normal = core::to_float(n);
    manifold.point_count = static_cast<std::uint32_t>(found_.size());
    for (std::size_t k = 0; k < found_.size(); ++k) {
      core::ManifoldPoint& point = manifold.points[k];
      point.position = core::to_float(Vec3(found_[k].first - center));
      point.separation = static_cast<float>(found_[k].second);
      manifold.normal_impulse[k] = old_impulse(old, point.position);
    }
    const bool touching = !found_.empty();
    pair.manifold_count = touching;
    pair.flags = touching ? core::kTouching : 0u;
  }

  // That of the nearest point of the last step.
  static float old_impulse(const core::Manifold& old, const core::V3f& position) {
    float nearest = 0.04f, impulse = 0;
    for (std::uint32_t i = 0; i < old.point_count; ++i) {
      const core::V3f d = old.points[i].position - position;
      if (dot(d, d) >= nearest) continue;
      nearest = dot(d, d);
      impulse = old.normal_impulse[i];
    }
    return impulse;
  }

  void keep(const Vec3& p, const Vec3& q, double separation) {
    if (separation < reach_) found_.push_back({(p + q) / 2, separation});
  }

  void meet_sphere(core::BodyIndex below, core::BodyIndex above, Vec3& normal) {
    const Vec3 c = bodies.pose[above].center;
    reach(below, above);
    if (shape[below] == Shape::floor) {
      const double r = size[above].x();
      keep(c - r * normal, Vec3(c.x(), 0, c.z()), c.y() - r);
      return;
    }
    const Vec3 d = c - bodies.pose[below].center;
    normal = d.normalized();
    const double gap = d.norm() - size[below].x() - size[above].x();
    keep(c - normal * size[above].x(), c - normal * (size[above].x() + gap), gap);
  }

  void reach(core::BodyIndex a, core::BodyIndex b) {
    const double closing = (bodies.motion[a].linear - bodies.motion[b].linear).norm() + 9.81 * dt;
    reach_ = closing * dt;
    if (shape[b] == Shape::sphere) {  // no contact with what moves away
      const Vec3 d = shape[a] == Shape::floor ? Vec3(0, 1, 0)
                                              : Vec3(bodies.pose[b].center - bodies.pose[a].center);
      const double apart = d.normalized().dot(bodies.motion[b].linear - bodies.motion[a].linear);
      if (apart > 9.81 * dt) reach_ = 0;
      return;
    }
    reach_ = std::max(reach_, speculative);
  }

  Polygon bottom_face(core::BodyIndex body) {
    reach(body, body);
    const Mat3 r = bodies.pose[body].orientation.toRotationMatrix();
    // The face whose outward axis points down most.
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
      if (std::abs(r(1, k)) > std::abs(r(1, axis))) axis = k;
    }
    const double sign = r(1, axis) > 0 ? -1 : 1;
    const Vec3 h = size[body];
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const Vec3 center = bodies.pose[body].center + r.col(axis) * (sign * h[axis]);
    const Vec3 du = r.col(u) * h[u], dv = r.col(v) * h[v];
    return {center + du + dv, center + du - dv, center - du - dv, center - du + dv};
  }

  void meet_boxes(core::BodyIndex below, core::BodyIndex above, Vec3& normal) {
    Polygon face = bottom_face(above);
    reach(below, above);
    const Mat3 r = bodies.pose[below].orientation.toRotationMatrix();
    const Vec3 c = bodies.pose[below].center, h = size[below];
    normal = r.col(1);
    for (const int axis : {0, 2}) {
      for (const double side : {-1.0, 1.0}) clip(face, r.col(axis) * side, c, h[axis]);
    }
    for (const Vec3& v : corners(face, r)) {
      const double s = (v - c).dot(normal) - h.y();
      keep(v, v - normal * s, s);
    }
  }

  // The (at most four) points farthest along the diagonals of the lower face.
  static Polygon corners(const Polygon& face, const Mat3& r) {
    if (face.size() <= 4) return face;
    std::array<std::size_t, 4> picked;
    for (int k = 0; k < 4; ++k) {
      const Vec3 along = r.col(0) * (k < 2 ? 1 : -1) + r.col(2) * (k % 2 == 0 ? 1 : -1);
      std::size_t best = 0;
      for (std::size_t i = 1; i < face.size(); ++i) {
        if (face[i].dot(along) > face[best].dot(along)) best = i;
      }
      picked[k] = best;
    }
    std::sort(picked.begin(), picked.end());
    Polygon four;
    for (int k = 0; k < 4; ++k) {
      if (k == 0 || picked[k] != picked[k - 1]) four.push_back(face[picked[k]]);
    }
    return four;
  }

  static void clip(Polygon& face, const Vec3& outward, const Vec3& center, double limit) {
    Polygon kept;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Vec3 &p = face[i], &q = face[(i + 1) % face.size()];
      const double dp = (p - center).dot(outward) - limit, dq = (q - center).dot(outward) - limit;
      if (dp <= 0) kept.push_back(p);
      if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) kept.push_back(p + (q - p) * (dp / (dp - dq)));
    }
    face = kept;
  }

  std::vector<std::array<core::BodyIndex, 2>> links_;
  std::vector<std::pair<Vec3, double>> found_;
  double reach_ = 0;
};

// The pyramids of the scenes many_pyramids and large_pyramid (unit cubes, density 100): adds one
// with `base` cubes at the bottom and its bottom row starting at x.
inline void add_pyramid(ContactWorld& world, core::BodyIndex floor, int base, double x, double z) {
  std::vector<core::BodyIndex> below;
  for (int i = 0; i < base; ++i) {
    std::vector<core::BodyIndex> row;
    for (int j = i; j < base; ++j) {
      const Vec3 center(0.5 * (i + 1) + (j - i) + x, i + 0.5, z);
      row.push_back(world.add(ContactWorld::Shape::box, Vec3(0.5, 0.5, 0.5), 100, center));
      if (i == 0) {
        world.link(floor, row.back());
      } else {
        world.link(below[j - i], row.back());
        world.link(below[j - i + 1], row.back());
      }
    }
    below = row;
  }
}

inline void build_pyramids(ContactWorld& world, int columns, int rows, int base) {
  world.settings.gravity = {0, -10, 0};
  const core::BodyIndex floor = world.add_floor();
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) add_pyramid(world, floor, base, 11.0 * c, 11.7 * r);
  }
  world.seal();
}

inline void build_stacks(ContactWorld& world, int columns, int rows, int height,
                         double density = 1000) {
  world.settings.gravity = {0, -10, 0};
  const core::BodyIndex floor = world.add_floor();
  for (int i = 0; i < columns * rows; ++i) {
    core::BodyIndex below = floor;
    for (int k = 0; k < height; ++k) {
      const Vec3 center(3.0 * (i % columns), 0.5 + k, 3.0 * (i / columns));
      const core::BodyIndex box =
          world.add(ContactWorld::Shape::box, Vec3(0.5, 0.5, 0.5), density, center);
      world.link(below, box);
      below = box;
    }
  }
  world.seal();
}

}  // namespace skerry::bench
