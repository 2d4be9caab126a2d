// Events: what is told, when, in which order, and that nothing is lost.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "core/hash.h"
#include "tests/pipeline/event_ledger.h"
#include "tests/support/bodies.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

constexpr double kDt = 1.0 / 60;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// -- Begin, persist, end

struct Resting {
  World world;
  EventLedger ledger;
  BodyId floor, box;

  explicit Resting(int steps = 120) {
    floor = add_floor(world);
    box = add_box(world, {0, 0.5, 0});
    run(steps);
  }
  void run(int steps) {
    for (int n = 0; n < steps; ++n) {
      world.step(kDt);
      ledger.read(world);
    }
  }
};

// Ways in which a pair that touches may end without anybody moving.
struct Ending {
  const char* name;
  std::function<void(Resting&)> make;
};
const std::vector<Ending>& endings() {
  static const std::vector<Ending> all = {
      {"the_body_is_removed", [](Resting& r) { r.world.remove_body(r.box); }},
      {"the_floor_is_removed", [](Resting& r) { r.world.remove_body(r.floor); }},
      {"the_body_is_put_elsewhere",
       [](Resting& r) {
         r.world.set_pose(r.box, {{0, 90, 0}});
       }},
      {"the_floor_is_put_elsewhere",
       [](Resting& r) {
         r.world.set_pose(r.floor, {{0, -90, 0}});
       }},
      {"a_filter_forbids_it", [](Resting& r) { r.world.set_filter(r.box, 0, {.mask = 0}); }},
      {"the_floors_filter_forbids_it",
       [](Resting& r) { r.world.set_filter(r.floor, 0, {.category = 0}); }},
      {"the_body_becomes_fixed", [](Resting& r) { r.world.set_type(r.box, BodyType::fixed); }},
      {"a_joint_forbids_it",
       [](Resting& r) { r.world.add_joint(FixedJoint{.a = r.floor, .b = r.box}); }},
      {"a_command_removes_it", [](Resting& r) { r.world.post(RemoveBody{r.box}); }},
      {"a_command_changes_the_filter",
       [](Resting& r) {
         r.world.post(SetFilter{r.box, 0, {.mask = 0}});
       }},
  };
  return all;
}

class EndOfContact : public testing::TestWithParam<std::tuple<std::size_t, bool>> {};

TEST_P(EndOfContact, is_told_once) {
  const auto& [index, asleep] = GetParam();
  Resting resting(asleep ? 120 : 3);
  ASSERT_EQ(resting.world.awake(resting.box), !asleep);
  ASSERT_EQ(resting.ledger.open(), 1u);
  endings()[index].make(resting);
  resting.run(1);
  EXPECT_EQ(resting.ledger.open(), 0u);
  ASSERT_EQ(resting.world.contact_events().size(), 1u);
  const ContactEvent& end = resting.world.contact_events()[0];
  EXPECT_EQ(end.a, resting.floor);
  EXPECT_EQ(end.b, resting.box);
  EXPECT_EQ(end.impulse, 0);
  resting.run(3);
  EXPECT_EQ(resting.ledger.ends(), 1);
}
INSTANTIATE_TEST_SUITE_P(Events, EndOfContact,
                         testing::Combine(testing::Range(std::size_t{0}, endings().size()),
                                          testing::Bool()),
                         [](const auto& param) {
                           return std::string(endings()[std::get<0>(param.param)].name) +
                                  (std::get<1>(param.param) ? "_while_asleep" : "");
                         });

TEST(Events, a_shape_that_becomes_a_sensor_ends_as_one_and_begins_as_the_other) {
  Resting resting(3);
  resting.world.set_sensor(resting.box, 0, true);
  resting.run(1);
  const auto events = resting.world.contact_events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].kind, ContactEventKind::end);
  EXPECT_FALSE(events[0].sensor);
  EXPECT_EQ(events[1].kind, ContactEventKind::begin);
  EXPECT_TRUE(events[1].sensor);
  resting.run(60);
  EXPECT_LT(resting.world.pose(resting.box).position.y(), 0) << "it falls through";
}

