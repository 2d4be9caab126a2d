// Random worlds of all shapes, for the query tests.
#pragma once

#include <random>

#include <skerry/world.h>

namespace skerry::test {

class QueryRandom {
 public:
  explicit QueryRandom(std::uint32_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * double(engine_()) / double(std::mt19937::max());
  }
  Vec3 vector(double size);
  Quat rotation();
  Pose pose(double size) { return {vector(size), rotation()}; }
  std::uint32_t below(std::uint32_t count) { return engine_() % count; }

 private:
  std::mt19937 engine_;
};

inline constexpr int kConvexKinds = 7;
ShapeGeometry random_convex(QueryRandom& random, int kind);
// A wavy open mesh of 2 * cells^2 triangles, `size` across, its vertices floats as the engine keeps
// them; and the same as a height field.
std::shared_ptr<MeshData> wavy_mesh(int cells, double size);
HeightField wavy_field(int cells, double size);

// Fixed bodies of all kinds (a mesh, a height field, a compound and a sensor too) in a cube.
World random_world(QueryRandom& random, int bodies, double size, const Vec3& middle = Vec3::Zero(),
                   const WorldSettings& settings = {});

}  // namespace skerry::test
