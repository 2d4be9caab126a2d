#include <skerry/skerry.h>

#include "bench/peers/engine.h"
#include "cmake/build_info/build_info.h"
#include "scenes/scene.h"

namespace skerry::peers {
namespace {

class Skerry : public Engine {
 public:
  Skerry(int workers, SolverKind solver) : workers_(workers), solver_(solver) {}

  void build(const PeerScene& scene) override {
    WorldSettings settings = scenes::world_settings(scene.source);
    settings.sleep.enabled = false;
    settings.solver.kind = solver_;
    settings.mode = workers_ > 1 ? ThreadingMode::job_system : ThreadingMode::serial;
    settings.workers = workers_;
    dt_ = scene.source.defaults.dt;
    world_.emplace(settings);
    bodies_ = scenes::build(scene.source, *world_).bodies;
  }

  void step() override { world_->step(dt_); }

  std::vector<BodyState> states() override {
    std::vector<BodyState> states;
    for (const BodyId body : bodies_) {
      states.push_back(
          {world_->pose(body), world_->linear_velocity(body), world_->angular_velocity(body)});
    }
    return states;
  }

 private:
  int workers_;
  SolverKind solver_;
  double dt_ = 0;
  std::optional<World> world_;
  std::vector<BodyId> bodies_;
};

}  // namespace

std::unique_ptr<Engine> make_skerry(int workers, SolverKind solver) {
  return std::make_unique<Skerry>(workers, solver);
}

EngineInfo skerry_info(SolverKind solver) {
  const bool own = solver == SolverKind::soft_step_tgs;
  const std::string work = own                         ? "4 substeps"
                           : solver == SolverKind::pgs ? "pgs, 10 iterations"
                                                       : "penalty forces, 32 substeps";
  return {.name = own ? "skerry" : std::string("skerry_") + to_string(solver),
          .version = build_info::kVersion,
          .settings = "defaults: double precision, " + work +
                      "; sleeping off; serial for one worker, the job system for more"};
}

}  // namespace skerry::peers