TEST(Events, of_a_near_miss_there_are_none) {
  World world({.gravity = {0, 0, 0}, .hit_speed = 0});
  add_floor(world, 0.6, 0, 2);
  for (const double gap : {0.003, 0.004}) {
    add_sphere(world, {-3, 0.5 + gap, 0});
    const BodyId ball = world.bodies().back();
    world.set_velocity(ball, {2, 0, 0}, {0, 0, 0});
    for (int n = 0; n < 240; ++n) {
      world.step(kDt);
      ASSERT_TRUE(world.contact_events().empty()) << "step " << n << " gap " << gap;
    }
    world.remove_body(ball);
  }
}

TEST(Events, persist_tells_the_load_of_awake_bodies_only) {
  World world({.persist_events = true});
  const BodyId floor = add_floor(world);
  add_box(world, {0, 0.5, 0});
  add_box(world, {0, 1.5, 0});
  EventLedger ledger;
  int told = 0;
  for (int n = 0; n < 200; ++n) {
    world.step(kDt);
    ledger.read(world);
    for (const ContactEvent& event : world.contact_events()) {
      if (event.kind != ContactEventKind::persist || n < 20) continue;
      const double weight = (event.a == floor ? 2 : 1) * 1000 * 9.81 * kDt;
      EXPECT_NEAR(event.impulse, weight, 0.01 * weight) << "step " << n;
      EXPECT_NEAR(event.normal.y(), 1, 1e-6);
      EXPECT_NEAR(event.point.y(), event.a == floor ? 0 : 1, 2e-3);
      ++told;
    }
  }
  EXPECT_GE(told, 10);
  EXPECT_TRUE(world.contact_events().empty()) << "all sleep";
}

// -- Hits

TEST(Events, a_hit_tells_speed_impulse_point_and_normal) {
  for (const double restitution : {0.0, 0.5}) {
    World world({.sleep = {.enabled = false}, .hit_speed = 2});
    const BodyId floor = add_floor(world);
    const BodyId ball = add_sphere(world, {1, 2.5, 3}, 0.5, 0.6, restitution);
    EventLedger ledger;
    std::vector<ContactEvent> hits;
    for (int n = 0; n < 60; ++n) {
      world.step(kDt);
      ledger.read(world);
      for (const ContactEvent& event : world.contact_events())
        if (event.kind == ContactEventKind::hit) hits.push_back(event);
    }
    ASSERT_EQ(hits.size(), 1u);
    const double speed = std::sqrt(2 * 9.81 * 2);
    EXPECT_EQ(hits[0].a, floor);
    EXPECT_EQ(hits[0].b, ball);
    EXPECT_NEAR(hits[0].approach_speed, speed, 9.81 * kDt);
    EXPECT_NEAR(hits[0].impulse, world.mass(ball) * speed * (1 + restitution),
                0.03 * world.mass(ball) * speed);
    EXPECT_NEAR((hits[0].point - Vec3(1, 0, 3)).norm(), 0, 0.1);
    EXPECT_NEAR(hits[0].normal.y(), 1, 1e-6);
  }
}

TEST(Events, a_hit_is_told_above_the_threshold_only_and_for_the_second_blow_too) {
  World world({.hit_speed = 2});
  add_floor(world);
  add_sphere(world, {0, 0.69, 0});  // arrives at 1.93 m/s
  const BodyId plank = add_box(world, {5, 0.1, 0}, {2, 0.1, 0.5});
  EventLedger ledger;
  const auto run = [&](int steps) {
    for (int n = 0; n < steps; ++n) {
      world.step(kDt);
      ledger.read(world);
    }
  };
  run(60);
  EXPECT_EQ(ledger.hits(), 0);
  world.set_velocity(plank, {0, 0, 0}, {0, 0, 3});  // one end up; the other stays on the floor
  run(120);
  EXPECT_GE(ledger.hits(), 1) << "the end comes down while the pair touches";
}

