// Bodies made by hand, and broadphases that find their pairs.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "collision/broadphase.h"
#include "core/bodies.h"
#include "core/colliders.h"
#include "core/contacts.h"
#include "core/joints_data.h"
#include "core/step_context.h"

namespace skerry::collision {

using core::BodyIndex;
using core::Collider;

// A task that may be of any worker, and runs all its phases itself.
class StubTask final : public Task {
 public:
  explicit StubTask(std::uint32_t worker = 0) : worker_(worker) {}
  std::uint32_t worker() const override { return worker_; }
  void run_phases(jobs::PhaseProgram& program) override {
    for (std::uint32_t phase = 0; phase < program.phase_count(); ++phase)
      for (std::uint32_t block = 0; block < program.block_count(phase); ++block)
        program.run_block(phase, block, worker_);
  }

 private:
  std::uint32_t worker_;
};

inline constexpr double kDt = 1.0 / 60;  // s

// Bodies, one or more colliders each, and one broadphase of each of the given kinds with its own
// pair table.
class BroadphaseScene {
 public:
  struct Side {
    std::unique_ptr<Broadphase> broadphase;
    core::ContactTable contacts;
    std::uint32_t workers;
  };

  explicit BroadphaseScene(
      std::vector<std::pair<BroadphaseKind, std::uint32_t>> kinds_and_workers) {
    for (const auto& [kind, workers] : kinds_and_workers)
      sides.push_back({make_broadphase(kind), {}, workers});
  }
  BodyIndex add_body(std::uint32_t type, const Vec3& position);
  ColliderIndex add_collider(BodyIndex body, Collider collider);
  void remove_body(BodyIndex body);
  void touch_body(BodyIndex body);

  StepContext context(Side& side);
  // The stages of the pair search; `moved` of the last side.
  void step();

  bool may_pair(const Collider& a, const Collider& b) const;
  std::vector<std::uint64_t> brute_force(const Side& side) const;
  // The table holds the pairs of brute force, each with manifolds of its own, and lists the awake ones.
  void expect_sound(const Side& side) const;
  // Fat boxes hold what the contract says: tight box, speculative distance, a step's motion.
  void expect_covered(const Side& side) const;

  core::Bodies bodies;
  core::Colliders colliders;
  core::Joints joints;
  std::vector<Side> sides;
  std::uint32_t moved = 0;
};

// m, half extents.
Collider box_collider(float x, float y, float z);

}  // namespace skerry::collision
