// Islands against a search through the graph of contacts and joints.
#include "solver/islands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <queue>
#include <random>
#include <set>

#include <skerry/jobs/executor.h>

#include "solver/solve_islands.h"
#include "tests/solver/hand_made_world.h"
#include "tests/support/rounds.h"
#include "tests/support/shuffling_executor.h"

namespace skerry::solver {
namespace {

using core::BodyIndex;

class GraphWorld : public HandMadeWorld {
 public:
  explicit GraphWorld(std::uint32_t workers = 1)
      : workers_(workers), scratch_(make_solver_scratch(workers)) {}

  void touch(BodyIndex a, BodyIndex b) {
    core::ContactPair pair;
    pair.a = std::min(a, b);  // one collider a body
    pair.b = std::max(a, b);
    pair.body_a = pair.a;
    pair.body_b = pair.b;
    pair.first_manifold = core::take_manifolds(contacts, 1);
    pair.manifold_count = 1;
    pair.flags = core::kTouching;
    contacts.active.push_back(static_cast<std::uint32_t>(contacts.pairs.size()));
    contacts.pairs.push_back(pair);
    edges_.emplace_back(a, b);
  }
  void join(BodyIndex a, BodyIndex b) {
    core::Joint joint;
    joint.alive = true;
    joint.a = a;
    joint.b = b;
    joints.rows.push_back(joint);
    edges_.emplace_back(a, b);
  }

  void build(jobs::Task& task) {
    core::StepContext step = context();
    step.worker_count = workers_;
    step.solver = scratch_.get();
    build_islands(step, {0, 1}, task);
  }

  // As sets of bodies, by their lowest one.
  std::vector<std::vector<BodyIndex>> built() {
    LoneTask task;
    build(task);
    std::vector<std::vector<BodyIndex>> all;
    for (const core::Island& island : islands.islands)
      all.emplace_back(islands.bodies.begin() + island.first_body,
                       islands.bodies.begin() + island.first_body + island.body_count);
    return all;
  }

  // All that the solver is told.
  std::vector<std::vector<std::uint32_t>> listed() const {
    std::vector<std::vector<std::uint32_t>> all = {
        islands.bodies, islands.joints, islands.free_bodies, {}, {}, {}};
    for (const core::ContactRef& contact : islands.contacts)
      all[3].insert(all[3].end(), {contact.manifold, contact.pair});
    for (const core::Island& i : islands.islands)
      all[4].insert(all[4].end(), {i.first_body, i.body_count, i.first_contact, i.contact_count,
                                   i.first_joint, i.joint_count});
    for (const core::IslandGroup& group : islands.groups)
      all[5].insert(all[5].end(),
                    {static_cast<std::uint32_t>(group.kind), group.first, group.count});
    return all;
  }

  std::vector<std::vector<BodyIndex>> searched() const {
    std::vector<std::vector<BodyIndex>> next(bodies.rows());
    std::vector<bool> connected(bodies.rows()), seen(bodies.rows());
    const auto moves = [&](BodyIndex b) {
      return b != core::kNone && bodies.is(b, core::kDynamic);
    };
    for (const auto& [a, b] : edges_) {
      if (moves(a)) connected[a] = true;
      if (moves(b)) connected[b] = true;
      if (!moves(a) || !moves(b)) continue;
      next[a].push_back(b);
      next[b].push_back(a);
    }
    std::vector<std::vector<BodyIndex>> all;
    for (BodyIndex root = 0; root < bodies.rows(); ++root) {
      if (!connected[root] || seen[root]) continue;
      std::vector<BodyIndex> island;
      std::queue<BodyIndex> open({root});
      seen[root] = true;
      for (; !open.empty(); open.pop()) {
        island.push_back(open.front());
        for (const BodyIndex other : next[open.front()]) {
          if (seen[other]) continue;
          seen[other] = true;
          open.push(other);
        }
      }
      std::sort(island.begin(), island.end());
      all.push_back(island);
    }
    return all;
  }

