// The API edge: what a user may do, what is refused, and that a refusal changes nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <thread>

#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

constexpr double kDt = 1.0 / 60;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// Calls, and expects an InputError that names the field; the world must hash as before.
template <class Call>
void expect_refused(World& world, const std::string& field, Call call) {
  const std::uint64_t before = world.state_hash();
  const std::size_t bodies = world.body_count();
  try {
    call();
    ADD_FAILURE() << field << " was accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.field(), field);
    EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
  }
  EXPECT_EQ(world.state_hash(), before);
  EXPECT_EQ(world.body_count(), bodies);
}

void expect_body_refused(const std::string& field, const BodyDesc& body) {
  World world;
  add_floor(world);
  expect_refused(world, field, [&] { world.add_body(body); });
}

const std::vector<Vec3> kCorner = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

TEST(BadInput, sizes_that_are_not_lengths_are_refused) {
  const auto ground = std::make_shared<MeshData>(
      MeshData{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}});
  for (const double bad : {kNan, kInf, -1.0, 0.0, 1e-300, 1e300}) {
    expect_body_refused("shapes[0].radius", {.shapes = {Sphere{.radius = bad}}});
    expect_body_refused("shapes[0].half_height",
                        {.shapes = {Capsule{.radius = 1, .half_height = bad}}});
    expect_body_refused("shapes[0].half_extents.y", {.shapes = {Box{.half_extents = {1, bad, 1}}}});
    expect_body_refused("shapes[0].radius", {.shapes = {Cylinder{.radius = bad}}});
    expect_body_refused("shapes[0].half_height", {.shapes = {Cone{.half_height = bad}}});
    expect_body_refused("shapes[0].semi_axes.z", {.shapes = {Ellipsoid{.semi_axes = {1, 1, bad}}}});
    expect_body_refused("shapes[0].scale.y",
                        {.shapes = {ConvexHull{.points = kCorner, .scale = {1, bad, 1}}}});
    expect_body_refused(
        "shapes[0].scale.x",
        {.type = BodyType::fixed, .shapes = {TriangleMesh{.data = ground, .scale = {bad, 1, 1}}}});
  }
}

TEST(BadInput, values_of_bodies_that_are_not_physical_are_refused) {
  const std::vector<Shape> shapes = {Sphere{}};
  expect_body_refused("position", {.shapes = shapes, .position = {0, kNan, 0}});
  expect_body_refused("orientation", {.shapes = shapes, .orientation = Quat(2, 0, 0, 0)});
  expect_body_refused("orientation", {.shapes = shapes, .orientation = Quat(0, 0, 0, 0)});
  expect_body_refused("linear_velocity", {.shapes = shapes, .linear_velocity = {kInf, 0, 0}});
  expect_body_refused("density", {.shapes = shapes, .density = 0});
  expect_body_refused("friction", {.shapes = shapes, .friction = -0.1});
  expect_body_refused("restitution", {.shapes = shapes, .restitution = 1.5});
  expect_body_refused("mass.mass", {.shapes = shapes, .mass = MassOverride{.mass = -2}});
  expect_body_refused(
      "mass.inertia",
      {.shapes = shapes, .mass = MassOverride{.mass = 2, .inertia = Vec3(1, 1, 5).asDiagonal()}});
  expect_body_refused("mass", {});
  expect_body_refused("linear_velocity",
                      {.type = BodyType::fixed, .shapes = shapes, .linear_velocity = {1, 0, 0}});
  expect_body_refused("shapes[1]", {.shapes = {Sphere{}, Plane{}}});
  expect_body_refused("type", {.type = static_cast<BodyType>(9), .shapes = shapes});
}