TEST(Events, a_fast_bullets_hit_has_its_speed) {
  World world({.gravity = {0, 0, 0}, .hit_speed = 100});
  const BodyId wall =
      world.add_body({.type = BodyType::fixed, .shapes = {Box{.half_extents = {0.0005, 2, 2}}}});
  const BodyId bullet = world.add_body({.shapes = {Sphere{.radius = 0.01}},
                                        .position = {-7, 0.1, 0.2},
                                        .linear_velocity = {300, 0, 0}});
  EventLedger ledger;
  for (int n = 0; n < 10; ++n) {
    world.step(kDt);
    ledger.read(world);
    for (const ContactEvent& event : world.contact_events()) {
      if (event.kind != ContactEventKind::hit) continue;
      EXPECT_EQ(event.a, wall);
      EXPECT_NEAR(event.approach_speed, 300, 1);
      EXPECT_NEAR(event.impulse, 300 * world.mass(bullet), 3 * world.mass(bullet));
      EXPECT_NEAR(event.normal.x(), -1, 1e-6);
    }
  }
  EXPECT_EQ(ledger.hits(), 1);
}

// -- Sensors

TEST(Sensors, tell_of_bodies_of_every_kind_but_two_that_never_move) {
  constexpr BodyType kTypes[] = {BodyType::fixed, BodyType::kinematic, BodyType::dynamic};
  for (const BodyType sensor_type : kTypes)
    for (const BodyType other_type : kTypes)
      for (const bool sensor_first : {true, false})
        for (const bool asleep : {false, true}) {
          World world({.gravity = {0, 0, 0}});
          const auto add_sensor = [&] {
            return world.add_body({.type = sensor_type,
                                   .shapes = {{Box{}, {.sensor = true}}},
                                   .mass = MassOverride{.mass = 1, .inertia = Mat3::Identity()},
                                   .awake = !asleep});
          };
          const auto add_other = [&] {
            return world.add_body({.type = other_type,
                                   .shapes = {Sphere{.radius = 0.2}},
                                   .position = {0.3, 0, 0},
                                   .awake = !asleep});
          };
          BodyId other;
          if (sensor_first) add_sensor();
          other = add_other();
          if (!sensor_first) add_sensor();
          const bool silent = sensor_type == BodyType::fixed && other_type == BodyType::fixed;
          SCOPED_TRACE(testing::Message()
                       << "sensor " << int(sensor_type) << " other " << int(other_type) << " first "
                       << sensor_first << " asleep " << asleep);
          EventLedger ledger;
          const auto run = [&] {
            for (int n = 0; n < 3; ++n) {
              world.step(kDt);
              ledger.read(world);
            }
          };
          run();
          EXPECT_EQ(ledger.open(), silent ? 0u : 1u);
          if (asleep && other_type == BodyType::dynamic) {
            EXPECT_FALSE(world.awake(other)) << "a sensor wakes nobody";
          }
          world.set_pose(other, {{9, 0, 0}});
          run();
          EXPECT_EQ(ledger.open(), 0u);
          EXPECT_EQ(ledger.ends(), silent ? 0 : 1);
        }
}

TEST(Sensors, see_sleepers_come_and_go_without_waking_them) {
  World world;
  add_floor(world);
  const BodyId box = add_box(world, {0, 0.5, 0});
  EventLedger ledger;
  const auto run = [&](int steps) {
    for (int n = 0; n < steps; ++n) {
      world.step(kDt);
      ledger.read(world);
    }
  };
  run(120);
  ASSERT_FALSE(world.awake(box));
  const BodyId sensor = world.add_body({.type = BodyType::fixed,
                                        .shapes = {{Sphere{.radius = 2}, {.sensor = true}}},
                                        .position = {0, 1, 0}});
  run(2);
  EXPECT_TRUE(ledger.is_open(box, sensor)) << "added around it";
  world.set_pose(sensor, {{9, 1, 0}});
  run(2);
  EXPECT_FALSE(ledger.is_open(box, sensor)) << "moved away";
  world.set_pose(sensor, {{0, 1, 0}});
  run(2);
  EXPECT_TRUE(ledger.is_open(box, sensor)) << "moved back";
  world.set_filter(sensor, 0, {.mask = 0});
  run(2);
  EXPECT_FALSE(ledger.is_open(box, sensor)) << "filtered";
  world.set_filter(sensor, 0, {});
  run(2);
  EXPECT_TRUE(ledger.is_open(box, sensor)) << "no longer filtered";
  EXPECT_FALSE(world.awake(box));
  world.remove_body(sensor);
  run(2);
  EXPECT_FALSE(ledger.is_open(box, sensor));
  EXPECT_FALSE(world.awake(box));
}

