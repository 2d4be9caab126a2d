// What a kernel gets: views of the world's data and this step's settings. Plain data; dies with the
// step.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <string>
#include <vector>

#include <skerry/forces.h>
#include <skerry/jobs/task_graph.h>
#include <skerry/settings.h>

#include "core/bodies.h"
#include "core/colliders.h"
#include "core/contact_effects.h"
#include "core/contacts.h"
#include "core/fast_bodies.h"
#include "core/islands.h"
#include "core/joints_data.h"

namespace skerry::collision {
class Broadphase;
class ContinuousScratch;
class NarrowphaseScratch;
}  // namespace skerry::collision
namespace skerry::solver {
class SolverScratch;
}

namespace skerry::core {

using jobs::IndexRange;
using jobs::Task;

struct ForceFields {
  std::vector<ForceField> rows;  // empty functions are holes
  std::vector<std::uint32_t> generation;
};

// What user callbacks threw in this step: the one of the lowest body is kept.
class CallbackErrors {
 public:
  void keep(BodyIndex body, std::exception_ptr error);  // any worker
  // Rethrows and forgets what was kept, if anything.
  void rethrow();

 private:
  std::atomic_flag busy_ = ATOMIC_FLAG_INIT;  // held for a few instructions, when something threw
  BodyIndex body_ = kNone;
  std::exception_ptr error_;
};

struct StepContext {
  double dt = 0;    // s
  double time = 0;  // s, at the start of the step
  std::uint32_t worker_count = 1;
  const WorldSettings* settings = nullptr;

  Bodies* bodies = nullptr;
  Colliders* colliders = nullptr;
  ContactTable* contacts = nullptr;
  Joints* joints = nullptr;
  ForceFields* fields = nullptr;
  Islands* islands = nullptr;
  Sleepers* sleepers = nullptr;
  FastBodies* fast = nullptr;
  ContactEffects* effects = nullptr;  // null unless asked for
  CallbackErrors* callback_errors = nullptr;

  collision::Broadphase* broadphase = nullptr;
  collision::NarrowphaseScratch* narrowphase = nullptr;  // [worker] inside
  collision::ContinuousScratch* continuous = nullptr;    // [worker] inside
  solver::SolverScratch* solver = nullptr;               // [worker] inside

  std::vector<std::string>* warnings = nullptr;  // stages that run once only
};

}  // namespace skerry::core
