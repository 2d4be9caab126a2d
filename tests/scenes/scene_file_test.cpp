#include "scenes/scene_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "scenes/load.h"
#include "scenes/rigid_maths.h"
#include "tests/scenes/cases.h"
#include "tests/support/paths.h"

namespace skerry::test {
namespace {

using scenes::read_scene_text;
using scenes::SceneDesc;
using scenes::SceneError;

std::filesystem::path fixtures() { return source_dir() / "tests/scenes/meshes"; }

SceneDesc read(const std::string& text, const scenes::ReadOptions& options = {}) {
  return read_scene_text(text, "right.json", fixtures(), options);
}

class WrongSceneFile : public testing::TestWithParam<WrongScene> {};

TEST_P(WrongSceneFile, is_refused_with_file_line_path_and_value) {
  try {
    read_scene_text(GetParam().text, "wrong.json", fixtures());
    FAIL() << "read without complaint";
  } catch (const SceneError& error) {
    EXPECT_EQ(error.what(), std::string("wrong.json") + GetParam().message);
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, WrongSceneFile, testing::ValuesIn(wrong_scenes()),
                         [](const auto& row) { return std::string(row.param.name); });

void expect_refused(const std::string& text, const std::string& message) {
  try {
    read(text);
    FAIL() << "read without complaint";
  } catch (const SceneError& error) {
    EXPECT_EQ(error.what(), "right.json" + message);
  }
}

// The sentence is the engine's, file, line and path are ours.
TEST(SceneFile, what_only_the_engine_can_tell_is_reported_with_its_line) {
  const auto expect_at = [](const std::string& shape, const std::string& place) {
    try {
      read(scene_with("\"bodies\": [\n{ \"shapes\": [" + shape + "] }]"));
      FAIL() << "read without complaint";
    } catch (const SceneError& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with("right.json" + place)) << error.what();
      EXPECT_FALSE(error.detail().empty());
    }
  };
  expect_at(R"({ "type": "convex_hull", "points": [[0,0,0],[1,0,0],[0,1,0],[1,1,0]] })",
            ":3: bodies[0].shapes[0].points: ");
  expect_at(R"({ "type": "plane" })", ":3: bodies[0].shapes[0]: ");
  expect_at(R"({ "type": "sphere", "radius": 1e-9 })", ":3: bodies[0].shapes[0].radius: ");
}

TEST(SceneFile, missing_files_are_named) {
  try {
    scenes::read_scene_file("no/such/scene.json");
    FAIL();
  } catch (const SceneError& error) {
    EXPECT_STREQ(error.what(), "no/such/scene.json: no such file");
  }
  EXPECT_THROW(scenes::load_scene("no/such/scene.json"), SceneError);
  EXPECT_THROW(scenes::load_scene("no_such_scene"), std::out_of_range);
}

TEST(SceneFile, defaults_are_those_of_the_documentation) {
  const SceneDesc scene = read(scene_with("\"bodies\": []"));
  EXPECT_EQ(scene.name, "right");
  EXPECT_EQ(scene.defaults.gravity, Vec3(0, -10, 0));
  EXPECT_EQ(scene.defaults.dt, 1.0 / 60);
  EXPECT_EQ(scene.defaults.solver.substeps, 4);
  EXPECT_EQ(scene.defaults.steps, 300u);
  EXPECT_EQ(scene.defaults.solver.kind, SolverKind::soft_step_tgs);
  EXPECT_TRUE(scene.defaults.sleep.enabled);
}

TEST(SceneFile, every_field_arrives) {
  const SceneDesc scene = read(full_scene());
  EXPECT_EQ(scene.name, "full");
  EXPECT_EQ(scene.defaults.gravity, Vec3(0, -9.81, 0));
  EXPECT_EQ(scene.defaults.dt, 0.02);
  EXPECT_EQ(scene.defaults.steps, 50u);
  EXPECT_EQ(scene.defaults.warmup, 5u);
  // ground, thing, heavy, pair, grid of 4 balls and 4 pairs, stack, pile
  EXPECT_EQ(scene.bodies.size(), 3u + 2 + 12 + 3 + 10);
  EXPECT_EQ(scene.joints.size(), 8u + 4 + 1);
  EXPECT_EQ(scene.fields.size(), 5u);
  ASSERT_EQ(scene.events.size(), 3u);
  EXPECT_EQ(scene.events[0].step, 10u);
  EXPECT_EQ(scene.events[2].step, 20u);

  const BodyDesc& thing = scene.bodies[scene.names.at("thing")];
  EXPECT_EQ(thing.position, Vec3(0, 5, 0));
  EXPECT_NEAR(thing.orientation.y(), std::sqrt(0.5), 1e-15);
  EXPECT_EQ(thing.linear_velocity, Vec3(1, 0, 0));
  EXPECT_EQ(thing.angular_velocity, Vec3(0, 1, 0));
  EXPECT_EQ(thing.density, 500);
  EXPECT_EQ(thing.friction, 0.4);
  EXPECT_EQ(thing.restitution, 0.1);
  EXPECT_EQ(thing.rolling_resistance, 0.01);
  ASSERT_TRUE(thing.mass);
  EXPECT_EQ(thing.mass->mass, 10);
  EXPECT_EQ(*thing.mass->center, Vec3(0, 0.1, 0));
  EXPECT_EQ(*thing.mass->inertia, Mat3::Identity());
  EXPECT_EQ(thing.gravity_scale, 0.5);
  EXPECT_EQ(thing.linear_damping, 0.1);
  EXPECT_EQ(thing.angular_damping, 0.2);
  EXPECT_TRUE(thing.locks.translation[2]);
  EXPECT_TRUE(thing.locks.rotation[0]);
  EXPECT_FALSE(thing.allow_sleep);
  EXPECT_EQ(thing.continuous, ContinuousCollision::never);
  EXPECT_EQ(thing.user_data, 77u);
  ASSERT_EQ(thing.shapes.size(), 6u);
  const ShapeOptions& box = thing.shapes[0].options;
  EXPECT_EQ(box.local_pose.position, Vec3(0, 0.5, 0));
  EXPECT_EQ(box.filter.category, 2u);
  EXPECT_EQ(box.filter.mask, 255u);
  EXPECT_EQ(box.filter.group, -3);
  EXPECT_EQ(box.density, 100);
  ASSERT_TRUE(box.material);
  EXPECT_EQ(box.material->friction, 0.9);
  EXPECT_TRUE(thing.shapes[1].options.sensor);
  EXPECT_FALSE(thing.shapes[1].options.material);  // the body's
  EXPECT_EQ(std::get<ConvexHull>(thing.shapes[4].geometry).points[1], Vec3(1, 0, 0));
  EXPECT_EQ(std::get<ConvexHull>(thing.shapes[4].geometry).scale, Vec3(0.5, 0.5, 0.5));
  EXPECT_EQ(std::get<ConvexHull>(thing.shapes[5].geometry).points.size(), 8u);
}

TEST(SceneFile, settings_reach_the_world) {
  const SceneDesc scene = read(full_scene());
  const World world(scenes::world_settings(scene));
  const WorldSettings& settings = world.settings();
  EXPECT_EQ(settings.gravity, Vec3(0, -9.81, 0));
  EXPECT_EQ(settings.solver.kind, SolverKind::pgs);
  EXPECT_EQ(settings.solver.substeps, 6);
  EXPECT_EQ(settings.solver.contact_hertz, 90);
  EXPECT_EQ(settings.solver.contact_damping_ratio, 5);
  EXPECT_EQ(settings.solver.max_push_velocity, 2);
  EXPECT_EQ(settings.solver.restitution_threshold, 0.5);
  EXPECT_EQ(settings.solver.joint_hertz, 50);
  EXPECT_EQ(settings.solver.joint_damping_ratio, 1.5);
  EXPECT_EQ(settings.solver.pgs.iterations, 20);
  EXPECT_EQ(settings.solver.pgs.correction, PositionCorrection::baumgarte);
  EXPECT_EQ(settings.solver.pgs.correction_rate, 0.1);
  EXPECT_EQ(settings.solver.pgs.slop, 0.002);
  EXPECT_EQ(settings.solver.penalty.substeps, 16);
  EXPECT_EQ(settings.solver.penalty.hertz, 80);
  EXPECT_FALSE(settings.sleep.enabled);
  EXPECT_EQ(settings.sleep.linear_threshold, 0.1);
  EXPECT_EQ(settings.sleep.angular_threshold, 0.2);
  EXPECT_EQ(settings.sleep.time, 1);
  EXPECT_EQ(settings.integrator, Integrator::rk4);
  EXPECT_EQ(settings.broadphase, BroadphaseKind::sweep_and_prune);
  EXPECT_FALSE(settings.continuous);
  EXPECT_TRUE(settings.persist_events);
  EXPECT_EQ(settings.hit_speed, 2);
  EXPECT_TRUE(settings.measure_steps);
  EXPECT_EQ(read(scene_with("\"solver\": \"penalty\"")).defaults.solver.kind, SolverKind::penalty);
}

TEST(SceneFile, prefabs_carry_their_joints_to_where_they_are_placed) {
  const SceneDesc scene = read(scene_with(R"(
    "prefabs": { "pair": {
      "bodies": [ { "name": "l", "position": [-1, 0, 0], "linear_velocity": [0, 0, 2], "shapes": [{ "type": "sphere", "radius": 0.5 }] },
                  { "name": "r", "position": [1, 0, 0], "shapes": [{ "type": "sphere", "radius": 0.5 }] } ],
      "joints": [ { "type": "hinge", "a": "l", "b": "r", "anchor": [0.5, 0, 0], "axis": [1, 0, 0] } ] } },
    "bodies": [ { "name": "p", "prefab": "pair", "position": [10, 0, 0], "orientation": { "axis": [0, 1, 0], "degrees": 90 } } ])"));
  const BodyDesc& left = scene.bodies[scene.names.at("p.l")];
  EXPECT_LT((left.position - Vec3(10, 0, 1)).norm(), 1e-14);
  EXPECT_LT((left.linear_velocity - Vec3(2, 0, 0)).norm(), 1e-14);
  const auto& hinge = std::get<HingeJoint>(scene.joints.at(0).joint);
  EXPECT_LT((hinge.anchor - Vec3(10, 0, -0.5)).norm(), 1e-14);
  EXPECT_LT((hinge.axis - Vec3(0, 0, -1)).norm(), 1e-14);
  EXPECT_EQ(scene.joints[0].a, scene.names.at("p.l"));
}

constexpr const char* kGrid = R"("bodies": [ { "name": "g",
    "grid": { "count": [3, 2, 2], "spacing": [2, 3, 4], "jitter": 0.1 },
    "of": [{ "shapes": [{ "type": "sphere", "radius": 0.5 }] }] } ])";