TEST(Sensors, keep_a_body_that_falls_asleep_inside_and_end_when_it_is_removed) {
  World world;
  add_floor(world);
  const BodyId sensor = world.add_body(
      {.type = BodyType::fixed, .shapes = {{Box{.half_extents = {1, 1, 1}}, {.sensor = true}}}});
  const BodyId box = add_box(world, {0, 0.5, 0});
  EventLedger ledger;
  for (int n = 0; n < 180; ++n) {
    world.step(kDt);
    ledger.read(world);
  }
  ASSERT_FALSE(world.awake(box));
  EXPECT_EQ(ledger.ends(), 0);
  EXPECT_TRUE(ledger.is_open(sensor, box));
  world.remove_body(box);
  world.step(kDt);
  ledger.read(world);
  EXPECT_EQ(ledger.open(), 0u);
  EXPECT_EQ(world.contact_events().size(), 2u) << "floor and sensor";
}

// -- Sensors and fast bodies

std::shared_ptr<const MeshData> sheet() {
  return std::make_shared<MeshData>(
      MeshData{.vertices = {{0, -1, -1}, {0, 1, -1}, {0, 1, 1}, {0, -1, 1}},
               .triangles = {{0, 1, 2}, {0, 2, 3}}});
}

std::shared_ptr<const HeightFieldData> flat_field() {
  return std::make_shared<HeightFieldData>(
      HeightFieldData{.columns = 3, .rows = 3, .heights = std::vector<float>(9)});
}

TEST(Sensors, are_not_missed_by_bodies_that_cross_them_within_a_step) {
  const std::vector<Shape> sensors = {
      {Box{.half_extents = {0.01, 1, 1}}, {.sensor = true}},
      {Sphere{.radius = 0.3}, {.sensor = true}},
      {Capsule{.radius = 0.1, .half_height = 0.5}, {.sensor = true}},
      {TriangleMesh{.data = sheet()}, {.sensor = true}},
      {HeightField{.data = flat_field()},
       {.local_pose = {{0, -1, -1}, Quat(std::sqrt(0.5), 0, 0, std::sqrt(0.5))}, .sensor = true}},
  };
  const std::vector<Shape> bodies = {Sphere{.radius = 0.05}, Box{.half_extents = {0.1, 0.05, 0.2}},
                                     Capsule{.radius = 0.03, .half_height = 0.1}};
  int step_begun_inside = 0;
  for (const Shape& shape : sensors)
    for (const Shape& body_shape : bodies)
      for (const BodyType type : {BodyType::dynamic, BodyType::kinematic})
        for (int aim = 0; aim < 12; ++aim) {
          World world({.gravity = {0, 0, 0}});
          const BodyId sensor = world.add_body({.type = BodyType::fixed, .shapes = {shape}});
          const bool misses = aim % 3 == 2;
          const Vec3 start(-10 - 0.37 * aim, misses ? 1.5 : 0.02 * aim - 0.1, 0.07);
          const BodyId body = world.add_body({.type = type,
                                              .shapes = {body_shape},
                                              .position = start,
                                              .linear_velocity = {400, 0, 0},
                                              .angular_velocity = {3, 20, 5}});
          EventLedger ledger;
          for (int n = 0; n < 12; ++n) {
            const double x = world.pose(body).position.x();
            step_begun_inside += std::abs(x) < 0.4;
            world.step(kDt);
            ledger.read(world);
          }
          EXPECT_EQ(ledger.begins(), misses ? 0 : 1)
              << "body " << int(type) << " aim " << aim << " from " << start.transpose();
          EXPECT_EQ(ledger.open(), 0u);
          EXPECT_FALSE(ledger.is_open(sensor, body));
          EXPECT_NEAR(world.linear_velocity(body).x(), 400, 1e-9) << "a sensor stops nobody";
        }
  EXPECT_LT(step_begun_inside, 200) << "nearly all cross between two poses";
}

