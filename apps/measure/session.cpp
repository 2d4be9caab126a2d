#include "apps/measure/session.h"

namespace skerry::measure {

bool is_dedicated(ThreadingMode mode) {
  return mode == ThreadingMode::dedicated_thread || mode == ThreadingMode::dedicated_thread_jobs;
}

int effective_workers(ThreadingMode mode, int workers) {
  if (mode == ThreadingMode::serial || mode == ThreadingMode::dedicated_thread) return 1;
  return workers > 0 ? workers : jobs::automatic_worker_count();
}

Session::Session(const scenes::SceneDesc& scene, const WorldSettings& settings, double dt)
    : scene_(scene), world_(settings), built_(scenes::build(scene, world_)), dt_(dt) {}

void Session::apply_events() {
  if (scene_.events.empty()) return;
  scenes::apply_events(scene_, built_, world_, world_.step_count() + 1);
}

StepReport Session::advance() {
  apply_events();
  return is_dedicated(world_.settings().mode) ? world_.run_steps(1, dt_) : world_.step(dt_);
}

PendingStep Session::begin() {
  apply_events();
  return world_.begin_step(dt_);
}

}  // namespace skerry::measure
