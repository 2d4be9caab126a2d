// Bodies that tests need again and again.
#pragma once

#include <vector>

#include <skerry/world.h>

namespace skerry::test {

// A fixed box whose top face is at y = 0.
BodyId add_floor(World& world, double friction = 0.6, double restitution = 0, double half = 50);
// A fixed half-space turned by `angle` rad about +z, through the origin; +y is out.
BodyId add_incline(World& world, double angle, double friction);
BodyId add_box(World& world, const Vec3& position, const Vec3& half_extents = {0.5, 0.5, 0.5},
               double friction = 0.6, double density = 1000);
BodyId add_sphere(World& world, const Vec3& position, double radius = 0.5, double friction = 0.6,
                  double restitution = 0, double density = 1000);

// 512 bodies of several shapes that fall onto a heap beside chains, a sensor and a moving platform:
// the scene of the determinism rows. `advance` makes one step with what happens at step n: a
// removal at 60, an impulse at 100, a spawn at 150.
class BusyScene {
 public:
  explicit BusyScene(World& world);
  void advance(World& world, int n);

 private:
  std::vector<BodyId> bodies_;
};

}  // namespace skerry::test
