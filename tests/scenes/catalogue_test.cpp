#include "scenes/catalogue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scenes/lcg.h"
#include "scenes/rigid_maths.h"

namespace skerry::test {
namespace {

using scenes::make_scene;
using scenes::SceneDesc;

TEST(Lcg, draws_the_published_sequence) {
  scenes::Lcg random(12345);
  // s = s * 1664525 + 1013904223 mod 2^32, u = (s >> 8) / 2^24, by hand
  EXPECT_EQ(random.unit(), (87628868 >> 8) / 16777216.0);
  EXPECT_EQ(random.unit(), (71072467 >> 8) / 16777216.0);
  EXPECT_EQ(random.unit(), (2332836374u >> 8) / 16777216.0);
  EXPECT_EQ(random.symmetric(0.05), 0.05 * (2 * ((2726892157u >> 8) / 16777216.0) - 1));
}

TEST(RigidMaths, sine_and_cosine_are_good_to_the_last_bits) {
  for (double angle = -200; angle < 200; angle += 0.0137) {
    const auto [s, c] = scenes::sin_cos(angle);
    ASSERT_NEAR(s, std::sin(angle), 4e-16) << angle;
    ASSERT_NEAR(c, std::cos(angle), 4e-16) << angle;
  }
}

TEST(RigidMaths, rotations_agree_with_eigen) {
  const Quat q = scenes::axis_angle({1, 2, -3}, 0.7);
  const Quat p = scenes::euler_xyz({0.1, -0.4, 2});
  const Quat expected = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, -3).normalized()));
  EXPECT_LT((q.coeffs() - expected.coeffs()).norm(), 1e-15);
  EXPECT_LT((scenes::product(q, p).coeffs() - (q * p).coeffs()).norm(), 1e-15);
  EXPECT_LT((scenes::rotated(q, {3, 1, 2}) - q * Vec3(3, 1, 2)).norm(), 1e-14);
}

std::size_t moving(const SceneDesc& scene) {
  return static_cast<std::size_t>(
      std::count_if(scene.bodies.begin(), scene.bodies.end(),
                    [](const BodyDesc& body) { return body.type == BodyType::dynamic; }));
}

// The n-th moving body.
const BodyDesc& body(const SceneDesc& scene, std::size_t n) {
  for (const BodyDesc& candidate : scene.bodies) {
    if (candidate.type == BodyType::dynamic && n-- == 0) return candidate;
  }
  throw std::out_of_range("no such body");
}

TEST(CommonScenes, have_the_published_numbers_of_bodies_and_steps) {
  struct Row {
    const char* name;
    std::size_t bodies;
    std::uint64_t steps;
    std::size_t statics;
  };
  for (const Row& row : {Row{"large_pyramid", 5050, 200, 1}, Row{"many_pyramids", 10780, 100, 1},
                         Row{"box_pile", 4096, 600, 5}, Row{"box_bricks", 4096, 600, 5},
                         Row{"sphere_rain", 8000, 600, 5}, Row{"convex_pile", 2000, 600, 5},
                         Row{"islands", 20480, 300, 1}}) {
    const SceneDesc scene = make_scene(row.name);
    EXPECT_EQ(moving(scene), row.bodies) << row.name;
    EXPECT_EQ(scene.bodies.size() - moving(scene), row.statics) << row.name;
    EXPECT_EQ(scene.defaults.steps, row.steps) << row.name;
    EXPECT_EQ(scene.defaults.dt, 1.0 / 60);
    EXPECT_EQ(scene.defaults.gravity, Vec3(0, -10, 0));
    for (const BodyDesc& each : scene.bodies) {
      ASSERT_EQ(each.friction, 0.6) << row.name;
      ASSERT_EQ(each.restitution, 0) << row.name;
      ASSERT_EQ(each.linear_velocity, Vec3::Zero()) << row.name;
    }
  }
}

TEST(CommonScenes, large_pyramid_is_where_the_formula_says) {
  const SceneDesc scene = make_scene("large_pyramid");
  EXPECT_EQ(std::get<Box>(scene.bodies[0].shapes[0].geometry).half_extents, Vec3(400, 1, 400));
  EXPECT_EQ(scene.bodies[0].position, Vec3(0, -1, 0));
  EXPECT_EQ(body(scene, 0).position, Vec3(0.5 - 50, 0.5, 0));        // i 0, j 0
  EXPECT_EQ(body(scene, 99).position, Vec3(0.5 + 99 - 50, 0.5, 0));  // i 0, j 99
  EXPECT_EQ(body(scene, 100).position, Vec3(1.0 - 50, 1.5, 0));      // i 1, j 1
  EXPECT_EQ(body(scene, 5049).position, Vec3(50.0 - 50, 99.5, 0));   // the top
  EXPECT_EQ(body(scene, 7).density, 100);
}

