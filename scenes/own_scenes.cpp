// Scenes of our own: small, varied, jointed, on a mesh.
#include "scenes/builders.h"
#include "scenes/geometry.h"
#include "scenes/lcg.h"
#include "scenes/rigid_maths.h"

namespace skerry::scenes {
namespace {

const Quat kAlongX = axis_angle({0, 0, 1}, kPi / 2);  // turns the y axis of a capsule into -x

Shape falling_shape(int kind) {
  switch (kind % 4) {
    case 0:
      return Sphere{0.35};
    case 1:
      return Box{{0.3, 0.25, 0.4}};
    case 2:
      return Capsule{0.25, 0.3};
    default:
      return ConvexHull{icosahedron(0.4)};
  }
}

// Capsules in a row along -x from `start`, neighbours joined by a ball or, every third, a hinge
// about z that bends 60 degrees each way.
std::vector<BodyNumber> add_chain(SceneDesc& scene, const Vec3& start, int links) {
  constexpr double kRadius = 0.12;
  constexpr double kHalf = 0.2;
  constexpr double kPitch = 2 * (kHalf + kRadius) + 0.02;
  std::vector<BodyNumber> chain;
  for (int i = 0; i < links; ++i) {
    BodyDesc link = dynamic_body(Capsule{kRadius, kHalf}, start + Vec3(-kPitch * i, 0, 0));
    link.orientation = kAlongX;
    chain.push_back(add(scene, std::move(link)));
    if (i == 0) continue;
    const Vec3 anchor = start + Vec3(-kPitch * (i - 0.5), 0, 0);
    SceneJoint joint = {chain[i - 1], chain[i], BallJoint{.anchor = anchor}};
    if (i % 3 == 0) {
      joint.joint = HingeJoint{
          .anchor = anchor, .axis = {0, 0, 1}, .lower_angle = -kPi / 3, .upper_angle = kPi / 3};
    }
    scene.joints.push_back(std::move(joint));
  }
  return chain;
}

BodyDesc fixed_bar(const Vec3& position) {  // a capsule along z
  BodyDesc bar = {.type = BodyType::fixed,
                  .shapes = {Capsule{0.2, 9}},
                  .position = position,
                  .orientation = axis_angle({1, 0, 0}, kPi / 2)};
  return bar;
}

}  // namespace

SceneDesc make_tiny(std::uint64_t seed) {
  SceneDesc scene;
  scene.defaults.steps = 120;
  add_floor(scene, 10, 10);
  Lcg random(seed);
  for (int i = 0; i < 20; ++i) {
    const Vec3 at = Vec3(1.1 * (i % 2), 0.6 + 1.1 * (i / 4), 1.1 * (i / 2 % 2));
    const Vec3 jitter = random.symmetric3({0.05, 0.05, 0.05});
    const Shape shape = i % 5 == 4 ? Shape(Sphere{0.5}) : Shape(Box{Vec3::Constant(0.5)});
    add(scene, dynamic_body(shape, at + jitter));
  }
  return scene;
}

// A bit of everything that must not depend on threads: a pile, chains, a sensor, and events.
SceneDesc make_mixed(std::uint64_t seed) {
  SceneDesc scene;
  scene.defaults.steps = 600;
  add_pit(scene, 16, 12);
  BodyDesc sensor = fixed_box({2, 1, 2}, {0, 1, 0});
  sensor.shapes[0].options.sensor = true;
  add(scene, std::move(sensor));

  Lcg random(seed);
  BodyNumber first_of_pile = 0;
  for (int i = 0; i < 512; ++i) {
    const Vec3 at = {1.1 * (i % 8 - 3.5), 1.5 + 1.1 * (i / 64), 1.1 * (i / 8 % 8 - 3.5)};
    BodyDesc body = dynamic_body(falling_shape(i), at + random.symmetric3({0.05, 0.05, 0.05}));
    body.orientation = random.orientation();
    const BodyNumber number = add(scene, std::move(body));
    if (i == 0) first_of_pile = number;
  }
  for (int i = 0; i < 4; ++i) add_chain(scene, {2.5, 12.0 + i, 1.5 * i - 2}, 8);

  BodyDesc thrown = dynamic_body(Sphere{0.6}, {0, 14, 0}, 2000);
  thrown.linear_velocity = {0, -12, 0};
  scene.events = {{60, RemoveEvent{first_of_pile}},
                  {60, RemoveEvent{first_of_pile + 20}},
                  {100, ImpulseEvent{first_of_pile + 100, {400, 900, -200}}},
                  {140, SpawnEvent{{std::move(thrown)}, {}}},
                  {160, ImpulseEvent{static_cast<BodyNumber>(scene.bodies.size()), {0, 6000, 0}}}};
  return scene;
}

SceneDesc make_mesh_terrain(std::uint64_t seed) {
  SceneDesc scene;
  scene.defaults.steps = 400;
  const auto ground = std::make_shared<const MeshData>(wavy_ground(80, 40, 0.8, 5));
  scene.meshes["ground"] = ground;
  add(scene, {.type = BodyType::fixed, .shapes = {TriangleMesh{ground}}});
  Lcg random(seed);
  for (int i = 0; i < 600; ++i) {
    const Vec3 at = {2.0 * (i % 10 - 4.5), 3.0 + 1.5 * (i / 100), 2.0 * (i / 10 % 10 - 4.5)};
    BodyDesc body = dynamic_body(falling_shape(i), at + random.symmetric3({0.3, 0.1, 0.3}));
    body.orientation = random.orientation();
    add(scene, std::move(body));
  }
  return scene;
}

// A net of spheres that hangs from its fixed top row: one island of joints in loops.
SceneDesc make_joint_grid(std::uint64_t) {
  constexpr int kSide = 100;
  SceneDesc scene;
  scene.defaults.steps = 100;
  scene.defaults.sleep.enabled = false;
  for (int k = 0; k < kSide; ++k) {
    for (int i = 0; i < kSide; ++i) {
      const Vec3 at(k, -i, 0);
      BodyDesc body = dynamic_body(Sphere{0.4}, at);
      body.shapes[0].options.filter = {.category = 2, .mask = ~2u};
      if (i == 0) body.type = BodyType::fixed;
      const BodyNumber number = add(scene, std::move(body));
      if (i > 0) {
        scene.joints.push_back({number - 1, number, BallJoint{.anchor = at + Vec3(0, 0.5, 0)}});
      }
      if (k > 0 && i > 0) {
        scene.joints.push_back({number - kSide, number, BallJoint{.anchor = at - Vec3(0.5, 0, 0)}});
      }
    }
  }
  return scene;
}

SceneDesc make_chains(std::uint64_t seed) {
  SceneDesc scene;
  scene.defaults.steps = 400;
  add_floor(scene, 20, 20);
  for (const double x : {-3.0, 0.0, 3.0}) add(scene, fixed_bar({x, 2.5, 0}));
  Lcg random(seed);
  for (int i = 0; i < 64; ++i) {
    const Vec3 at = {2.5 + i % 2, 4 + 0.6 * (i / 16), 1.0 * (i % 16 - 7.5)};
    add_chain(scene, at + random.symmetric3({0.5, 0.1, 0.2}), 10);
  }
  return scene;
}

SceneDesc make_gallery(std::uint64_t seed) {
  SceneDesc scene;
  scene.defaults.steps = 300;
  BodyDesc ground = {.type = BodyType::fixed, .shapes = {Plane{{0, 1, 0}, 0}}};
  add(scene, std::move(ground));
  const auto ball = std::make_shared<const MeshData>(ball_mesh(0.45, 2));
  scene.meshes["ball"] = ball;

  const Shape shapes[] = {Sphere{0.45},
                          Sphere{0.45, true},
                          Capsule{0.3, 0.3},
                          Box{{0.4, 0.3, 0.5}},
                          Cylinder{0.4, 0.4},
                          Cone{0.45, 0.45},
                          Ellipsoid{{0.5, 0.3, 0.4}},
                          ConvexHull{icosahedron(0.5)},
                          TriangleMesh{ball}};
  Lcg random(seed);
  constexpr int kColumns = 9;
  for (int i = 0; i < 4 * kColumns; ++i) {
    const Vec3 at = {1.5 * (i % kColumns - 4.0), 1.0 + 1.3 * (i / kColumns), 0};
    const Vec3 jitter = random.symmetric3({0.1, 0, 0.1});
    add(scene, dynamic_body(shapes[i % kColumns], at + jitter));
  }
  BodyDesc dumbbell = {.position = {0, 8, 0}};
  dumbbell.shapes = {Shape(Capsule{0.1, 0.6}),
                     Shape(Sphere{0.3}, {.local_pose = {.position = {0, 0.7, 0}}}),
                     Shape(Sphere{0.3}, {.local_pose = {.position = {0, -0.7, 0}}})};
  dumbbell.orientation = random.orientation();
  add(scene, std::move(dumbbell));
  return scene;
}

}  // namespace skerry::scenes
