// The judge of the engines is judged by cases that can be worked out by hand.
#include "bench/peers/overlap.h"

#include <gtest/gtest.h>

#include <cmath>

namespace skerry::peers {
namespace {

constexpr double kTolerance = 1e-12;
const double kRoot2 = std::sqrt(2.0);
const double kRoot3 = std::sqrt(3.0);

PeerShape box(const Vec3& half_extents) {
  return {.half_extents = half_extents, .solid = convex_hull(box_corners(half_extents))};
}
PeerShape ball(double radius) { return {.form = Form::sphere, .radius = radius, .solid = {}}; }

Quat turned(double angle, const Vec3& axis) {
  return Quat(Eigen::AngleAxisd(angle, axis.normalized()));
}

const PeerShape kCube = box({0.5, 0.5, 0.5});

double depth(const PeerShape& a, const PeerShape& b, const Pose& pose_b) {
  // Whole scene moved and turned, which must change nothing.
  const Pose frame = {{3, -2, 7}, turned(0.7, {1, 2, 3})};
  const Pose moved = {frame.orientation * pose_b.position + frame.position,
                      frame.orientation * pose_b.orientation};
  const double forward = penetration({&a, frame}, {&b, moved});
  EXPECT_NEAR(forward, penetration({&b, moved}, {&a, frame}), kTolerance);
  return forward;
}

TEST(Overlap, stacked_cubes_overlap_by_what_they_sank) {
  EXPECT_NEAR(depth(kCube, kCube, {{0.2, 0.99, 0.1}}), 0.01, kTolerance);
  EXPECT_LE(depth(kCube, kCube, {{0.2, 1.01, 0.1}}), 0);
}

TEST(Overlap, cube_on_its_corner) {
  const Quat on_corner = Quat::FromTwoVectors(Vec3(1, 1, 1), Vec3(0, -1, 0));
  const double height = 0.5 + kRoot3 / 2;
  EXPECT_NEAR(depth(kCube, kCube, {{0.1, height - 0.003, 0}, on_corner}), 0.003, kTolerance);
  EXPECT_LE(depth(kCube, kCube, {{0.1, height + 0.003, 0}, on_corner}), 0);
}

// One edge along z, one along x: only the cross product of edges finds the axis.
TEST(Overlap, crossed_edges) {
  const Quat roof = turned(M_PI / 4, {0, 0, 1});
  const Quat keel = turned(M_PI / 4, {1, 0, 0});
  const Pose relative = {roof.conjugate() * Vec3(0, kRoot2 - 0.002, 0), roof.conjugate() * keel};
  EXPECT_NEAR(depth(kCube, kCube, relative), 0.002, kTolerance);
}

TEST(Overlap, ball_on_face_edge_corner_and_inside) {
  const PeerShape small = ball(0.25);
  EXPECT_NEAR(depth(kCube, small, {{0.3, 0.74, 0}}), 0.01, kTolerance);
  EXPECT_NEAR(depth(kCube, small, {{0.6, 0.6, 0}}), 0.25 - 0.1 * kRoot2, kTolerance);
  EXPECT_NEAR(depth(kCube, small, {{0.6, 0.6, 0.6}}), 0.25 - 0.1 * kRoot3, kTolerance);
  EXPECT_NEAR(depth(kCube, small, {{0.1, 0.3, 0}}), 0.25 + 0.2, kTolerance);
  EXPECT_LE(depth(kCube, small, {{0.68, 0.68, 0}}), 0);
}

TEST(Overlap, balls) { EXPECT_NEAR(depth(ball(1), ball(2), {{0, 2.5, 0}}), 0.5, kTolerance); }

TEST(Overlap, fixed_bodies_do_not_count_among_themselves) {
  PeerScene scene;
  scene.shapes = {kCube};
  const auto add = [&](const Vec3& at, bool fixed) {
    scene.bodies.push_back({.fixed = fixed, .pose = {at}});
  };
  add({0, 0, 0}, true);
  add({0.5, 0, 0}, true);
  add({0, 0.99, 0}, false);    // 10 mm into the first, and into the second
  add({0.2, 1.96, 0}, false);  // 30 mm into the third
  add({0, 9, 0}, false);
  std::vector<BodyState> states;
  for (const PeerBody& body : scene.bodies) states.push_back({.pose = body.pose});
  const Penetration found = measure_penetration(scene, states);
  EXPECT_EQ(found.pairs, 3u);
  EXPECT_NEAR(found.mean, 0.05 / 3, kTolerance);
  EXPECT_NEAR(found.max, 0.03, kTolerance);
}

TEST(Polyhedron, box_has_few_directions_and_the_right_mass) {
  const Polyhedron solid = convex_hull(box_corners({0.5, 1, 1.5}));
  EXPECT_EQ(solid.faces.size(), 6u);
  EXPECT_EQ(solid.normals.size(), 3u);
  EXPECT_EQ(solid.edges.size(), 3u);
  const SolidMass mass = solid_mass(solid);
  EXPECT_NEAR(mass.volume, 6, kTolerance);
  EXPECT_NEAR(mass.unit_inertia(0, 0), (4.0 + 9.0) / 12, kTolerance);
  EXPECT_NEAR(mass.unit_inertia(1, 1), (1.0 + 9.0) / 12, kTolerance);
  EXPECT_NEAR(mass.center.norm(), 0, kTolerance);
}

}  // namespace
}  // namespace skerry::peers
