// A few bodies and pairs, collided by the narrowphase stage itself.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>

#include <skerry/shapes.h>

#include "collision/narrowphase.h"
#include "core/step_context.h"

namespace skerry::test {

class SerialTask : public jobs::Task {
 public:
  std::uint32_t worker() const override { return 0; }
  void run_phases(jobs::PhaseProgram& program) override;
};

// Bodies of one shape each, and pairs among them. Poses are of the shape frame.
class PairScene {
 public:
  PairScene();

  core::ColliderIndex add(const ShapeGeometry& geometry, const Pose& pose, bool dynamic = true);
  // Pair row; a < b.
  std::uint32_t pair(core::ColliderIndex a, core::ColliderIndex b, bool sensor = false);

  void set_pose(core::ColliderIndex body, const Pose& pose);
  void set_motion(core::ColliderIndex body, const Vec3& linear, const Vec3& angular = Vec3::Zero());
  void collide();

  // Of a step over the pairs of a table. There is no broadphase: every pair is looked at.
  core::StepContext context(core::ContactTable& table);
  void collide(const core::StepContext& step);

  core::ContactPair& contact(std::uint32_t pair = 0) { return contacts.pairs[pair]; }
  core::Manifold& manifold(std::uint32_t pair = 0, std::uint32_t index = 0) {
    return contacts.manifolds[contacts.pairs[pair].first_manifold + index];
  }
  // World position of a point.
  Vec3 world(std::uint32_t pair, const core::ManifoldPoint& point) const;
  float deepest(std::uint32_t pair = 0);

  double dt = 0;  // s; 0: poses alone decide
  core::Bodies bodies;
  core::Colliders colliders;
  core::ContactTable contacts;
  WorldSettings settings;

 private:
  collision::NarrowphaseScratchPtr scratch_;
};

// Random numbers that are the same everywhere. Draw in statements of their own or inside braces:
// compilers evaluate the arguments of a call, and the operands of most operators, in any order.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high);
  Vec3 in_box(double half);
  Vec3 unit();
  Quat rotation();
  Pose pose(double half);
  Quat small_turn(double most);  // radians, about any axis
  // One of the rotations that the relation between resting bodies often is: none, about y by any
  // angle, tilted by a little, any.
  Quat resting_rotation();

 private:
  std::mt19937_64 engine_;
};

Pose at(const Vec3& position, const Quat& orientation = Quat::Identity());
Quat turned(double angle, const Vec3& axis);
// `pose` moved by `motion`.
Pose moved(const Pose& motion, const Pose& pose);

}  // namespace skerry::test
