// Boxes, hulls and triangles: the separating-axis search at every width, and kept axes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "collision/geometry_build.h"
#include "collision/polytope_axes.h"
#include "tests/collision/instruction_sets.h"
#include "tests/collision/narrowphase_fixture.h"
#include "tests/collision/narrowphase_oracle.h"
#include "tests/support/rounds.h"

namespace skerry::test {
namespace {

using collision::Axis;
using collision::AxisAnswer;
using collision::AxisName;
using collision::AxisQuery;
using core::V3f;

ConvexHull random_hull(Random& random, int least, int most) {
  ConvexHull hull;
  const int count = static_cast<int>(random.uniform(least, most));
  for (int i = 0; i < count; ++i) {
    const double length = random.uniform(0.3, 0.8);
    hull.points.push_back(length * random.unit());
  }
  for (int i = 0; i < 3; ++i)
    for (const double sign : {-0.3, 0.3}) hull.points.push_back(sign * Vec3::Unit(i));
  return hull;
}

// Two hulls, or a hull and a box, near each other: by turns apart, touching, deep.
class RandomQuery {
 public:
  RandomQuery(Random& random, int kind)
      : a_(collision::build_hull(random_hull(random, 6, kind % 8 == 0 ? 120 : 24).points)),
        b_(collision::build_hull(random_hull(random, 6, 24).points)) {
    query.a = a_->lanes->view;
    query.b = kind % 3 == 0 ? room_.box({0.4f, 0.5f, 0.3f}) : b_->lanes->view;
    const Quat q = kind % 5 == 0 ? Quat(Quat::Identity()) : random.rotation();
    query.rotation = core::to_matrix(core::to_float(q));
    const double distance = random.uniform(0, 1.6);
    query.offset = core::to_float(Vec3(distance * random.unit()));
    query.margin = 0.1f;
    query.tolerance = 3e-4f;
  }
  AxisQuery query;

