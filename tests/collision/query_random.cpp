#include "tests/collision/query_random.h"

#include <cmath>

#include "core/rounding.h"

namespace skerry::test {

Vec3 QueryRandom::vector(double size) {
  const double x = uniform(-size, size), y = uniform(-size, size), z = uniform(-size, size);
  return {x, y, z};
}

Quat QueryRandom::rotation() {
  Quat q;
  do {
    const double w = uniform(-1, 1), x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
    q = Quat(w, x, y, z);
  } while (q.norm() < 0.1);
  return q.normalized();
}

ShapeGeometry random_convex(QueryRandom& random, int kind) {
  const double a = random.uniform(0.2, 1), b = random.uniform(0.2, 1), c = random.uniform(0.2, 1);
  switch (kind) {
    case 0:
      return Sphere{a};
    case 1:
      return Capsule{a, b};
    case 2:
      return Box{{a, b, c}};
    case 3:
      return Cylinder{a, b};
    case 4:
      return Cone{a, b};
    case 5:
      return Ellipsoid{{a, b, c}};
    default:
      break;
  }
  ConvexHull hull;
  for (int i = 0; i < 24; ++i) hull.points.push_back(random.vector(1));
  return hull;
}

namespace {
double wave(double x, double z) { return 0.4 * std::sin(1.3 * x) * std::cos(1.1 * z); }
double rounded(double value) { return double(core::rounded_to_float(value)); }
}  // namespace

std::shared_ptr<MeshData> wavy_mesh(int cells, double size) {
  auto mesh = std::make_shared<MeshData>();
  const double step = size / cells;
  for (int r = 0; r <= cells; ++r)
    for (int c = 0; c <= cells; ++c) {
      const double x = c * step, z = r * step;
      mesh->vertices.emplace_back(rounded(x), rounded(wave(x, z)), rounded(z));
    }
  const auto row = static_cast<std::uint32_t>(cells + 1);
  for (std::uint32_t r = 0; r + 1 < row; ++r)
    for (std::uint32_t c = 0; c + 1 < row; ++c) {
      const std::uint32_t at = r * row + c;
      mesh->triangles.push_back({at, at + row, at + row + 1});
      mesh->triangles.push_back({at, at + row + 1, at + 1});
    }
  return mesh;
}

HeightField wavy_field(int cells, double size) {
  auto data = std::make_shared<HeightFieldData>();
  data->columns = data->rows = static_cast<std::uint32_t>(cells + 1);
  const double step = size / cells;
  for (int r = 0; r <= cells; ++r)
    for (int c = 0; c <= cells; ++c)
      data->heights.push_back(static_cast<float>(wave(c * step, r * step)));
  return {data, {step, 1, step}};
}

World random_world(QueryRandom& random, int bodies, double size, const Vec3& middle,
                   const WorldSettings& settings) {
  World world(settings);
  const auto add = [&](std::vector<Shape> shapes) {
    const Pose pose = random.pose(size);
    world.add_body({.type = BodyType::fixed,
                    .shapes = std::move(shapes),
                    .position = middle + pose.position,
                    .orientation = pose.orientation});
  };
  for (int i = 0; i < bodies; ++i) add({random_convex(random, i % kConvexKinds)});
  add({TriangleMesh{wavy_mesh(12, 6)}});
  add({wavy_field(12, 6)});
  add({Shape(Sphere{0.7}, {.sensor = true})});
  std::vector<Shape> parts;
  for (int i = 0; i < 5; ++i)
    parts.emplace_back(random_convex(random, i), ShapeOptions{.local_pose = random.pose(1.5)});
  add(std::move(parts));
  world.add_body({.type = BodyType::fixed,
                  .shapes = {Plane{.normal = {0, 1, 0}, .offset = 0}},
                  .position = middle - Vec3(0, 1.2 * size, 0)});
  return world;
}

}  // namespace skerry::test