TEST(CommonScenes, many_pyramids_stand_in_rows) {
  const SceneDesc scene = make_scene("many_pyramids");
  EXPECT_EQ(body(scene, 0).position, Vec3(0.5 - 76 - 0.5, 0.5, -76));
  EXPECT_EQ(body(scene, 54).position, Vec3(5.0 - 76 - 0.5, 9.5, -76));  // top of the first
  const BodyDesc& last = body(scene, 10779);
  EXPECT_EQ(last.position, Vec3(5.0 + (-77 + 11 * 13 + 1) - 0.5, 9.5, -76 + 13 * (152.0 / 13)));
  EXPECT_EQ(last.density, 100);
}

TEST(CommonScenes, box_pile_and_box_bricks_share_their_jitter) {
  const SceneDesc pile = make_scene("box_pile");
  const SceneDesc bricks = make_scene("box_bricks");
  scenes::Lcg random(12345);
  const double jx = random.symmetric(0.05);
  const double jy = random.symmetric(0.05);
  const double jz = random.symmetric(0.05);
  EXPECT_EQ(body(pile, 0).position, Vec3(-7.5 * 1.2 + jx, 1.5 + jy, -7.5 * 1.2 + jz));
  EXPECT_EQ(body(bricks, 0).position, body(pile, 0).position);  // an even layer
  const Vec3 shift = body(bricks, 256).position - body(pile, 256).position;
  EXPECT_LT((shift - Vec3(0.6, 0, 0.6)).norm(), 1e-14);
  // x fastest, then z, then y
  EXPECT_NEAR(body(pile, 1).position.x() - body(pile, 0).position.x(), 1.2, 0.1);
  EXPECT_NEAR(body(pile, 16).position.z() - body(pile, 0).position.z(), 1.2, 0.1);
  EXPECT_NEAR(body(pile, 256).position.y() - body(pile, 0).position.y(), 1.2, 0.1);
  EXPECT_EQ(body(pile, 0).density, 1000);
}

TEST(CommonScenes, pits_have_their_inner_faces_where_they_should_be) {
  const SceneDesc scene = make_scene("sphere_rain");
  for (std::size_t i = 1; i < 5; ++i) {
    const BodyDesc& wall = scene.bodies[i];
    const Vec3& half = std::get<Box>(wall.shapes[0].geometry).half_extents;
    const int axis = half.x() < half.z() ? 0 : 2;
    EXPECT_EQ(half[axis], 0.5);
    EXPECT_EQ(std::abs(wall.position[axis]) - half[axis], 8);
    EXPECT_EQ(wall.position.y() - half.y(), 0);
    EXPECT_EQ(2 * half.y(), 16);
  }
  EXPECT_EQ(std::get<Sphere>(body(scene, 0).shapes[0].geometry).radius, 0.25);
  EXPECT_NEAR(body(scene, 0).position.y(), 2, 0.05);
}

TEST(CommonScenes, convex_pile_draws_jitter_then_orientation) {
  const SceneDesc scene = make_scene("convex_pile");
  scenes::Lcg random(12345);
  const Vec3 jitter = random.symmetric3({0.05, 0.05, 0.05});
  const Quat orientation = random.orientation();
  EXPECT_EQ(body(scene, 0).position, Vec3(-4.5 * 1.2, 1.5, -4.5 * 1.2) + jitter);
  EXPECT_EQ(body(scene, 0).orientation.coeffs(), orientation.coeffs());
  EXPECT_NEAR(orientation.norm(), 1, 1e-15);
  const auto& points = std::get<ConvexHull>(body(scene, 0).shapes[0].geometry).points;
  ASSERT_EQ(points.size(), 12u);
  for (const Vec3& point : points) EXPECT_NEAR(point.norm(), 0.5, 1e-15);
  // A regular icosahedron: each corner has five neighbours at one distance.
  for (const Vec3& a : points) {
    EXPECT_EQ(std::count_if(points.begin(), points.end(),
                            [&](const Vec3& b) {
                              return std::abs((a - b).norm() - 0.5 * 1.0514622242382672) < 1e-12;
                            }),
              5);
  }
}

TEST(CommonScenes, islands_are_stacks_of_five) {
  const SceneDesc scene = make_scene("islands");
  EXPECT_EQ(body(scene, 0).position, Vec3(-94.5, 0.5, -94.5));
  EXPECT_EQ(body(scene, 4).position, Vec3(-94.5, 4.5, -94.5));
  EXPECT_EQ(body(scene, 20479).position, Vec3(94.5, 4.5, 94.5));
}

TEST(Catalogue, seeds_change_the_jitter_and_nothing_else_does) {
  for (const auto& entry : scenes::catalogue()) {
    const SceneDesc a = make_scene(entry.name);
    const SceneDesc b = make_scene(entry.name);
    for (std::size_t i = 0; i < a.bodies.size(); ++i) {
      ASSERT_EQ(a.bodies[i].position, b.bodies[i].position) << entry.name;
    }
  }
  EXPECT_NE(body(make_scene("box_pile", 1), 0).position,
            body(make_scene("box_pile", 2), 0).position);
}