 private:
  std::uint32_t workers_;
  SolverScratchPtr scratch_;
  std::vector<std::pair<BodyIndex, BodyIndex>> edges_;
};

TEST(Islands, are_those_of_a_search_through_2000_random_graphs) {
  std::mt19937 random(5);
  const auto below = [&](std::size_t n) { return static_cast<BodyIndex>(random() % n); };
  std::size_t several = 0;
  for (int graph = 0; graph < 2000; ++graph) {
    GraphWorld world;
    const BodyIndex count = 2 + below(40);
    for (BodyIndex i = 0; i < count; ++i) {
      const auto kind = random() % 8;
      if (kind == 0)
        world.add_fixed();
      else if (kind == 1)
        world.add_kinematic(Vec3::Zero(), Vec3::UnitX(), Vec3::Zero());
      else
        world.add({});
    }
    world.bodies.awake_stale = true;
    std::set<std::pair<BodyIndex, BodyIndex>> touching;
    for (std::size_t i = random() % (count + 1); i-- > 0;) {
      const BodyIndex a = below(count), b = below(count);
      if (a != b) touching.emplace(std::min(a, b), std::max(a, b));
    }
    for (const auto& [a, b] : touching) world.touch(a, b);
    for (std::size_t i = random() % 8; i-- > 0;) {  // doubles, and joints to the world
      const BodyIndex a = random() % 4 == 0 ? core::kNone : below(count), b = below(count);
      if (a != b) world.join(a, b);
    }
    const auto islands = world.built();
    ASSERT_EQ(islands, world.searched()) << "graph " << graph;
    several += islands.size() > 1;
  }
  EXPECT_GT(several, 1000u);
}

TEST(Islands, of_a_chain_of_4096_is_one) {
  for (const bool shuffled : {false, true}) {
    GraphWorld world;
    std::vector<BodyIndex> order;
    for (int i = 0; i < 4096; ++i) order.push_back(world.add({}));
    if (shuffled) std::shuffle(order.begin(), order.end(), std::mt19937(3));
    for (std::size_t i = 1; i < order.size(); ++i) world.join(order[i - 1], order[i]);
    const auto islands = world.built();
    ASSERT_EQ(islands.size(), 1u);
    EXPECT_EQ(islands[0].size(), 4096u);
  }
}

// 4000 bodies, some of them fixed, kinematic or asleep, in heaps and alone, and 9000 pairs, most of them
// of two bodies with near numbers.
void fill(GraphWorld& world, std::mt19937& random) {
  const auto below = [&](BodyIndex n) { return static_cast<BodyIndex>(random() % n); };
  constexpr BodyIndex kBodies = 4000;
  for (BodyIndex i = 0; i < kBodies; ++i) {
    const auto kind = random() % 30;
    if (kind == 0)
      world.add_fixed();
    else if (kind == 1)
      world.add_kinematic(Vec3::Zero(), Vec3::UnitX(), Vec3::Zero());
    else
      world.add({.flags = core::kDynamic | (kind == 2 ? 0u : core::kAwake)});
  }
  const BodyIndex reach = 2 + below(60);
  for (int i = 0; i < 9000; ++i) {
    const BodyIndex a = below(kBodies);
    const BodyIndex away = random() % 500 == 0 ? below(kBodies) : 1 + below(reach);
    if (a % 64 > 40 || a + away >= kBodies) continue;
    world.touch(a, a + away);
    if (random() % 4 == 0) world.contacts.pairs.back().flags = 0;
  }
  for (int i = 0; i < 50; ++i) {
    const BodyIndex a = below(kBodies - 1);
    world.join(a, a + 1);
  }
}

// One worker, two and three threads, and seven in whatever order.
TEST(Islands, are_the_same_from_any_workers_std_thread) {
  std::vector<std::unique_ptr<jobs::Executor>> executors;
  executors.push_back(jobs::make_executor(jobs::ExecutorKind::serial));
  for (const int workers : {2, 3})
    executors.push_back(jobs::make_executor(jobs::ExecutorKind::threads, {.workers = workers}));
  executors.push_back(std::make_unique<test::ShufflingExecutor>(test::Shuffle{.workers = 7}));
  jobs::TaskGraph graph;
  graph.stage({"build_islands", jobs::kOnce,
               [](void* world, core::IndexRange, jobs::Task& task) {
                 static_cast<GraphWorld*>(world)->build(task);
               },
               nullptr, 1, 0, 1});
  const int graphs = test::rounds(30);
  std::size_t largest = 0;
  for (int seed = 0; seed < graphs; ++seed) {
    std::vector<std::vector<std::uint32_t>> serial;
    for (const std::unique_ptr<jobs::Executor>& executor : executors) {
      GraphWorld world(executor->worker_count());
      std::mt19937 random(static_cast<unsigned>(seed));
      fill(world, random);
      for (int step = 0; step < 2; ++step) {  // on fresh memory, and on that of a step before
        executor->run(graph, &world);
        if (serial.empty()) serial = world.listed();
        ASSERT_EQ(world.listed(), serial) << "graph " << seed;
      }
      for (const core::Island& island : world.islands.islands)
        largest = std::max<std::size_t>(largest, island.body_count);
    }
    ASSERT_GT(serial[0].size(), 1000u);
  }
  EXPECT_GT(largest, 1000u);
}

}  // namespace
}  // namespace skerry::solver