TEST(BadInput, numbers_beyond_what_the_solver_can_hold_are_refused) {
  const std::vector<Shape> shapes = {Sphere{}};
  for (const double huge : {1e300, -1e300, 1e31}) {
    expect_body_refused("position", {.shapes = shapes, .position = {0, huge, 0}});
    expect_body_refused("linear_velocity", {.shapes = shapes, .linear_velocity = {huge, 0, 0}});
    expect_body_refused("angular_velocity", {.shapes = shapes, .angular_velocity = {0, 0, huge}});
    expect_body_refused("gravity_scale", {.shapes = shapes, .gravity_scale = huge});
    expect_body_refused(
        "mass.center",
        {.shapes = shapes, .mass = MassOverride{.mass = 1, .center = Vec3(0, huge, 0)}});
    EXPECT_THROW(World({.gravity = {0, huge, 0}}), InputError);
  }
  expect_body_refused("friction", {.shapes = shapes, .friction = 1e30});
  expect_body_refused("linear_damping", {.shapes = shapes, .linear_damping = 1e30});
  expect_body_refused("angular_damping", {.shapes = shapes, .angular_damping = 1e30});
  expect_body_refused("shapes[0].offset",
                      {.type = BodyType::fixed, .shapes = {Plane{.offset = 1e300}}});
  EXPECT_THROW(World({.solver = {.contact_damping_ratio = 1e30}}), InputError);
  EXPECT_THROW(World({.solver = {.joint_damping_ratio = 1e30}}), InputError);
  World world;
  const BodyId ball = world.add_body({.shapes = shapes});
  expect_refused(world, "impulse", [&] { world.apply_impulse(ball, {1e300, 0, 0}); });
  expect_refused(world, "impulse", [&] {
    world.apply_impulse_at(ball, {1e10, 0, 0}, {0, 1e12, 0});
  });
  expect_refused(world, "anchor", [&] {
    world.add_joint(BallJoint{.b = ball, .anchor = {1e300, 0, 0}});
  });
  expect_refused(world, "drive.spring.frequency", [&] {
    world.add_joint(HingeJoint{.b = ball, .drive = {.spring = {.frequency = 1e-300}}});
  });
  expect_body_refused("mass.mass", {.shapes = shapes, .mass = MassOverride{.mass = 1e300}});
  expect_body_refused("mass.mass", {.shapes = shapes, .mass = MassOverride{.mass = 1e-300}});
  expect_body_refused(
      "mass.inertia",
      {.shapes = shapes, .mass = MassOverride{.mass = 1, .inertia = 1e-300 * Mat3::Identity()}});
  expect_body_refused("mass", {.shapes = shapes, .density = 1e300});
  expect_body_refused("mass", {.shapes = shapes, .density = 1e-300});
  expect_body_refused("shapes[0].local_pose.position",
                      {.shapes = {{Sphere{}, {.local_pose = {.position = {1e30, 0, 0}}}}}});
  const auto far = std::make_shared<MeshData>(
      MeshData{.vertices = {{0, 0, 0}, {1e30, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}});
  expect_body_refused("shapes[0].data",
                      {.type = BodyType::fixed, .shapes = {TriangleMesh{.data = far}}});
}

TEST(BadInput, planets_and_dust_are_not_absurd) {
  World world({.gravity = {0, 0, 0}});
  const BodyId planet = world.add_body({.shapes = {Sphere{.radius = 6.4e6}}, .density = 5500});
  const BodyId dust = world.add_body({.shapes = {Sphere{.radius = 2e-6}},
                                      .position = {1e11, 0, 0},
                                      .linear_velocity = {0, 3e8, 0}});
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(world.step(kDt).warnings.empty());
  EXPECT_NEAR(world.mass(planet) / 6.04e24, 1, 0.01);
  EXPECT_NEAR(world.pose(dust).position.y(), 10 * kDt * 3e8, 1);
}

TEST(BadInput, geometry_that_is_no_solid_is_refused) {
  expect_body_refused("shapes[0].points",
                      {.shapes = {ConvexHull{.points = {{0, 0, 0}, {1, 0, 0}}}}});
  expect_body_refused(
      "shapes[0].points",
      {.shapes = {ConvexHull{.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}}}});
  const std::vector<Vec3> long_corner = {{0, 0, 0}, {1e6, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  expect_body_refused("shapes[0].scale",
                      {.shapes = {ConvexHull{.points = long_corner, .scale = {11, 1, 1}}}});
  const std::vector<Vec3> small_corner = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
  expect_body_refused(
      "shapes[0].points",
      {.shapes = {ConvexHull{.points = small_corner, .scale = {1e-6, 1e-6, 1e-6}}}});
  expect_body_refused("shapes[0].data", {.shapes = {TriangleMesh{}}});
  const auto open = std::make_shared<MeshData>(
      MeshData{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 2}}});
  expect_body_refused("shapes[0].data", {.shapes = {TriangleMesh{.data = open}}});
  const auto bad_index = std::make_shared<MeshData>(
      MeshData{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .triangles = {{0, 1, 7}}});
  expect_body_refused("shapes[0].data",
                      {.type = BodyType::fixed, .shapes = {TriangleMesh{.data = bad_index}}});
}

