// The seven scenes that other engines are compared on. Every number here is part of the comparison.
#include "scenes/builders.h"
#include "scenes/geometry.h"
#include "scenes/lcg.h"

namespace skerry::scenes {
namespace {

constexpr double kCubeHalf = 0.5;

SceneDesc common_scene(std::uint64_t steps) {
  SceneDesc scene;
  scene.defaults.steps = steps;
  return scene;
}

BodyDesc cube(const Vec3& position, double density) {
  return dynamic_body(Box{Vec3::Constant(kCubeHalf)}, position, density);
}

// Triangle of touching unit cubes in the plane z, `base` of them in the lowest row; `left` is the x
// of the corner below row 0 less half a cube.
void add_pyramid(SceneDesc& scene, int base, double left, double z) {
  for (int i = 0; i < base; ++i) {
    for (int j = i; j < base; ++j) {
      const double x = 0.5 * (i + 1) + (j - i) + left;
      scene.bodies.push_back(cube({x, i + 0.5, z}, 100));
    }
  }
}

// Lattice of nx x layers x nz, x fastest, then z, then y; centred in x and z.
struct Lattice {
  int nx, layers, nz;
  double pitch;
  double base;  // y of the lowest layer
};

template <class PlaceBody>
void for_lattice(const Lattice& lattice, PlaceBody&& place) {
  for (int y = 0; y < lattice.layers; ++y) {
    for (int z = 0; z < lattice.nz; ++z) {
      for (int x = 0; x < lattice.nx; ++x) {
        const double px = (x - (lattice.nx - 1) * 0.5) * lattice.pitch;
        const double pz = (z - (lattice.nz - 1) * 0.5) * lattice.pitch;
        place(Vec3(px, lattice.base + lattice.pitch * y, pz), y);
      }
    }
  }
}

constexpr Lattice kBoxes = {16, 16, 16, 1.2, 1.5};
const Vec3 kJitter = {0.05, 0.05, 0.05};

SceneDesc boxes_in_a_pit(std::uint64_t seed, double odd_layer_shift) {
  SceneDesc scene = common_scene(600);
  add_pit(scene, 24, 24);
  Lcg random(seed);
  for_lattice(kBoxes, [&](const Vec3& at, int layer) {
    const double shift = layer % 2 == 1 ? odd_layer_shift : 0;
    const Vec3 jitter = random.symmetric3(kJitter);
    scene.bodies.push_back(cube(at + Vec3(shift, 0, shift) + jitter, 1000));
  });
  return scene;
}

}  // namespace

BodyDesc fixed_box(const Vec3& half_extents, const Vec3& position) {
  return {.type = BodyType::fixed,
          .shapes = {Box{half_extents}},
          .position = position,
          .friction = 0.6};
}

BodyDesc dynamic_body(Shape shape, const Vec3& position, double density) {
  return {.shapes = {std::move(shape)}, .position = position, .density = density, .friction = 0.6};
}

BodyNumber add(SceneDesc& scene, BodyDesc body) {
  scene.bodies.push_back(std::move(body));
  return static_cast<BodyNumber>(scene.bodies.size() - 1);
}

void add_floor(SceneDesc& scene, double half_x, double half_z) {
  scene.bodies.push_back(fixed_box({half_x, 1, half_z}, {0, -1, 0}));
}

void add_pit(SceneDesc& scene, double width, double wall_height) {
  const double inner = width / 2;
  const double middle = inner + 0.5;
  const double h = wall_height / 2;
  add_floor(scene, inner + 1, inner + 1);
  for (const double side : {-1.0, 1.0}) {
    scene.bodies.push_back(fixed_box({0.5, h, inner + 1}, {side * middle, h, 0}));
    scene.bodies.push_back(fixed_box({inner + 1, h, 0.5}, {0, h, side * middle}));
  }
}

SceneDesc make_large_pyramid(std::uint64_t) {
  SceneDesc scene = common_scene(200);
  add_floor(scene, 400, 400);
  add_pyramid(scene, 100, -50, 0);
  return scene;
}

SceneDesc make_many_pyramids(std::uint64_t) {
  SceneDesc scene = common_scene(100);
  add_floor(scene, 77, 77);
  for (int row = 0; row < 14; ++row) {
    for (int column = 0; column < 14; ++column) {
      const double center_x = -77 + 11.0 * column + 1;
      add_pyramid(scene, 10, center_x - 0.5, -76 + row * (152.0 / 13));
    }
  }
  return scene;
}

SceneDesc make_box_pile(std::uint64_t seed) { return boxes_in_a_pit(seed, 0); }
SceneDesc make_box_bricks(std::uint64_t seed) { return boxes_in_a_pit(seed, 0.6); }

SceneDesc make_sphere_rain(std::uint64_t seed) {
  SceneDesc scene = common_scene(600);
  add_pit(scene, 16, 16);
  Lcg random(seed);
  for_lattice({20, 20, 20, 0.6, 2}, [&](const Vec3& at, int) {
    scene.bodies.push_back(dynamic_body(Sphere{0.25}, at + random.symmetric3(kJitter)));
  });
  return scene;
}

SceneDesc make_convex_pile(std::uint64_t seed) {
  SceneDesc scene = common_scene(600);
  add_pit(scene, 24, 30);
  Lcg random(seed);
  const ConvexHull rock = {icosahedron(0.5)};
  for_lattice({10, 20, 10, 1.2, 1.5}, [&](const Vec3& at, int) {
    BodyDesc body = dynamic_body(rock, at + random.symmetric3(kJitter));
    body.orientation = random.orientation();
    scene.bodies.push_back(std::move(body));
  });
  return scene;
}

SceneDesc make_islands(std::uint64_t) {
  SceneDesc scene = common_scene(300);
  add_floor(scene, 110, 110);
  for (int i = 0; i < 64; ++i) {
    for (int j = 0; j < 64; ++j) {
      for (int k = 0; k < 5; ++k) {
        scene.bodies.push_back(cube({3 * (i - 31.5), 0.5 + k, 3 * (j - 31.5)}, 1000));
      }
    }
  }
  return scene;
}

}  // namespace skerry::scenes