TEST(Sensors, behind_a_wall_are_not_reached_by_a_bullet_that_stops_there) {
  World world({.gravity = {0, 0, 0}});
  world.add_body({.type = BodyType::fixed, .shapes = {Box{.half_extents = {0.01, 2, 2}}}});
  const BodyId before =
      world.add_body({.type = BodyType::fixed,
                      .shapes = {{Box{.half_extents = {0.01, 1, 1}}, {.sensor = true}}},
                      .position = {-1, 0, 0}});
  const BodyId behind =
      world.add_body({.type = BodyType::fixed,
                      .shapes = {{Box{.half_extents = {0.01, 1, 1}}, {.sensor = true}}},
                      .position = {1, 0, 0}});
  const BodyId bullet = world.add_body({.shapes = {Sphere{.radius = 0.02}},
                                        .position = {-3.3, 0, 0},
                                        .linear_velocity = {300, 0, 0}});
  bool met_before = false;
  for (int n = 0; n < 30; ++n) {
    world.step(kDt);
    for (const ContactEvent& event : world.contact_events()) {
      met_before |= event.a == before && event.b == bullet;
      EXPECT_FALSE(event.a == behind);
    }
  }
  EXPECT_TRUE(met_before);
}

TEST(Sensors, that_sweep_over_sleepers_tell_of_each) {
  World world({.gravity = {0, 0, 0}});
  std::vector<BodyId> sleepers;
  for (int i = 0; i < 8; ++i)
    sleepers.push_back(world.add_body({.shapes = {Box{.half_extents = {0.1, 0.1, 0.1}}},
                                       .position = {2.0 * i, 0, 0},
                                       .awake = false}));
  world.add_body({.type = BodyType::kinematic,
                  .shapes = {{Box{.half_extents = {0.02, 1, 1}}, {.sensor = true}}},
                  .position = {-3.1, 0, 0},
                  .linear_velocity = {480, 0, 0}});
  EventLedger ledger;
  for (int n = 0; n < 6; ++n) {
    world.step(kDt);
    ledger.read(world);
  }
  EXPECT_EQ(ledger.begins(), 8);
  EXPECT_EQ(ledger.open(), 0u);
  for (const BodyId body : sleepers) EXPECT_FALSE(world.awake(body));
}

// -- All at once

Shape random_shape(std::mt19937& random) {
  ShapeOptions options;
  options.sensor = random() % 5 == 0;
  switch (random() % 5) {
    case 0:
      return {Sphere{.radius = 0.3}, options};
    case 1:
      return {Capsule{.radius = 0.2, .half_height = 0.3}, options};
    case 2:
      return {Cylinder{.radius = 0.3, .half_height = 0.2}, options};
    case 3:
      return {
          ConvexHull{.points = {{0.3, -0.2, 0.3}, {-0.3, -0.2, 0.3}, {0, -0.2, -0.4}, {0, 0.4, 0}}},
          options};
    default:
      return {Box{.half_extents = {0.3, 0.2, 0.4}}, options};
  }
}

// A crowd to which everything happens that may happen to bodies.
class Crowd {
 public:
  explicit Crowd(World& world) : world_(world) {
    add_floor(world);
    for (int i = 0; i < 60; ++i) add();
  }