TEST(Shapes, a_scaled_hull_is_the_hull_of_its_points_times_the_scale) {
  const Vec3 scale(2, 0.5, 3);
  std::vector<Vec3> points = {{0.3, -0.2, 0.3}, {-0.3, -0.2, 0.3}, {0, -0.2, -0.4}, {0, 0.4, 0}};
  const auto fallen = [](const ConvexHull& hull) {
    World world;
    add_floor(world);
    // Beside one that is not scaled: they must not be taken for each other.
    world.add_body({.shapes = {ConvexHull{.points = hull.points}}, .position = {5, 1, 0}});
    const BodyId body = world.add_body({.shapes = {hull}, .position = {0, 2, 0}});
    for (int i = 0; i < 120; ++i) world.step(kDt);
    return std::pair(world.pose(body), world.mass(body));
  };
  const auto [scaled, mass] = fallen({.points = points, .scale = scale});
  const QueryShape asked(ConvexHull{.points = points, .scale = scale});
  for (Vec3& point : points) point = point.cwiseProduct(scale);
  const auto [plain, plain_mass] = fallen({.points = points});
  EXPECT_EQ(scaled.position, plain.position);
  EXPECT_EQ(scaled.orientation.coeffs(), plain.orientation.coeffs());
  EXPECT_EQ(mass, plain_mass);

  World world;
  world.add_body({.shapes = {Sphere{.radius = 0.1}}, .position = {0, -0.1, 0.95}});
  EXPECT_EQ(world.overlap(asked, {}).size(), 1u);  // its corner at z = 0.9; 0.3 unscaled
}

TEST(BadInput, time_steps_and_settings_are_checked) {
  World world;
  for (const double dt : {0.0, -kDt, kNan, kInf, 2.0, 1e-300}) {
    expect_refused(world, "dt", [&] { world.step(dt); });
  }
  EXPECT_THROW(World({.gravity = {0, kNan, 0}}), InputError);
  EXPECT_THROW(World({.workers = -1}), InputError);
  EXPECT_THROW(World({.rate_hz = 0}), InputError);
  EXPECT_THROW(World({.rate_hz = 0.5}), InputError) << "steps of 2 s";
  EXPECT_THROW(World({.mode = static_cast<ThreadingMode>(77)}), InputError);
  EXPECT_THROW(World({.integrator = static_cast<Integrator>(77)}), InputError);
  EXPECT_THROW(World({.broadphase = static_cast<BroadphaseKind>(77)}), InputError);
  EXPECT_THROW(World({.solver = {.kind = static_cast<SolverKind>(77)}}), InputError);
  EXPECT_THROW(World({.solver = {.substeps = 0}}), InputError);
}

TEST(BadInput, joints_need_two_bodies_of_which_one_can_move) {
  World world;
  const BodyId floor = add_floor(world), wall = add_floor(world);
  const BodyId box = add_box(world, {0, 2, 0});
  expect_refused(world, "b", [&] { world.add_joint(BallJoint{.a = box, .b = box}); });
  expect_refused(world, "a", [&] { world.add_joint(BallJoint{.a = floor, .b = wall}); });
  expect_refused(world, "axis", [&] {
    world.add_joint(HingeJoint{.a = floor, .b = box, .axis = {0, 0, 0}});
  });
  expect_refused(world, "lower_angle", [&] {
    world.add_joint(HingeJoint{.a = floor, .b = box, .lower_angle = 1.0, .upper_angle = -1.0});
  });
}

TEST(StaleIds, are_refused_with_a_usage_error) {
  World world;
  const BodyId a = add_box(world, {0, 1, 0});
  const BodyId b = add_box(world, {3, 1, 0});
  const JointId joint = world.add_joint(BallJoint{.a = a, .b = b});
  world.remove_body(a);
  EXPECT_FALSE(world.contains(a));
  EXPECT_FALSE(world.contains(joint)) << "joints go with their bodies";
  EXPECT_EQ(world.joint_count(), 0u);
  EXPECT_THROW(world.pose(a), UsageError);
  EXPECT_THROW(world.apply_impulse(a, {1, 0, 0}), UsageError);
  EXPECT_THROW(world.remove_body(a), UsageError);
  EXPECT_THROW(world.remove_joint(joint), UsageError);
  const BodyId c = add_box(world, {0, 1, 0});
  EXPECT_EQ(c.index, a.index) << "the lowest free row is used again";
  EXPECT_FALSE(world.contains(a));
  EXPECT_TRUE(world.contains(c));
  EXPECT_THROW(world.pose(BodyId{}), UsageError);
}