 private:
  std::shared_ptr<const core::HullGeometry> a_, b_;
  collision::BoxLanes room_;
};

bool same(const Axis& a, const Axis& b) {
  return a.name.kind == b.name.kind && a.name.a == b.name.a && a.name.b == b.name.b &&
         std::memcmp(&a.separation, &b.separation, sizeof a.separation) == 0;
}
bool same(const AxisAnswer& a, const AxisAnswer& b) {
  return same(a.apart, b.apart) && same(a.face_a, b.face_a) && same(a.face_b, b.face_b) &&
         same(a.edges, b.edges);
}

TEST(NarrowphasePolytope, every_width_gives_the_bits_of_the_float_reference) {
  Random random(11);
  int edges = 0;
  const int pairs = rounds(5000);
  for (int i = 0; i < pairs; ++i) {
    RandomQuery pair(random, i);
    AxisAnswer reference, wide;
    search_axes_reference(pair.query, reference);
    edges += reference.edges.name.kind == AxisName::kEdges;
    const Axis best =
        reference.edges.name.kind != AxisName::kNothing ? reference.edges : reference.face_a;
    const Axis recalled = recall_axis_reference(pair.query, best.name);
    on_every_instruction_set([&](const std::string& name) {
      search_axes(pair.query, wide);
      ASSERT_TRUE(same(reference, wide)) << name << " pair " << i;
      ASSERT_TRUE(same(recalled, recall_axis(pair.query, best.name))) << name << " pair " << i;
    });
    if (HasFatalFailure()) return;
    search_axes(pair.query, wide);
    ASSERT_TRUE(same(reference, wide)) << "dispatched, pair " << i;
  }
  EXPECT_GT(edges, pairs / 5);
}

V3f at_vertex(const collision::PolytopeLanes& shape, std::uint32_t i) {
  return {shape.vertices[i], shape.vertices[shape.vertex_stride + i],
          shape.vertices[2 * shape.vertex_stride + i]};
}
double extent(const collision::PolytopeLanes& shape, const Vec3& along) {
  double most = -1e30;
  for (std::uint32_t i = 0; i < shape.vertex_count; ++i)
    most = std::max(most, along.dot(core::to_double(at_vertex(shape, i))));
  return most;
}
Vec3 rotated(const core::M3f& m, const Vec3& v) {
  return v.x() * core::to_double(m.c0) + v.y() * core::to_double(m.c1) +
         v.z() * core::to_double(m.c2);
}
Vec3 rotated_back(const core::M3f& m, const Vec3& v) {
  return {core::to_double(m.c0).dot(v), core::to_double(m.c1).dot(v), core::to_double(m.c2).dot(v)};
}
// Separation along a direction of a's frame, from the vertices alone.
double separation(const AxisQuery& query, const Vec3& n) {
  return n.dot(core::to_double(query.offset)) - extent(query.b, -rotated_back(query.rotation, n)) -
         extent(query.a, n);
}

// Every direction that can be the best one: all faces, all cross products of edges, no pruning.
double best_of_all_axes(const AxisQuery& query) {
  double best = -1e30;
  const auto consider = [&](const Vec3& n) { best = std::max(best, separation(query, n)); };
  for (std::uint32_t i = 0; i < query.a.face_count; ++i)
    consider(core::to_double(query.a.face_normal(i)));
  for (std::uint32_t i = 0; i < query.b.face_count; ++i)
    consider(-rotated(query.rotation, core::to_double(query.b.face_normal(i))));
  for (std::uint32_t i = 0; i < query.a.edge_count; ++i)
    for (std::uint32_t j = 0; j < query.b.edge_count; ++j) {
      const Vec3 n =
          core::to_double(query.a.edge(collision::PolytopeLanes::kAlong, i))
              .cross(rotated(query.rotation,
                             core::to_double(query.b.edge(collision::PolytopeLanes::kAlong, j))));
      if (n.norm() < 1e-3) continue;
      consider(n.normalized());
      consider(-n.normalized());
    }
  return best;
}

TEST(NarrowphasePolytope, pruned_search_finds_the_best_of_all_axes) {
  Random random(12);
  int overlaps = 0;
  const int pairs = rounds(1500);
  for (int i = 0; i < pairs; ++i) {
    RandomQuery pair(random, i);
    pair.query.margin = 10;
    const double best = best_of_all_axes(pair.query);
    if (best > 0) continue;  // beyond faces and edges, two vertices may be the nearest features
    ++overlaps;
    AxisAnswer answer;
    search_axes(pair.query, answer);
    const float found = std::max(answer.face_a.separation,
                                 std::max(answer.face_b.separation, answer.edges.separation));
    // Edges within the tolerance of a face are not looked for.
    ASSERT_NEAR(double(found), best, double(pair.query.tolerance) + 1e-5) << "pair " << i;
  }
  EXPECT_GT(overlaps, pairs / 3);
}

// A pair that drifts, with everything remembered, against the same poses with nothing remembered.
TEST(NarrowphasePolytope, a_kept_axis_is_as_deep_as_a_fresh_one) {
  Random random(13);
  int kept = 0;
  for (int i = 0; i < 100; ++i) {
    const ConvexHull a = random_hull(random, 6, 20), b = random_hull(random, 6, 20);
    PairScene drifting, fresh;
    for (PairScene* scene : {&drifting, &fresh}) {
      scene->add(a, {});
      scene->add(b, {});
      scene->pair(0, 1);
    }
    Pose pose = at(Vec3::Zero(), random.rotation());
    const Vec3 n = random.unit();
    pose.position = (-0.01 - gap_along(a, {}, b, pose, n)) * n;
    const Vec3 drift = random.in_box(3e-4), axis = random.unit();
    for (int step = 0; step < 100; ++step) {
      pose.position += drift;
      pose.orientation = turned(2e-4, axis) * pose.orientation;
      for (PairScene* scene : {&drifting, &fresh}) scene->set_pose(1, pose);
      fresh.contact().cache = 0;
      const core::V3f before = drifting.contacts.polytope_memory[0].searched_at.offset;
      drifting.collide();
      fresh.collide();
      kept += before.x == drifting.contacts.polytope_memory[0].searched_at.offset.x;
      ASSERT_EQ(drifting.contact().manifold_count, fresh.contact().manifold_count);
      if (fresh.contact().manifold_count == 0) continue;
      const auto along = [&](PairScene& scene) {
        return gap_along(a, {}, b, pose, core::to_double(scene.manifold().normal));
      };
      // 0.5 % of the smaller inner radius, which is below 0.8 m, and ties.
      ASSERT_GT(along(drifting), along(fresh) - 5e-3) << "pair " << i << " step " << step;
    }
  }
  EXPECT_GT(kept, 5000);
}

// An edge on an edge, rocked about itself: both faces beside it look along the axis alike.
TEST(NarrowphasePolytope, crossing_edges_keep_their_points_while_they_rock) {
  constexpr double kGolden = 1.618033988749895;
  ConvexHull icosahedron;
  for (const double one : {-1.0, 1.0}) {
    for (const double golden : {-kGolden, kGolden}) {
      for (int k = 0; k < 3; ++k) {
        Vec3 corner = Vec3::Zero();
        corner[k] = golden;
        corner[(k + 2) % 3] = one;
        icosahedron.points.push_back(0.25 * corner);
      }
    }
  }
  PairScene scene;
  const auto a = scene.add(icosahedron, {}), b = scene.add(icosahedron, {});
  scene.pair(a, b);
  // The edge of b below the edge of a, across it; both are halfway along x, y or z.
  const double reach = 0.25 * kGolden;
  std::set<std::uint32_t> first;
  for (int step = 0; step < 20; ++step) {
    const Quat across = turned(std::numbers::pi / 2, {0, 0, 1});
    const Quat rock = turned(step % 2 == 0 ? 1e-3 : -1e-3, {1, 0, 0});
    scene.set_pose(b, {Vec3(0, 0, 2 * reach - 1e-3), rock * across});
    scene.collide();
    ASSERT_EQ(scene.contact().manifold_count, 1);
    ASSERT_EQ(scene.contact().cache & 3u, std::uint32_t{collision::AxisName::kEdges});
    std::set<std::uint32_t> features;
    for (std::uint32_t k = 0; k < scene.manifold().point_count; ++k)
      features.insert(scene.manifold().feature[k]);
    if (step == 0) first = features;
    ASSERT_EQ(features, first) << step;
  }
}

// m outside a hull's faces, in its frame; on its surface: 0.
double outside(const core::HullGeometry& hull, const Vec3& point) {
  double most = -1e30;
  for (const core::HullGeometry::Face& face : hull.faces)
    most = std::max(most, core::to_double(face.normal).dot(point) - double(face.offset));
  return most;
}

ConvexHull box_hull(const Vec3& half) {
  ConvexHull hull;
  for (const double x : {-half.x(), half.x()})
    for (const double y : {-half.y(), half.y()})
      for (const double z : {-half.z(), half.z()}) hull.points.push_back({x, y, z});
  return hull;
}

// Two hulls that just touch, face on face or anyhow, in two scenes alike.
struct Touching {
  ConvexHull a, b;
  Pose pose;
  PairScene scene, other;