  void edit() {
    const BodyId body = ids_[random_() % ids_.size()];
    switch (random_() % 12) {
      case 0:
        add();
        break;
      case 1:
        if (ids_.size() < 30) break;
        world_.remove_body(body);
        std::erase(ids_, body);
        break;
      case 2:
        world_.set_pose(body, {somewhere()});
        break;
      case 3:
        world_.set_filter(body, 0,
                          {.category = 1u << (random_() % 3),
                           .mask = static_cast<std::uint32_t>(random_() % 8 + 1)});
        break;
      case 4:
        world_.set_sensor(body, 0, random_() % 2);
        break;
      case 5:
        world_.set_type(body, static_cast<BodyType>(random_() % 3));
        break;
      case 6:
        if (world_.type(body) != BodyType::fixed)
          world_.set_velocity(body, 60 * (somewhere() - Vec3(0, 2, 0)), {1, 20, 3});
        break;
      case 7:
        world_.set_material(body, 0, {.friction = 0.1, .restitution = 0.5});
        break;
      case 8:
        if (world_.type(body) == BodyType::kinematic)
          world_.set_velocity(body, {0, 0, 0}, {0, 0, 0});
        break;
      case 9:
        world_.post(RemoveBody{body});
        std::erase(ids_, body);
        break;
      default:
        break;
    }
    if (ids_.size() < 30) add();
  }

  void remove_all() {
    for (const BodyId body : std::vector<BodyId>(world_.bodies().begin(), world_.bodies().end()))
      world_.remove_body(body);
    ids_.clear();
  }

 private:
  Vec3 somewhere() {
    const auto number = [&] { return double(random_() % 1000) / 1000; };
    const double x = number(), y = number(), z = number();
    return {4 * x - 2, 4 * y, 4 * z - 2};
  }
  void add() {
    ids_.push_back(
        world_.add_body({.type = random_() % 5 == 0 ? BodyType::kinematic : BodyType::dynamic,
                         .shapes = {random_shape(random_)},
                         .position = somewhere(),
                         .mass = MassOverride{.mass = 20, .inertia = Mat3::Identity()},
                         .awake = random_() % 3 != 0}));
  }

  World& world_;
  std::mt19937 random_{42};
  std::vector<BodyId> ids_;
};

TEST(Events, balance_whatever_is_done_to_bodies) {
  World world({.sleep = {.time = 0.1}, .persist_events = true, .hit_speed = 1});
  Crowd crowd(world);
  EventLedger ledger;
  for (int n = 0; n < 400; ++n) {
    crowd.edit();
    crowd.edit();
    world.step(kDt);
    ledger.read(world);
    ASSERT_FALSE(testing::Test::HasFailure()) << "step " << n;
  }
  EXPECT_GT(ledger.begins(), 200);
  EXPECT_GT(ledger.hits(), 50);
  crowd.remove_all();
  world.step(kDt);
  ledger.read(world);
  EXPECT_EQ(ledger.open(), 0u);
}

std::uint64_t crowd_hash(World& world) {
  Crowd crowd(world);
  core::StateHasher hasher;
  for (int n = 0; n < 60; ++n) {
    crowd.edit();
    world.run_steps(1, kDt);
    hasher.add(world.state_hash());
  }
  return hasher.finish();
}

class EventsInEveryMode : public EveryMode {};

TEST_P(EventsInEveryMode, are_those_of_the_serial_mode) {
  static const std::uint64_t serial = [] {
    World world({.persist_events = true, .hit_speed = 1});
    return crowd_hash(world);
  }();
  World world = make_world(GetParam(), {.persist_events = true, .hit_speed = 1});
  EXPECT_EQ(crowd_hash(world), serial);
}
INSTANTIATE_TEST_SUITE_P(Events, EventsInEveryMode, testing::ValuesIn(every_mode()), name_of);