TEST(JointedScenes, ragdoll_rain_keeps_its_schedule) {
  const SceneDesc scene = make_scene("ragdoll_rain");
  EXPECT_EQ(moving(scene), 10u * 3 * 14);
  EXPECT_EQ(scene.joints.size(), 10u * 3 * 13);
  std::vector<std::uint64_t> spawns;
  std::size_t removed = 0;
  for (const scenes::SceneEvent& event : scene.events) {
    if (const auto* spawn = std::get_if<scenes::SpawnEvent>(&event.action)) {
      spawns.push_back(event.step);
      EXPECT_EQ(spawn->bodies.size(), 420u);
    } else {
      ++removed;
    }
  }
  const std::vector<std::uint64_t> due = {17, 65, 81, 129, 145, 193, 209, 257, 273, 321, 337, 385};
  EXPECT_EQ(spawns, due);
  EXPECT_EQ(removed, 3u * 420);
  std::size_t hinges = 0;
  for (std::size_t i = 0; i < 13; ++i) {
    hinges += std::holds_alternative<HingeJoint>(scene.joints[i].joint);
  }
  EXPECT_EQ(hinges, 4u);
}

// A scene's world after some of its steps.
struct Played {
  explicit Played(const char* name, std::uint64_t steps)
      : scene(make_scene(name)),
        world(scenes::world_settings(scene)),
        built(scenes::build(scene, world)) {
    for (std::uint64_t n = 1; n <= steps; ++n) {
      scenes::apply_events(scene, built, world, n);
      world.step(scene.defaults.dt);
    }
  }
  double lowest() const {
    double y = 1e9;
    for (const BodyId id : built.bodies) {
      if (world.contains(id) && world.type(id) == BodyType::dynamic) {
        y = std::min(y, world.pose(id).position.y());
      }
    }
    return y;
  }
  SceneDesc scene;
  World world;
  scenes::BuiltScene built;
};

TEST(JointedScenes, ragdolls_stay_whole_and_above_the_ground) {
  const Played rain("ragdoll_rain", 260);
  EXPECT_GT(rain.lowest(), 0);
  EXPECT_LT(rain.lowest(), 0.2);  // and have arrived
  double widest = 0;
  for (std::size_t first = 100; first + 14 <= rain.built.bodies.size(); first += 14) {
    const Pose pelvis = rain.world.pose(rain.built.bodies[first]);
    const Pose thigh = rain.world.pose(rain.built.bodies[first + 6]);
    // The pelvis is a capsule turned by a quarter: the hip in its axes and in the thigh's.
    const Vec3 hip = pelvis.position + pelvis.orientation * Vec3(-0.05, -0.1, 0);
    const Vec3 top = thigh.position + thigh.orientation * Vec3(0, 0.2, 0);
    widest = std::max(widest, (hip - top).norm());
  }
  EXPECT_LT(widest, 0.02);
}

TEST(JointedScenes, bridges_hang_and_carry_their_boxes) {
  const Played bridges("bridge", 300);
  // Planks 24 of a bridge after its first post; the deepest hangs well above the floor.
  for (std::size_t first = 1; first + 38 <= bridges.built.bodies.size(); first += 38) {
    for (std::size_t plank = 1; plank <= 24; ++plank) {
      const double y = bridges.world.pose(bridges.built.bodies[first + plank]).position.y();
      EXPECT_GT(y, 3.5) << first << ' ' << plank;
      EXPECT_LT(y, 6.2) << first << ' ' << plank;
    }
  }
}

TEST(Catalogue, unknown_names_are_answered_with_the_nearest) {
  try {
    make_scene("box_pil");
    FAIL();
  } catch (const std::out_of_range& error) {
    EXPECT_STREQ(error.what(), "unknown scene 'box_pil' (did you mean \"box_pile\"?)");
  }
}

TEST(Catalogue, the_first_steps_of_every_scene_are_without_warnings) {
  for (const auto& entry : scenes::catalogue()) {
    const SceneDesc scene = make_scene(entry.name);
    World world(scenes::world_settings(scene));
    scenes::build(scene, world);
    for (int i = 0; i < 3; ++i) {
      const StepReport report = world.step(scene.defaults.dt);
      EXPECT_TRUE(report.warnings.empty()) << entry.name << ": " << report.warnings.front();
    }
  }
}

TEST(Catalogue, every_scene_is_buildable) {
  for (const auto& entry : scenes::catalogue()) {
    EXPECT_NO_THROW(scenes::check_buildable(make_scene(entry.name))) << entry.name;
  }
}

}  // namespace
}  // namespace skerry::test
