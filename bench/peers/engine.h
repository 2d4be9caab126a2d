// What each engine must be able to do to take part.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bench/peers/peer_scene.h"

namespace skerry::peers {

struct BodyState {
  Pose pose;  // of the body frame, which is also the frame of its shape
  Vec3 linear_velocity = Vec3::Zero();
  Vec3 angular_velocity = Vec3::Zero();  // world frame
};

class Engine {
 public:
  virtual ~Engine() = default;
  virtual void build(const PeerScene& scene) = 0;  // once; not timed
  virtual void step() = 0;                         // one step of the scene's dt
  virtual std::vector<BodyState> states() = 0;     // of all bodies, in the scene's order
};

enum class OdeSpace : std::uint8_t { hash, sweep_and_prune };

struct EngineInfo {
  std::string name;  // as --engines says it
  std::string version;
  std::string settings;  // what a reader needs to repeat the run
};

// Serial for one worker, the job system for more.
std::unique_ptr<Engine> make_skerry(int workers, SolverKind solver);
// Rows of the engine's other solvers are named skerry_pgs and skerry_penalty.
EngineInfo skerry_info(SolverKind solver);
#if SKERRY_HAVE_BULLET
std::unique_ptr<Engine> make_bullet();
EngineInfo bullet_info();
#endif
#if SKERRY_HAVE_ODE
std::unique_ptr<Engine> make_ode(OdeSpace space);
EngineInfo ode_info(OdeSpace space);
#endif

}  // namespace skerry::peers