TEST(Compounds, of_five_hundred_shapes_tell_of_each_that_touches) {
  World world;
  add_floor(world, 0.6, 0, 20);
  BodyDesc desc;
  for (int i = 0; i < 500; ++i)
    desc.shapes.push_back(
        {Box{.half_extents = {0.2, 0.2, 0.2}},
         {.local_pose = {.position = {0.5 * (i % 25) - 6, 0.2, 0.5 * (i / 25) - 5}}}});
  const BodyId raft = world.add_body(desc);
  EventLedger ledger;
  for (int n = 0; n < 30; ++n) {
    world.step(kDt);
    ledger.read(world);
  }
  EXPECT_EQ(ledger.open(), 500u);
  EXPECT_NEAR(world.pose(raft).position.y(), 0, 1e-3);
  world.remove_body(raft);
  world.step(kDt);
  ledger.read(world);
  EXPECT_EQ(ledger.open(), 0u);
}

// -- The calls that change live shapes

TEST(LiveChanges, are_refused_when_they_make_no_sense) {
  World world;
  const BodyId floor = world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
  const BodyId mesh = world.add_body(
      {.type = BodyType::fixed, .shapes = {TriangleMesh{.data = sheet()}}, .position = {0, -9, 0}});
  const BodyId box = add_box(world, {0, 3, 0});
  const std::uint64_t before = world.state_hash();
  const auto refused = [&](const std::string& field, const auto& call) {
    try {
      call();
      ADD_FAILURE() << field << " was accepted";
    } catch (const InputError& error) {
      EXPECT_EQ(error.field(), field) << error.what();
    }
    EXPECT_EQ(world.state_hash(), before);
  };
  refused("shape", [&] { world.set_filter(box, 1, {}); });
  refused("shape", [&] { world.set_sensor(box, 7, true); });
  refused("shape", [&] { world.material(box, 1); });
  refused("material.friction", [&] { world.set_material(box, 0, {.friction = -1}); });
  refused("material.restitution", [&] { world.set_material(box, 0, {.restitution = kNaN}); });
  refused("material.friction", [&] { world.post(SetMaterial{box, 0, {.friction = -1}}); });
  refused("type", [&] { world.set_type(floor, BodyType::dynamic); });
  refused("mass", [&] { world.set_type(mesh, BodyType::dynamic); });
  refused("gravity", [&] { world.set_gravity({0, kInfinity, 0}); });
  EXPECT_THROW(world.set_filter(BodyId{}, 0, {}), UsageError);
  EXPECT_EQ(world.type(floor), BodyType::fixed);
}

TEST(LiveChanges, are_seen_by_the_getters_and_by_queries) {
  World world;
  const BodyId box = add_box(world, {0, 0, 0});
  const RayCast ray = {.origin = {0, 5, 0}, .translation = {0, -9, 0}};
  EXPECT_TRUE(world.ray_hits(ray));
  world.set_filter(box, 0, {.category = 4, .mask = 6, .group = -3});
  EXPECT_EQ(world.filter(box, 0).category, 4u);
  EXPECT_EQ(world.filter(box, 0).group, -3);
  world.set_filter(box, 0, {});
  world.set_sensor(box, 0, true);
  EXPECT_TRUE(world.is_sensor(box, 0));
  EXPECT_FALSE(world.ray_hits(ray));
  world.set_sensor(box, 0, false);
  EXPECT_TRUE(world.ray_hits(ray));
  world.set_material(box, 0, {.friction = 0.25, .restitution = 0.5, .rolling_resistance = 2});
  EXPECT_EQ(world.material(box, 0).friction, 0.25);
  EXPECT_EQ(world.material(box, 0).rolling_resistance, 2);
  world.set_type(box, BodyType::kinematic);
  EXPECT_EQ(world.type(box), BodyType::kinematic);
  EXPECT_EQ(world.mass(box), 0);
  world.set_type(box, BodyType::dynamic);
  EXPECT_NEAR(world.mass(box), 1000, 1e-9);
  EXPECT_NEAR(world.inertia(box)(0, 0), 1000.0 / 6, 1e-9);
}

}  // namespace
}  // namespace skerry::test