TEST(Activity, calls_during_a_step_are_refused_and_the_step_goes_on) {
  World world({.mode = ThreadingMode::job_system, .workers = 2});
  add_floor(world);
  const BodyId box = add_box(world, {0, 2, 0});
  PendingStep pending = world.begin_step(kDt);
  EXPECT_THROW(world.pose(box), UsageError);
  EXPECT_THROW(world.add_body({.shapes = {Sphere{}}}), UsageError);
  EXPECT_THROW(world.step(kDt), UsageError);
  world.post(Impulse{box, {0, 1, 0}});
  EXPECT_EQ(world.end_step(pending).step, 1u);
  EXPECT_THROW(world.end_step(pending), UsageError);
  EXPECT_LT(world.pose(box).position.y(), 2);
}

TEST(Activity, dedicated_calls_in_other_modes_are_refused) {
  World world;
  EXPECT_THROW(world.start(), UsageError);
  EXPECT_THROW(world.stop(), UsageError);
}

TEST_P(EveryMode, what_a_force_field_throws_reaches_the_caller_and_the_world_stays_usable) {
  World world = make_world(GetParam());
  add_floor(world);
  for (int i = 0; i < 20; ++i) add_box(world, {2.0 * i, 5, 0});
  std::atomic<bool> armed = true;
  world.add_force_field([&armed](const FieldSample& sample) -> FieldForce {
    if (armed) throw std::runtime_error("field of body " + std::to_string(sample.body.index));
    return {.force = {1, 0, 0}};
  });
  try {
    step(world, kDt);
    ADD_FAILURE() << "nothing thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "field of body 1") << "that of the lowest body id";
  }
  EXPECT_EQ(world.step_count(), 1u) << "the step was finished";
  armed = false;
  EXPECT_EQ(step(world, kDt).step, 2u);
}

TEST_P(EveryMode, callbacks_that_call_the_world_get_a_usage_error_not_a_deadlock) {
  World world = make_world(GetParam());
  const BodyId box = add_box(world, {0, 5, 0});
  world.add_force_field([&](const FieldSample&) -> FieldForce {
    world.set_pose(box, {});
    return {};
  });
  EXPECT_THROW(step(world, kDt), UsageError);
  EXPECT_NEAR(world.pose(box).position.y(), 5, 0.01);
}

TEST_P(EveryMode, commands_apply_in_the_order_posted) {
  World world = make_world(GetParam(), {.gravity = {0, 0, 0}});
  const BodyId ball = add_sphere(world, {0, 0, 0});
  BodyId spawned;
  world.post(SetVelocity{ball, {1, 0, 0}, {0, 0, 0}});
  world.post(SetVelocity{ball, {2, 0, 0}, {0, 0, 0}});
  world.post(
      Spawn{{.shapes = {Sphere{}}, .position = {9, 0, 0}}, [&](BodyId id) { spawned = id; }});
  const StepReport first = step(world, 0.5);
  EXPECT_TRUE(first.warnings.empty());
  EXPECT_NEAR(world.pose(ball).position.x(), 1, 1e-12);
  ASSERT_TRUE(world.contains(spawned));
  world.post(RemoveBody{spawned});
  world.post(Impulse{spawned, {1, 0, 0}});
  const StepReport second = step(world, 0.5);
  EXPECT_FALSE(world.contains(spawned));
  ASSERT_EQ(second.warnings.size(), 1u);
  EXPECT_NE(second.warnings[0].find("skipped"), std::string::npos);
}
INSTANTIATE_TEST_SUITE_P(World, EveryMode, testing::ValuesIn(every_mode()), name_of);

TEST(Post, refuses_bad_values_at_the_call) {
  World world;
  const BodyId ball = add_sphere(world, {0, 0, 0});
  expect_refused(world, "impulse", [&] { world.post(Impulse{ball, {kNan, 0, 0}}); });
  expect_refused(world, "shapes[0].radius",
                 [&] { world.post(Spawn{{.shapes = {Sphere{.radius = -1}}}}); });
}

