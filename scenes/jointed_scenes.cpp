// Stress scenes of joints with limits, springs and friction: ragdolls and hanging bridges.
#include "scenes/builders.h"
#include "scenes/geometry.h"
#include "scenes/lcg.h"
#include "scenes/rigid_maths.h"

namespace skerry::scenes {
namespace {

// -- Ragdolls ---------------------------------------------------------------------------------------

enum class BoneAxis : std::uint8_t { x, y };

// A capsule, and how it hangs on its parent: by a cone and twist about its own axis, or by a hinge
// about x. Facing +z, arms down, the pelvis in the origin.
struct Bone {
  BoneAxis axis;
  double radius, half_height;  // m
  Vec3 at;                     // m
  int parent;
  Vec3 anchor;       // m
  double cone;       // degrees, half angle; 0: a hinge
  double low, high;  // degrees, of the twist or the hinge
  double friction;   // part of kFriction
};
constexpr double kFriction = 5;  // N m
constexpr JointSpring kSpring = {.frequency = 1, .damping_ratio = 0.7};
constexpr int kBones = 14;

constexpr double kHip = 0.1, kShoulder = 0.25;  // m from the middle

std::array<Bone, kBones> human() {
  using enum BoneAxis;
  std::array<Bone, kBones> bones = {{
      {x, 0.1, 0.06, {0, 0, 0}, -1, {0, 0, 0}, 0, 0, 0, 0},
      {x, 0.09, 0.05, {0, 0.14, 0}, 0, {0, 0.07, 0}, 25, -15, 15, 1},
      {x, 0.09, 0.06, {0, 0.28, 0}, 1, {0, 0.21, 0}, 25, -15, 15, 1},
      {x, 0.1, 0.08, {0, 0.43, 0}, 2, {0, 0.355, 0}, 25, -15, 15, 1},
      {y, 0.05, 0.03, {0, 0.57, 0}, 3, {0, 0.51, 0}, 45, -15, 15, 0.8},
      {y, 0.09, 0.04, {0, 0.72, 0}, 4, {0, 0.62, 0}, 20, -15, 15, 0.4},
  }};
  for (int side = 0; side < 2; ++side) {
    const double s = side == 0 ? 1 : -1;
    const auto at = [s](double from_middle, double height) {
      return Vec3(s * from_middle, height, 0);
    };
    const int thigh = 6 + 4 * side, arm = thigh + 2;
    Bone* limbs = bones.data() + thigh;
    limbs[0] = {y, 0.075, 0.15, at(kHip, -0.25), 0, at(kHip, -0.05), 60, -20, 20, 1};
    limbs[1] = {y, 0.06, 0.16, at(kHip, -0.66), thigh, at(kHip, -0.46), 0, -5, 140, 0.7};
    limbs[2] = {y, 0.05, 0.1, at(kShoulder, 0.33), 3, at(0.22, 0.46), 100, -40, 40, 0.5};
    limbs[3] = {y, 0.045, 0.11, at(kShoulder, 0.04), arm, at(kShoulder, 0.185), 0, -140, 5, 0.4};
  }
  return bones;
}

JointDesc joint_of(const Bone& bone, const Pose& doll) {
  const JointDrive drive = {.spring = kSpring, .friction = kFriction * bone.friction};
  const Vec3 anchor = transformed(doll, bone.anchor);
  if (bone.cone == 0) {
    return HingeJoint{.anchor = anchor,
                      .axis = rotated(doll.orientation, {1, 0, 0}),
                      .lower_angle = bone.low * kRadiansPerDegree,
                      .upper_angle = bone.high * kRadiansPerDegree,
                      .drive = drive};
  }
  const Vec3 outward = {0, bone.at.y() > bone.anchor.y() ? 1.0 : -1.0, 0};
  return ConeTwistJoint{.anchor = anchor,
                        .axis = rotated(doll.orientation, outward),
                        .swing_limit = bone.cone * kRadiansPerDegree,
                        .lower_twist = bone.low * kRadiansPerDegree,
                        .upper_twist = bone.high * kRadiansPerDegree,
                        .swing = drive,
                        .twist = drive};
}

// Bodies from number `first` on.
void add_ragdoll(SpawnEvent& to, BodyNumber first, const Pose& doll) {
  static const std::array<Bone, kBones> kHuman = human();
  first += static_cast<BodyNumber>(to.bodies.size());
  for (int i = 0; i < kBones; ++i) {
    const Bone& bone = kHuman[static_cast<std::size_t>(i)];
    BodyDesc body =
        dynamic_body(Capsule{bone.radius, bone.half_height}, transformed(doll, bone.at));
    body.orientation = bone.axis == BoneAxis::y
                           ? doll.orientation
                           : product(doll.orientation, axis_angle({0, 0, 1}, kPi / 2));
    body.rolling_resistance = 0.2 * bone.radius;
    to.bodies.push_back(std::move(body));
    if (bone.parent < 0) continue;
    to.joints.push_back({first + static_cast<BodyNumber>(bone.parent),
                         first + static_cast<BodyNumber>(i), joint_of(bone, doll)});
  }
}

// A raster of cells, each a flat mesh with an upright ring standing out of its middle.
constexpr int kCells = 10;             // a side
constexpr double kCellPitch = 15;      // m
constexpr double kDropHeight = 20;     // m
constexpr double kDollSpacing = 0.75;  // m
constexpr int kDollsPerCell = 3;

double cell_at(int i) { return kCellPitch * (i - (kCells - 1) * 0.5); }

// Three ragdolls above each cell of a column, their bodies numbered from `first` on.
SpawnEvent column_of_ragdolls(int column, BodyNumber first, Lcg& random) {
  SpawnEvent column_of_dolls;
  for (int row = 0; row < kCells; ++row) {
    for (int doll = 0; doll < kDollsPerCell; ++doll) {
      const Vec3 at = {cell_at(column) + kDollSpacing * (doll - (kDollsPerCell - 1) * 0.5),
                       kDropHeight, cell_at(row)};
      const Quat turn = axis_angle({0, 1, 0}, random.symmetric(0.3));
      add_ragdoll(column_of_dolls, first, {at, turn});
    }
  }
  return column_of_dolls;
}

bool column_falls_at(std::uint64_t step) { return (step & 0x2f) == 0; }

// -- Bridges ----------------------------------------------------------------------------------------

constexpr int kBridges = 12;
constexpr int kPlanks = 24;
constexpr double kPlankLength = 0.5, kPlankWidth = 2;  // m
constexpr double kHingeFriction = 40;                  // N m
constexpr int kBoxesPerBridge = 12;

// Planks on an arc that hangs between two posts, hinged to them and to each other about z.
void add_bridge(SceneDesc& scene, double z, Lcg& random) {
  constexpr double kSteepest = 20 * kRadiansPerDegree;  // of the arc, at its ends
  constexpr double kTurn = 2 * kSteepest / kPlanks;
  std::vector<Vec3> hinges = {Vec3::Zero()};
  std::vector<double> slopes;
  for (int i = 0; i < kPlanks; ++i) {
    slopes.push_back(-kSteepest + kTurn * (i + 0.5));
    const auto [sin, cos] = sin_cos(slopes.back());
    hinges.push_back(hinges.back() + kPlankLength * Vec3(cos, sin, 0));
  }
  const Vec3 start = {-0.5 * hinges.back().x(), 6, z};
  std::vector<BodyNumber> row;
  row.push_back(add(scene, fixed_box({0.5, 3, 1}, start - Vec3(0.5, 3, 0))));
  for (int i = 0; i < kPlanks; ++i) {
    const auto n = static_cast<std::size_t>(i);
    BodyDesc plank = dynamic_body(Box{{0.48 * kPlankLength, 0.05, 0.5 * kPlankWidth}},
                                  start + 0.5 * (hinges[n] + hinges[n + 1]), 600);
    plank.orientation = axis_angle({0, 0, 1}, slopes[n]);
    row.push_back(add(scene, std::move(plank)));
  }
  row.push_back(add(scene, fixed_box({0.5, 3, 1}, start + hinges.back() + Vec3(0.5, -3, 0))));
  for (std::size_t i = 0; i < hinges.size(); ++i) {
    scene.joints.push_back({row[i], row[i + 1],
                            HingeJoint{.anchor = start + hinges[i],
                                       .axis = {0, 0, 1},
                                       .drive = {.friction = kHingeFriction}}});
  }
  for (int i = 0; i < kBoxesPerBridge; ++i) {
    const double x = 0.8 * (i % 6 - 2.5), up = 0.8 * (i / 6);
    const Vec3 jitter = random.symmetric3({0.1, 0.1, 0.3});
    BodyDesc box = dynamic_body(Box{Vec3::Constant(0.25)}, Vec3(x, 6 + up, z) + jitter);
    box.orientation = random.orientation();
    add(scene, std::move(box));
  }
}

}  // namespace

SceneDesc make_ragdoll_rain(std::uint64_t seed) {
  SceneDesc scene;
  scene.defaults.steps = 400;
  const auto ground = std::make_shared<const MeshData>(wavy_ground(8, kCellPitch, 0, 0));
  const auto ring = std::make_shared<const MeshData>(torus_mesh(3.75, 1, 16, 16));
  scene.meshes = {{"ground", ground}, {"ring", ring}};
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      add(scene, {.type = BodyType::fixed,
                  .shapes = {TriangleMesh{ground}, TriangleMesh{ring}},
                  .position = {cell_at(column), 0, cell_at(row)}});
    }
  }
  Lcg random(seed);
  const auto cells = static_cast<BodyNumber>(scene.bodies.size());
  constexpr BodyNumber kColumnBodies = kCells * kDollsPerCell * kBones;
  SpawnEvent first_column = column_of_ragdolls(0, cells, random);
  scene.joints = std::move(first_column.joints);
  for (BodyDesc& body : first_column.bodies) add(scene, std::move(body));
  int columns = 1;  // so far
  for (std::uint64_t done = 1; done < scene.defaults.steps; ++done) {
    if (!column_falls_at(done)) continue;
    if (columns >= kCells) {  // the oldest goes
      const BodyNumber oldest = cells + static_cast<BodyNumber>(columns - kCells) * kColumnBodies;
      for (BodyNumber i = 0; i < kColumnBodies; ++i) {
        scene.events.push_back({done + 1, RemoveEvent{oldest + i}});
      }
    }
    const BodyNumber next = cells + static_cast<BodyNumber>(columns) * kColumnBodies;
    scene.events.push_back({done + 1, column_of_ragdolls(columns % kCells, next, random)});
    ++columns;
  }
  return scene;
}

SceneDesc make_bridge(std::uint64_t seed) {
  SceneDesc scene;
  scene.defaults.steps = 400;
  add_floor(scene, 20, 30);
  Lcg random(seed);
  for (int i = 0; i < kBridges; ++i) add_bridge(scene, 4.0 * (i - (kBridges - 1) * 0.5), random);
  return scene;
}

}  // namespace skerry::scenes
