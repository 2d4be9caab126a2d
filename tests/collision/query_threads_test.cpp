// Queries while the world changes, steps, and is asked by several threads.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "pipeline/threading_mode.h"
#include "tests/collision/query_random.h"
#include "tests/support/every_mode.h"

namespace skerry::test {
namespace {

constexpr double kDt = 1.0 / 60;
const RayCast kDown{{0, 100, 0}, {0, -200, 0}};

bool same(const std::optional<CastHit>& a, const std::optional<CastHit>& b) {
  if (a.has_value() != b.has_value()) return false;
  return !a || (a->body == b->body && a->shape == b->shape && a->triangle == b->triangle &&
                a->fraction == b->fraction && a->position == b->position && a->normal == b->normal);
}

bool same(const std::optional<ClosestHit>& a, const std::optional<ClosestHit>& b) {
  return a.has_value() == b.has_value() &&
         (!a || (a->body == b->body && a->shape == b->shape && a->triangle == b->triangle &&
                 a->distance == b->distance && a->on_query == b->on_query &&
                 a->on_body == b->on_body && a->normal == b->normal));
}

BodyId add_ball(World& world, double y) {
  return world.add_body({.shapes = {Sphere{0.5}}, .position = {0, y, 0}});
}

class QueriesInEveryMode : public EveryMode {};
INSTANTIATE_TEST_SUITE_P(Modes, QueriesInEveryMode, testing::ValuesIn(every_mode()), name_of);

TEST_P(QueriesInEveryMode, BatchesGiveWhatSingleCallsGiveAndWhatSerialGives) {
  QueryRandom random(21);
  World world = random_world(random, 60, 6, Vec3::Zero(), make_world(GetParam()).settings());
  QueryRandom again(21);
  World serial = random_world(again, 60, 6);
  std::vector<RayCast> rays;
  std::vector<ShapeCast> casts;
  for (int i = 0; i < 500; ++i) rays.push_back({random.vector(8), random.vector(12)});
  for (int i = 0; i < 140; ++i)
    casts.push_back({QueryShape(Capsule{0.3, 0.4}), random.pose(8), random.vector(12)});
  const auto ray_hits = world.ray_cast_batch(rays);
  const auto cast_hits = world.shape_cast_batch(casts);
  ASSERT_EQ(ray_hits.size(), rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_TRUE(same(ray_hits[i], world.ray_cast(rays[i])));
    EXPECT_TRUE(same(ray_hits[i], serial.ray_cast(rays[i])));
  }
  for (std::size_t i = 0; i < casts.size(); ++i)
    EXPECT_TRUE(same(cast_hits[i], serial.shape_cast(casts[i])));
  std::vector<PlacedShape> places;
  std::vector<Vec3> points;
  for (int i = 0; i < 140; ++i) places.push_back({QueryShape(Capsule{0.5, 0.4}), random.pose(8)});
  for (int i = 0; i < 140; ++i) points.push_back(random.vector(8));
  const auto overlaps = world.overlap_batch(places);
  const auto nearest = world.closest_batch(places, 2),
             nearest_points = world.closest_batch(points, 2);
  std::size_t overlapping = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [shape, pose] = places[i];
    EXPECT_EQ(overlaps[i], serial.overlap(shape, pose));
    overlapping += overlaps[i].size();
    EXPECT_TRUE(same(nearest[i], serial.closest(shape, pose, 2)));
    EXPECT_TRUE(same(nearest_points[i], serial.closest(points[i], 2)));
  }
  EXPECT_GT(overlapping, 0u);
  EXPECT_THROW(
      world.ray_cast_batch(rays, {.accept = [](BodyId, std::uint32_t) -> bool { throw 5; }}), int);
  EXPECT_EQ(world.ray_cast_batch(rays).size(), rays.size());  // still usable
}

TEST_P(QueriesInEveryMode, SeeTheStateAfterEachStep) {
  World world = make_world(GetParam());
  const BodyId ball = add_ball(world, 50);
  for (int i = 0; i < 20; ++i) {
    const auto hit = world.ray_cast(kDown);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->body, ball);
    EXPECT_NEAR(hit->position.y(), world.pose(ball).position.y() + 0.5, 1e-6);
    step(world, kDt);
  }
}