TEST(SceneFile, a_grid_counts_x_first_then_z_then_y_and_is_seeded) {
  const SceneDesc scene = read(scene_with(kGrid));
  ASSERT_EQ(scene.bodies.size(), 12u);
  const auto offset = [&](const char* name, const Vec3& lattice) {
    return (scene.bodies[scene.names.at(name)].position - lattice).cwiseAbs().maxCoeff();
  };
  EXPECT_LE(offset("g[0]", {-2, 0, -2}), 0.1);
  EXPECT_LE(offset("g[1]", {0, 0, -2}), 0.1);
  EXPECT_LE(offset("g[3]", {-2, 0, 2}), 0.1);
  EXPECT_LE(offset("g[6]", {-2, 3, -2}), 0.1);
  EXPECT_EQ(read(scene_with(kGrid)).bodies[7].position, scene.bodies[7].position);
  EXPECT_NE(read(scene_with(kGrid), {.seed = 7}).bodies[7].position, scene.bodies[7].position);
}

TEST(SceneFile, an_open_or_twisted_mesh_is_refused_where_it_matters) {
  const std::string mesh = R"("meshes": {"m": {"file": "FILE"}},
    "bodies": [{"type": "TYPE", "shapes": [{"type": "mesh", "mesh": "m"}]}])";
  const auto with = [&](std::string file, std::string type) {
    std::string text = mesh;
    text.replace(text.find("FILE"), 4, file);
    text.replace(text.find("TYPE"), 4, type);
    return scene_with(text);
  };
  EXPECT_NO_THROW(read(with("open.obj", "fixed")));
  EXPECT_THROW(read(with("open.obj", "dynamic")), SceneError);  // has no volume
  EXPECT_NO_THROW(read(with("block.obj", "dynamic")));
  expect_refused(with("twisted.obj", "fixed"),
                 ":2: meshes.m.file: mesh file \"twisted.obj\": is not manifold: several triangles "
                 "run along the edge (0, 0, 0) - (1, 0, 0) in the same direction");
  expect_refused(
      with("empty.obj", "fixed"),
      ":2: meshes.m.file: mesh file \"empty.obj\": cannot be read: OBJ-file is too small.");
  expect_refused(
      with("words.txt", "fixed"),
      ":2: meshes.m.file: mesh file \"words.txt\": must be an .obj, .stl, .ply, .gltf or "
      ".glb file");
}

TEST(SceneFile, shipped_scenes_can_be_read_and_stepped) {
  const auto files = scenes::shipped_scenes();
  ASSERT_GE(files.size(), 3u);
  std::size_t largest_mesh = 0;
  for (const auto& file : files) {
    SCOPED_TRACE(file);
    const SceneDesc scene = scenes::load_scene(file.stem().string());
    EXPECT_FALSE(scene.description.empty());
    for (const auto& [name, mesh] : scene.meshes) {
      largest_mesh = std::max(largest_mesh, mesh->triangles.size());
    }
    World world(scenes::world_settings(scene));
    scenes::build(scene, world);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(world.step(scene.defaults.dt).warnings.empty());
  }
  EXPECT_GT(largest_mesh, 10'000u);
}

}  // namespace
}  // namespace skerry::test
