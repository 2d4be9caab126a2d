// Stress scenes in which a kinematic machine stirs what is loose.
#include <cmath>

#include "scenes/builders.h"
#include "scenes/rigid_maths.h"

namespace skerry::scenes {
namespace {

// A piece of a drum about z: the hull between two radii over an angle.
ConvexHull drum_piece(double inner, double outer, double from, double to, double half_length) {
  ConvexHull piece;
  for (const double angle : {from, to}) {
    const auto [sin, cos] = sin_cos(angle);
    for (const double radius : {inner, outer}) {
      for (const double z : {-half_length, half_length}) {
        piece.points.emplace_back(radius * cos, radius * sin, z);
      }
    }
  }
  return piece;
}

// 36 overlapping segments, and a paddle inside every ninth.
BodyDesc drum() {
  constexpr double kStep = 10 * kRadiansPerDegree, kOverlap = 1 * kRadiansPerDegree;
  constexpr double kInner = 16, kOuter = 18, kPaddle = 14, kHalfLength = 10;
  BodyDesc body = {.type = BodyType::kinematic,
                   .position = {0, 21, 0},
                   .linear_velocity = {0.001, -0.002, 0},
                   .angular_velocity = {0, 0, 25 * kRadiansPerDegree}};
  for (int i = 0; i < 36; ++i) {
    const double from = i * kStep - kOverlap, to = (i + 1) * kStep + kOverlap;
    body.shapes.emplace_back(drum_piece(kInner, kOuter, from, to, kHalfLength));
    if (i % 9 == 0) body.shapes.emplace_back(drum_piece(kPaddle, kInner, from, to, kHalfLength));
  }
  return body;
}

// Points spread evenly over a sphere along a golden spiral.
ConvexHull spiral_rock(int points, double radius) {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  ConvexHull rock;
  for (int i = 0; i < points; ++i) {
    const double height = 1 - (2.0 * i + 1) / points;
    const auto [sin, cos] = sin_cos(i * 2 * kPi / golden);
    const double across = std::sqrt(1 - height * height);
    rock.points.emplace_back(radius * Vec3(across * cos, across * sin, height));
  }
  return rock;
}

// A prism about y.
ConvexHull pillar(int sides, double radius, double half_height) {
  ConvexHull hull;
  for (int i = 0; i < sides; ++i) {
    const auto [sin, cos] = sin_cos(2 * kPi * i / sides);
    for (const double y : {-half_height, half_height}) {
      hull.points.emplace_back(radius * cos, y, radius * sin);
    }
  }
  return hull;
}

}  // namespace

SceneDesc make_washer(std::uint64_t) {
  SceneDesc scene;
  scene.defaults.steps = 1000;
  add_floor(scene, 60, 60);
  add(scene, drum());
  for (int y = 0; y < 20; ++y) {
    for (int z = 0; z < 20; ++z) {
      for (int x = 0; x < 20; ++x) {
        const Vec3 at = {-8 + 0.8 * x, 13 + 0.8 * y, -8 + 0.8 * z};
        add(scene, dynamic_body(Box{Vec3::Constant(0.2)}, at));
      }
    }
  }
  return scene;
}

SceneDesc make_junkyard(std::uint64_t) {
  SceneDesc scene;
  scene.defaults.steps = 500;
  add_floor(scene, 120, 120);
  for (const double side : {-50.0, 50.0}) {
    add(scene, fixed_box({1, 8, 50}, {side, 7, 0}));
    add(scene, fixed_box({50, 8, 1}, {0, 7, side}));
  }
  // Turns about the origin: that is its centre of mass.
  Shape arm(pillar(16, 4, 12));
  arm.options.local_pose.position = {35, 12, 0};
  add(scene, {.type = BodyType::kinematic,
              .shapes = {std::move(arm)},
              .angular_velocity = {0, -6 * kRadiansPerDegree, 0},
              .mass = MassOverride{.center = Vec3::Zero()}});
  const ConvexHull rock = spiral_rock(10, 1.5);
  for (int y = 0; y < 24; ++y) {
    for (int z = 0; z < 21; ++z) {
      for (int x = 0; x < 21; ++x) {
        add(scene, dynamic_body(rock, {-40 + 4.0 * x, 25 + 4.0 * y, -40 + 4.0 * z}));
      }
    }
  }
  return scene;
}

}  // namespace skerry::scenes