TEST(Queries, SeeEditsAtOnce) {
  World world;
  EXPECT_FALSE(world.ray_cast(kDown));
  const BodyId ball = add_ball(world, 5);
  ASSERT_TRUE(world.ray_cast(kDown));
  world.set_pose(ball, {{0, 20, 0}, Quat::Identity()});
  EXPECT_NEAR(world.ray_cast(kDown)->position.y(), 20.5, 1e-9);
  const BodyId other = add_ball(world, 30);
  EXPECT_EQ(world.ray_cast(kDown)->body, other);
  world.remove_body(other);
  EXPECT_EQ(world.ray_cast(kDown)->body, ball);
  world.remove_body(ball);
  EXPECT_FALSE(world.ray_cast(kDown));
  const BodyId again = add_ball(world, 7);  // rows have new tenants
  EXPECT_EQ(world.ray_cast(kDown)->body, again);
  EXPECT_TRUE(world.queries().contains(again));
  EXPECT_FALSE(world.queries().contains(ball));
}

TEST(Queries, DoNotChangeTheSimulation) {
  const auto hash_after = [](bool ask) {
    World world;
    world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
    for (int i = 0; i < 30; ++i)
      world.add_body({.shapes = {Box{{0.4, 0.4, 0.4}}}, .position = {0.2 * (i % 4), 1.0 + i, 0}});
    for (int i = 0; i < 90; ++i) {
      EXPECT_TRUE(!ask || world.ray_cast(kDown));
      world.step(kDt);
    }
    return world.state_hash();
  };
  EXPECT_EQ(hash_after(true), hash_after(false));
}

TEST(Queries, OfAViewSeeThePictureItWasTakenOf) {
  World world;
  const BodyId ball = add_ball(world, 50);
  const QueryView before = world.queries();
  for (int i = 0; i < 30; ++i) world.step(kDt);
  const QueryView after = world.queries();
  EXPECT_EQ(before.step(), 0u);
  EXPECT_EQ(after.step(), 30u);
  EXPECT_DOUBLE_EQ(before.ray_cast(kDown)->position.y(), 50.5);
  EXPECT_NEAR(after.ray_cast(kDown)->position.y(), world.pose(ball).position.y() + 0.5, 1e-6);
  world.remove_body(ball);
  EXPECT_TRUE(after.contains(ball));
  EXPECT_FALSE(world.queries().contains(ball));
  std::optional<QueryView> survivor;
  {
    World gone;
    add_ball(gone, 5);
    survivor = gone.queries();
  }
  EXPECT_TRUE(survivor->ray_cast(kDown));
}

TEST(Queries, WhileAStepIsPendingSeeTheStateBeforeIt) {
  World world({.mode = ThreadingMode::job_system, .workers = 2});
  add_ball(world, 50);
  EXPECT_NEAR(world.ray_cast(kDown)->position.y(), 50.5, 1e-9);
  PendingStep pending = world.begin_step(kDt);
  EXPECT_TRUE(world.ray_cast(kDown));
  const std::vector<RayCast> rays(300, kDown);
  for (const auto& hit : world.ray_cast_batch(rays)) EXPECT_TRUE(hit);
  world.end_step(pending);
  EXPECT_LT(world.ray_cast(kDown)->position.y(), 50.5);
}

TEST(Queries, FirstAskedDuringAStepAreRefused) {
  World world({.mode = ThreadingMode::job_system, .workers = 2});
  add_ball(world, 50);
  PendingStep pending = world.begin_step(kDt);
  EXPECT_THROW(world.ray_cast(kDown), UsageError);
  world.end_step(pending);
  EXPECT_TRUE(world.ray_cast(kDown));
}