TEST(Events, begin_once_and_end_once) {
  World world({.sleep = {.enabled = false}});
  const BodyId floor = add_floor(world);
  const BodyId ball = add_sphere(world, {0, 0.6, 0});
  int begins = 0;
  for (int n = 0; n < 60; ++n) {
    world.step(kDt);
    for (const ContactEvent& event : world.contact_events()) {
      ASSERT_EQ(event.kind, ContactEventKind::begin);
      EXPECT_EQ(event.a, floor);
      EXPECT_EQ(event.b, ball);
      EXPECT_NEAR(event.normal.y(), 1, 1e-6) << "from a to b";
      EXPECT_GT(event.approach_speed, 0.5);
      ++begins;
    }
  }
  EXPECT_EQ(begins, 1);
  world.remove_body(ball);
  world.step(kDt);
  ASSERT_EQ(world.contact_events().size(), 1u);
  EXPECT_EQ(world.contact_events()[0].kind, ContactEventKind::end);
  EXPECT_EQ(world.contact_events()[0].b, ball) << "the id it had";
}

TEST(Events, a_sensor_reports_and_does_not_push) {
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {{Box{}, {.sensor = true}}}});
  const BodyId ball = add_sphere(world, {0, 3, 0}, 0.2);
  std::vector<ContactEventKind> kinds;
  for (int n = 0; n < 120; ++n) {
    world.step(kDt);
    for (const ContactEvent& event : world.contact_events()) {
      EXPECT_TRUE(event.sensor);
      kinds.push_back(event.kind);
    }
  }
  EXPECT_EQ(kinds, (std::vector{ContactEventKind::begin, ContactEventKind::end}));
  EXPECT_NEAR(world.pose(ball).position.y(), 3 - 0.5 * 9.81 * 4, 1e-6) << "fell freely";
}

TEST(Sleep, a_pile_falls_asleep_and_a_hit_wakes_all_of_it) {
  World world;
  add_floor(world);
  std::vector<BodyId> boxes;
  for (int i = 0; i < 5; ++i) boxes.push_back(add_box(world, {0, 0.5 + i, 0}));
  const BodyId other = add_box(world, {20, 0.5, 0});
  for (int n = 0; n < 180; ++n) world.step(kDt);
  for (const BodyId box : boxes) EXPECT_FALSE(world.awake(box));
  EXPECT_FALSE(world.awake(other));
  EXPECT_EQ(world.last_report().awake_bodies, 0u);
  world.apply_impulse(boxes[4], {0, 0, 1});
  for (const BodyId box : boxes) EXPECT_TRUE(world.awake(box));
  EXPECT_FALSE(world.awake(other)) << "another island sleeps on";
}

TEST(Sleep, taking_the_support_away_wakes_what_rested_on_it) {
  World world;
  const BodyId floor = add_floor(world);
  const BodyId box = add_box(world, {0, 0.5, 0});
  for (int n = 0; n < 120; ++n) world.step(kDt);
  ASSERT_FALSE(world.awake(box));
  world.remove_body(floor);
  EXPECT_TRUE(world.awake(box));
  for (int n = 0; n < 60; ++n) world.step(kDt);
  EXPECT_LT(world.pose(box).position.y(), -3);
}

TEST(Transforms, list_all_bodies_and_say_which_changed) {
  World world;
  add_floor(world);
  const BodyId still =
      world.add_body({.type = BodyType::kinematic, .shapes = {Box{}}, .position = {9, 9, 9}});
  const BodyId ball = add_sphere(world, {0, 5, 0});
  world.step(kDt);
  ASSERT_EQ(world.bodies().size(), 3u);
  ASSERT_EQ(world.changed().size(), 1u);
  const std::uint32_t row = world.changed()[0];
  EXPECT_EQ(world.bodies()[row], ball);
  EXPECT_EQ(world.transforms()[row].position, world.pose(ball).position);
  EXPECT_EQ(world.bodies()[1], still);
}

