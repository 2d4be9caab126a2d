#include <skerry/skerry.h>

#include "bench/peers/engine.h"
#include "cmake/build_info/build_info.h"
#include "scenes/scene.h"

namespace skerry::peers {
namespace {

class Skerry : public Engine {
 public:
  explicit Skerry(int workers) : workers_(workers) {}

  void build(const PeerScene& scene) override {
    WorldSettings settings = scenes::world_settings(scene.source);
    settings.sleep.enabled = false;
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
  double dt_ = 0;
  std::optional<World> world_;
  std::vector<BodyId> bodies_;
};

}  // namespace

std::unique_ptr<Engine> make_skerry(int workers) { return std::make_unique<Skerry>(workers); }

EngineInfo skerry_info() {
  return {.name = "skerry",
          .version = build_info::kVersion,
          .settings =
              "defaults: double precision, 4 substeps; sleeping off; serial for one worker, "
              "the job system for more"};
}

}  // namespace skerry::peers
