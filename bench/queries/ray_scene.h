// The scene that all ray casters are asked about, and the rays.
#pragma once

#include <memory>
#include <vector>

#include <skerry/queries.h>

namespace skerry::bench {

struct RayScene {
  std::vector<Pose> boxes;           // half extents of 0.5 m
  std::shared_ptr<MeshData> ground;  // at the origin
};

class RayCaster {
 public:
  virtual ~RayCaster() = default;
  // Fraction of the nearest hit; above 1 if there is none.
  virtual double cast(const RayCast& ray) = 0;
};
std::unique_ptr<RayCaster> make_bullet_caster(const RayScene& scene);

}  // namespace skerry::bench