TEST(DedicatedThread, keeps_its_rate_and_shows_snapshots) {
  World world(
      {.mode = ThreadingMode::dedicated_thread, .rate_hz = 200, .block_policy = BlockPolicy::all});
  add_floor(world);
  const BodyId ball = add_sphere(world, {0, 100, 0});
  const auto begin = std::chrono::steady_clock::now();
  world.start();
  EXPECT_TRUE(world.running());
  EXPECT_THROW(world.pose(ball), UsageError);
  Snapshot last;
  while (last.step() < 15) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const Snapshot now = world.latest(interpolated);
    ASSERT_TRUE(now.find(ball).has_value());
    EXPECT_GE(now.step(), last.step());
    EXPECT_GE(now.age(), 0);
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    EXPECT_LE(double(now.step()), 200 * passed.count() + 1) << "never ahead of its rate";
    last = now;
  }
  world.post(SetVelocity{ball, {7, 0, 0}, {0, 0, 0}});
  world.stop();
  world.run_steps(1, kDt);
  EXPECT_NEAR(world.linear_velocity(ball).x(), 7, 1e-9) << "the command was not lost";
  EXPECT_THROW(world.stop(), UsageError);
}

TEST(DedicatedThread, can_start_and_stop_many_times) {
  World world({.mode = ThreadingMode::dedicated_thread, .rate_hz = 1000});
  add_sphere(world, {0, 1, 0});
  for (int i = 0; i < 200; ++i) {
    world.start();
    if (i % 3 == 0) world.latest();
    world.stop();
  }
}

TEST(DedicatedThread, what_a_step_throws_comes_out_of_stop) {
  World world({.mode = ThreadingMode::dedicated_thread, .rate_hz = 500});
  add_sphere(world, {0, 1, 0});
  std::atomic<bool> thrown = false;
  world.add_force_field([&](const FieldSample&) -> FieldForce {
    thrown = true;
    throw std::runtime_error("field");
  });
  world.start();
  while (!thrown) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_THROW(world.stop(), std::runtime_error);
  EXPECT_FALSE(world.running());
}

TEST_P(EveryMode, tells_every_step_to_a_callback_on_the_thread_that_made_it) {
  struct Told {
    std::uint64_t step;
    std::thread::id thread;
    double idle_ms;
    std::size_t tasks;
  };
  std::vector<Told> told;
  WorldSettings settings = {.record_tasks = true};
  settings.after_step = [&](const StepReport& report, std::span<const jobs::TaskRecord> tasks) {
    told.push_back({report.step, std::this_thread::get_id(), report.idle_ms, tasks.size()});
    EXPECT_GT(report.begin_ns, 0);
  };
  World world = make_world(GetParam(), settings);
  add_floor(world);
  add_box(world, {0, 1, 0});
  for (int i = 0; i < 3; ++i) step(world, kDt);
  ASSERT_EQ(told.size(), 3u);
  const bool dedicated = GetParam().mode == ThreadingMode::dedicated_thread ||
                         GetParam().mode == ThreadingMode::dedicated_thread_jobs;
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_EQ(told[i].step, i + 1);
    EXPECT_EQ(told[i].thread != std::this_thread::get_id(), dedicated);
    EXPECT_GT(told[i].idle_ms, -1e-6);
    EXPECT_GT(told[i].tasks, 5u);
  }
}

TEST_P(EveryMode, what_the_step_callback_throws_reaches_the_caller) {
  bool angry = true;
  WorldSettings settings;
  settings.after_step = [&](const StepReport&, std::span<const jobs::TaskRecord>) {
    if (angry) throw std::runtime_error("callback");
  };
  World world = make_world(GetParam(), settings);
  add_box(world, {0, 1, 0});
  EXPECT_THROW(step(world, kDt), std::runtime_error);
  angry = false;
  step(world, kDt);
  EXPECT_EQ(world.step_count(), 2u);
}

TEST(ManyWorlds, live_side_by_side) {
  std::vector<World> worlds;
  for (int i = 0; i < 64; ++i) {
    worlds.push_back(World(
        {.mode = i % 2 ? ThreadingMode::job_system : ThreadingMode::fork_join, .workers = 2}));
    add_floor(worlds.back());
    for (int k = 0; k < 30; ++k) add_box(worlds.back(), {1.1 * (k % 6), 1.0 + k / 6 * 1.1, 0});
  }
  std::set<std::uint64_t> hashes;
  for (World& world : worlds) {
    for (int n = 0; n < 30; ++n) world.step(kDt);
    hashes.insert(world.state_hash());
  }
  EXPECT_EQ(hashes.size(), 1u);
}

}  // namespace
}  // namespace skerry::test
