#include "apps/measure/session.h"

namespace skerry::measure {
namespace {

World world_of(const WorldSettings& settings, schedulers::OtherScheduler scheduler) {
  const schedulers::Scope scope(scheduler);
  return World(settings);
}

}  // namespace

bool is_dedicated(ThreadingMode mode) {
  return mode == ThreadingMode::dedicated_thread || mode == ThreadingMode::dedicated_thread_jobs;
}

Session::Session(const scenes::SceneDesc& scene, const WorldSettings& settings, double dt)
    : scene_(scene), world_(settings), built_(scenes::build(scene, world_)), dt_(dt) {}

Session::Session(const scenes::SceneDesc& scene, const WorldSettings& base, double dt,
                 const Strategy& strategy)
    : scene_(scene),
      world_(world_of(strategy.settings(base), strategy.scheduler)),
      built_(scenes::build(scene, world_)),
      dt_(dt) {}

void Session::apply_events() {
  if (scene_.events.empty()) return;
  scenes::apply_events(scene_, built_, world_, world_.step_count() + 1);
}

StepReport Session::advance() {
  apply_events();
  return is_dedicated(world_.settings().mode) ? world_.run_steps(1, dt_) : world_.step(dt_);
}

void Session::advance_to(std::uint64_t step) {
  while (world_.step_count() < step) advance();
}

PendingStep Session::begin() {
  apply_events();
  return world_.begin_step(dt_);
}

Watcher Watcher::part(double begin, double end) const {
  Watcher result = *this;
  if (!progress) return result;
  result.progress = [begin, end, whole = progress](double share, const std::string& what) {
    whole(begin + (end - begin) * share, what);
  };
  return result;
}

}  // namespace skerry::measure