  Touching(Random& random, bool faces) {
    a = faces ? box_hull({0.5, 0.4, 0.6}) : random_hull(random, 6, 20);
    b = faces ? box_hull({0.3, 0.5, 0.4}) : random_hull(random, 6, 20);
    const Quat turn = faces ? turned(random.uniform(0, 3), Vec3::UnitY()) : random.rotation();
    const Vec3 n = faces ? Vec3::UnitY() : random.unit();
    pose = at(Vec3::Zero(), turn);
    pose.position = (-0.002 - gap_along(a, {}, b, pose, n)) * n;
    for (PairScene* each : {&scene, &other}) {
      each->add(a, {});
      each->add(b, pose);
      each->pair(0, 1);
    }
  }
  void set_pose() {
    for (PairScene* each : {&scene, &other}) each->set_pose(1, pose);
  }
};

core::PolytopeMemory& memory(PairScene& scene) { return scene.contacts.polytope_memory[0]; }

// While two shapes drift by micrometres, most manifolds are those of earlier steps, gone with the shapes.
TEST(NarrowphasePolytope,
     a_manifold_gone_with_its_shapes_lies_on_both_and_is_as_deep_as_a_new_one) {
  Random random(15);
  int gone_along = 0, points = 0, steps = 0;
  for (int i = 0; i < 100; ++i) {
    Touching pair(random, i % 2 == 0);
    const auto hull_a = collision::build_hull(pair.a.points),
               hull_b = collision::build_hull(pair.b.points);
    const Vec3 drift = random.in_box(2e-5), axis = random.unit();
    for (int step = 0; step < 100; ++step) {
      pair.pose.position += drift;
      pair.pose.orientation = turned(3e-5, axis) * pair.pose.orientation;
      pair.set_pose();
      memory(pair.other).budget = -1;
      const V3f before = memory(pair.scene).made_at.offset;
      pair.scene.collide();
      pair.other.collide();
      ASSERT_EQ(pair.scene.contact().manifold_count, pair.other.contact().manifold_count);
      if (pair.scene.contact().manifold_count == 0) break;
      const core::Manifold& manifold = pair.scene.manifold();
      ++steps;
      gone_along += before.x == memory(pair.scene).made_at.offset.x;
      if (pair.scene.contact().cache == pair.other.contact().cache) {
        ASSERT_NEAR(double(pair.scene.deepest()), double(pair.other.deepest()), 1e-4)
            << "pair " << i << " step " << step;
      }
      const Vec3 normal = core::to_double(manifold.normal);
      ASSERT_NEAR(normal.norm(), 1, 1e-5);
      for (std::uint32_t k = 0; k < manifold.point_count; ++k) {
        ++points;
        const Vec3 middle = pair.scene.world(0, manifold.points[k]);
        const Vec3 half = 0.5 * double(manifold.points[k].separation) * normal;
        const Vec3 in_b = pair.pose.orientation.conjugate() * (middle + half - pair.pose.position);
        // Clipped points lie up to a thousandth of the size outside.
        ASSERT_NEAR(outside(*hull_a, middle - half), 0, 2e-3) << "pair " << i << " step " << step;
        ASSERT_NEAR(outside(*hull_b, in_b), 0, 2e-3) << "pair " << i << " step " << step;
      }
    }
  }
  EXPECT_GT(steps, 4000);
  EXPECT_GT(gone_along, steps * 3 / 4);
  EXPECT_GT(points, 15000);
}

// Fast shapes may touch with what the last manifold left out: theirs is made anew.
TEST(NarrowphasePolytope, a_manifold_goes_along_only_while_the_shapes_are_slow) {
  Random random(16);
  int same_bits = 0, others = 0;
  for (int i = 0; i < 50; ++i) {
    Touching pair(random, i % 2 == 0);
    const bool slow = i % 4 < 2;
    for (int step = 0; step < 20; ++step) {
      pair.pose.position += random.in_box(1e-5);
      pair.set_pose();
      for (PairScene* each : {&pair.scene, &pair.other}) {
        each->dt = 1.0 / 60;
        each->set_motion(1, Vec3(0, 0, slow || step < 5 ? 0.005 : 0.03));
      }
      memory(pair.other).budget = -1;
      pair.scene.collide();
      pair.other.collide();
      const core::Manifold &one = pair.scene.manifold(), &new_one = pair.other.manifold();
      const bool same = one.point_count == new_one.point_count &&
                        std::memcmp(one.points, new_one.points,
                                    one.point_count * sizeof(core::ManifoldPoint)) == 0;
      others += slow && !same;
      same_bits += same;
      if (!slow && step >= 5) {
        ASSERT_TRUE(same) << "pair " << i << " step " << step;
      }
    }
  }
  EXPECT_GT(same_bits, 375);
  EXPECT_GT(others, 100);
}

// Contacts foresee: what they leave out must not be missed by the end of the step, from a fresh search
// nor from a kept axis.
TEST(NarrowphasePolytope, a_pair_without_contact_does_not_overlap_at_the_end_of_the_step) {
  Random random(14);
  int without = 0, approaching = 0;
  const int pairs = rounds(1500);
  for (int i = 0; i < pairs; ++i) {
    const ConvexHull a = random_hull(random, 6, 20), b = random_hull(random, 6, 20);
    Pose poses[2] = {at(Vec3::Zero(), random.rotation()), at(Vec3::Zero(), random.rotation())};
    const Vec3 n = random.unit();
    const double gap = random.uniform(0.006, 0.08);
    poses[1].position = (gap - gap_along(a, poses[0], b, poses[1], n)) * n;
    Vec3 linear[2], angular[2];
    PairScene scene, end;
    scene.dt = 1.0 / 60;
    for (int k = 0; k < 2; ++k) {
      linear[k] = random.in_box(4);
      angular[k] = random.in_box(3);
      for (PairScene* each : {&scene, &end}) each->add(k == 0 ? a : b, poses[k]);
      scene.set_motion(static_cast<core::ColliderIndex>(k), linear[k], angular[k]);
    }
    scene.pair(0, 1);
    end.pair(0, 1);
    for (int k = 0; k < 2; ++k) {
      const Quat turn = turned(scene.dt * angular[k].norm(), angular[k].normalized());
      end.set_pose(static_cast<core::ColliderIndex>(k),
                   {poses[k].position + scene.dt * linear[k], turn * poses[k].orientation});
    }
    for (int repeat = 0; repeat < 2; ++repeat) {
      scene.collide();
      if (scene.contact().manifold_count != 0) continue;
      ++without;
      end.contact().cache = 0;
      end.collide();
      ASSERT_GT(end.deepest(), 0) << "pair " << i;
      approaching += -n.dot(linear[1] - linear[0]) * scene.dt > 0.02;
    }
  }
  EXPECT_GT(without, pairs / 2);
  EXPECT_GT(approaching, pairs / 20);
}

}  // namespace
}  // namespace skerry::test