TEST(Queries, FromAForceFieldSeeTheStateBeforeTheStep) {
  World world;
  world.add_body({.type = BodyType::fixed, .shapes = {Plane{}}});
  const BodyId ball = add_ball(world, 3);
  world.queries();
  world.add_force_field([&](const FieldSample& sample) {
    // Hovers: pushed up by what a ray finds below.
    const auto ground = world.ray_cast({sample.position, {0, -10, 0}}, {.ignore = {ball}});
    const double height = ground ? 10 * ground->fraction : 10;
    return FieldForce{
        .force = {
            0, sample.mass * (9.81 + 4 * (2 - height)) - 3 * sample.mass * sample.velocity.y(), 0}};
  });
  for (int i = 0; i < 600; ++i) world.step(kDt);
  EXPECT_NEAR(world.pose(ball).position.y(), 2, 0.05);
}

// -- Under ThreadSanitizer: no oneTBB.

// The ball falls; whatever step a query sees, it sees it whole.
void ask_while_it_falls(World& world, const std::atomic<bool>& stop, std::atomic<int>& asked) {
  double last = 1e9;
  while (!stop.load()) {
    const QueryView view = world.queries();
    const auto upper = view.ray_cast(kDown);
    const auto beside = view.ray_cast({{5, 1000, 0}, {0, -2000, 0}});
    ASSERT_TRUE(upper && beside);
    EXPECT_NEAR(upper->position.y(), beside->position.y(), 1e-9);  // two balls that fall alike
    EXPECT_LE(upper->position.y(), last);
    last = upper->position.y();
    ++asked;
  }
}

TEST(QueriesStdThread, DuringADedicatedThreadsStepsSeeWholeSteps) {
  // So slowly that the balls are in sight of the rays for minutes.
  World world({.gravity = {0, -0.01, 0}, .mode = ThreadingMode::dedicated_thread, .rate_hz = 500});
  for (const double x : {0.0, 5.0})
    world.add_body({.shapes = {Sphere{0.5}}, .position = {x, 90, 0}, .allow_sleep = false});
  std::atomic<bool> stop = false;
  std::atomic<int> asked = 0;
  world.start();
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) threads.emplace_back([&] { ask_while_it_falls(world, stop, asked); });
  for (int i = 0; i < 20; ++i) {
    world.post(Spawn{{.shapes = {Box{}}, .position = {20.0 + 2 * i, 5, 0}}});
    const std::vector<RayCast> rays(200, kDown);
    for (const auto& hit : world.ray_cast_batch(rays)) EXPECT_TRUE(hit);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  while (asked == 0) std::this_thread::yield();
  world.stop();
  stop = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(world.ray_cast({{20, 100, 0}, {0, -200, 0}}));  // what was spawned is there
}

TEST(QueriesStdThread, BesideStepsOfACallerSeeWholeSteps) {
  const pipeline::ExecutorOverride std_threads([](const WorldSettings&) {
    return jobs::make_executor(jobs::ExecutorKind::threads, {.workers = 2});
  });
  World world({.gravity = {0, -0.01, 0}, .mode = ThreadingMode::job_system});
  for (const double x : {0.0, 5.0})
    world.add_body({.shapes = {Sphere{0.5}}, .position = {x, 90, 0}, .allow_sleep = false});
  world.queries();
  std::atomic<bool> stop = false;
  std::atomic<int> asked = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i) threads.emplace_back([&] { ask_while_it_falls(world, stop, asked); });
  threads.emplace_back([&] {
    const std::vector<RayCast> rays(300, kDown);
    while (!stop)
      for (const auto& hit : world.ray_cast_batch(rays)) EXPECT_TRUE(hit);
  });
  for (int i = 0; i < 150 || asked < 100; ++i) world.step(1.0 / 240);
  stop = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(asked.load(), 0);
}

}  // namespace
}  // namespace skerry::test
