// The triangle kernels: the same bits at every width, and what they say is true.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "collision/geometry_build.h"
#include "collision/narrowphase_kernels.h"
#include "tests/collision/instruction_sets.h"
#include "tests/collision/narrowphase_fixture.h"

namespace skerry::test {
namespace {

using collision::TriangleAxes;
using collision::TriangleBatch;
using collision::TriangleClips;
using collision::TriangleTouches;
using core::V3f;

V3f random_vector(Random& random, double most) {
  return core::to_float(Vec3(random.uniform(0, most) * random.unit()));
}

// Triangles about a shape at the origin; edges are touchable, flat or borders by chance.
int random_triangles(Random& random, TriangleBatch& batch) {
  const int count = 1 + static_cast<int>(random.uniform(0, 15.99));
  collision::SurfaceTriangle t;
  for (int lane = 0; lane < TriangleBatch::kSize; ++lane) {
    if (lane < count) {
      for (V3f& corner : t.corner) corner = random_vector(random, 1.2);
      t.normal = collision::direction(
          core::cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]), {0, 1, 0});
      t.touchable = static_cast<unsigned>(random.uniform(0, 7.99));
      t.border = t.touchable & static_cast<unsigned>(random.uniform(0, 7.99));
      for (V3f& beyond : t.beyond)
        beyond = collision::direction(t.normal + random_vector(random, 1), t.normal);
    }
    batch.put(lane, t);
  }
  return count;
}

collision::SurfaceFrame random_frame(Random& random) {
  return {random_vector(random, 0.5), core::to_matrix(core::to_float(random.rotation()))};
}

template <std::size_t Rows>
bool same_lanes(const float (&a)[Rows][TriangleBatch::kSize],
                const float (&b)[Rows][TriangleBatch::kSize], unsigned lanes) {
  for (std::size_t row = 0; row < Rows; ++row)
    for (unsigned lane = 0; lane < TriangleBatch::kSize; ++lane)
      if ((lanes >> lane & 1) && std::memcmp(&a[row][lane], &b[row][lane], sizeof(float)) != 0)
        return false;
  return true;
}
bool same_lanes(const float (&a)[TriangleBatch::kSize], const float (&b)[TriangleBatch::kSize],
                unsigned lanes) {
  for (unsigned lane = 0; lane < TriangleBatch::kSize; ++lane)
    if ((lanes >> lane & 1) && std::memcmp(&a[lane], &b[lane], sizeof(float)) != 0) return false;
  return true;
}

// A box or a random hull in a random place, ready to be searched.
class Polytope {
 public:
  Polytope(Random& random, bool box) {
    ConvexHull points;
    for (int i = 0; i < 12; ++i) points.points.push_back(random.uniform(0.3, 0.6) * random.unit());
    for (int i = 0; i < 3; ++i)
      for (const double sign : {-0.3, 0.3}) points.points.push_back(sign * Vec3::Unit(i));
    hull_ = collision::build_hull(points.points);
    collider_.type = box ? core::ShapeType::box : core::ShapeType::hull;
    collider_.size = {0.4f, 0.5f, 0.3f};
    collider_.hull = hull_.get();
    placed.collider = &collider_;
    placed.center = random_vector(random, 0.3);
    placed.axes = core::to_matrix(core::to_float(random.rotation()));
    collision::prepare_search(placed, 0.05f, rows_, search);
  }
  collision::PlacedShape placed;
  collision::TriangleSearch search;

 private:
  std::shared_ptr<const core::HullGeometry> hull_;
  core::Collider collider_;
  collision::BoxLanes rows_;
};

constexpr collision::ClipQuery kClipQuery{{0.1f, -0.2f, 0.3f}, {1, 2, -1}, 0.016f, 0.05f};

// The face that the first of some triangles takes, and those that take the same.
struct FaceToClip {
  collision::ClipFace clip;
  unsigned lanes = 0;

  FaceToClip(const Polytope& polytope, unsigned near, const TriangleAxes& axes) {
    if (near == 0) return;
    const float facing = axes.facing[std::countr_zero(near)];
    for (int lane = 0; lane < TriangleBatch::kSize; ++lane)
      if ((near >> lane & 1) && axes.facing[lane] == facing) lanes |= 1u << lane;
    const auto face = static_cast<std::uint32_t>(facing);
    collision::clip_face(polytope.placed, face, polytope.search.face_normals[face], clip);
  }
  int candidates() const { return TriangleClips::kCorners + static_cast<int>(clip.count); }
};

int count_points(const TriangleClips& clips, const FaceToClip& face) {
  int count = 0;
  for (int i = 0; face.lanes != 0 && i < face.candidates(); ++i)
    count += std::popcount(clips.valid[i]);
  return count;
}

bool same_clips(const TriangleClips& a, const TriangleClips& b, int candidates) {
  for (int i = 0; i < candidates; ++i) {
    const auto &of_a = a.candidates[i], &of_b = b.candidates[i];
    if (a.valid[i] != b.valid[i] || !same_lanes(a.normal, b.normal, a.valid[i]) ||
        !same_lanes(of_a.position, of_b.position, a.valid[i]) ||
        !same_lanes(of_a.separation, of_b.separation, a.valid[i]) ||
        !same_lanes(of_a.side, of_b.side, a.valid[i]))
      return false;
  }
  return true;
}

TEST(TriangleBatch, every_width_gives_the_bits_of_the_float_reference) {
  Random random(21);
  int near_polytopes = 0, near_spheres = 0, points = 0;
  for (int i = 0; i < 2000; ++i) {
    TriangleBatch local;
    const int count = random_triangles(random, local);
    const collision::SurfaceFrame frame = random_frame(random);
    const Polytope polytope(random, i % 2 == 0);
    const V3f center = random_vector(random, 0.5);
    TriangleBatch batch = local;
    TriangleAxes axes;
    TriangleTouches touches;
    TriangleClips clips;
    const unsigned all = (1u << count) - 1;
    const unsigned front = place_triangles_reference(frame, center, count, batch);
    const unsigned near = search_triangles_reference(polytope.search, count, batch, axes);
    const unsigned touched = touch_triangles_reference(center, 0.4f, count, batch, touches);
    ASSERT_EQ(axes.by_edges & ~near, 0u);
    const FaceToClip face(polytope, near & ~axes.by_edges, axes);
    clip_triangles_reference(face.clip, kClipQuery, face.lanes, batch, axes, clips);
    points += count_points(clips, face);
    near_polytopes += std::popcount(near);
    near_spheres += std::popcount(touched);
    on_every_instruction_set([&](const std::string& name) {
      TriangleBatch wide = local;
      TriangleAxes wide_axes;
      TriangleTouches wide_touches;
      TriangleClips wide_clips;
      ASSERT_EQ(place_triangles(frame, center, count, wide), front) << name;
      ASSERT_TRUE(same_lanes(batch.rows, wide.rows, all)) << name;
      ASSERT_EQ(search_triangles(polytope.search, count, wide, wide_axes), near) << name;
      ASSERT_TRUE(same_lanes(axes.face_a, wide_axes.face_a, near)) << name;
      ASSERT_TRUE(same_lanes(axes.face_a_index, wide_axes.face_a_index, near)) << name;
      ASSERT_TRUE(same_lanes(axes.face_b, wide_axes.face_b, near)) << name;
      ASSERT_TRUE(same_lanes(axes.edges, wide_axes.edges, near)) << name;
      ASSERT_TRUE(same_lanes(axes.edges_index, wide_axes.edges_index, near)) << name;
      ASSERT_EQ(axes.by_edges, wide_axes.by_edges) << name;
      ASSERT_TRUE(same_lanes(axes.of_b, wide_axes.of_b, near)) << name;
      ASSERT_TRUE(same_lanes(axes.facing, wide_axes.facing, near)) << name;
      clip_triangles(face.clip, kClipQuery, face.lanes, wide, wide_axes, wide_clips);
      ASSERT_TRUE(face.lanes == 0 || same_clips(clips, wide_clips, face.candidates())) << name;
      ASSERT_EQ(touch_triangles(center, 0.4f, count, wide, wide_touches), touched) << name;
      ASSERT_TRUE(same_lanes(touches.out, wide_touches.out, touched)) << name;
      ASSERT_TRUE(same_lanes(touches.distance, wide_touches.distance, touched)) << name;
    });
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(near_polytopes, 1000);
  EXPECT_GT(near_spheres, 1000);
  EXPECT_GT(points, 1000);
}

constexpr int kOfCapsule = TriangleClips::kNearest + 1;

collision::CapsuleAxis random_capsule(Random& random) {
  return {random_vector(random, 0.5), random_vector(random, 1), 0.3f};
}
collision::CappedShape random_capped(Random& random, bool pointed) {
  return {random_vector(random, 0.3), core::to_matrix(core::to_float(random.rotation())), 0.5f,
          0.4f, pointed};
}
// A triangle to stand on: under the shape's middle, level up to 25 degrees with its axis.
void level_triangle(Random& random, const collision::CappedShape& shape, TriangleBatch& batch,
                    int lane) {
  collision::SurfaceTriangle t;
  const auto gap = static_cast<float>(random.uniform(-0.1, 0.1));
  const V3f below = shape.center - shape.axes.c1 * (shape.half_height + gap);
  const auto corner = [&](float x, float z) {
    return below + shape.axes.c0 * x + shape.axes.c2 * z + random_vector(random, 0.1);
  };
  t.corner[0] = corner(-0.2f, -0.2f);
  t.corner[1] = corner(0.1f, 0.3f);
  t.corner[2] = corner(0.4f, -0.1f);
  t.normal = collision::direction(core::cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]),
                                  {0, 1, 0});
  t.touchable = static_cast<unsigned>(random.uniform(0, 7.99));
  for (V3f& beyond : t.beyond)
    beyond = collision::direction(t.normal + random_vector(random, 1), t.normal);
  batch.put(lane, t);
}

TEST(TriangleBatch, every_width_gives_the_bits_of_the_float_reference_for_round_shapes) {
  Random random(25);
  int points = 0, flat = 0, parted = 0;
  for (int i = 0; i < 2000; ++i) {
    TriangleBatch batch;
    const int count = random_triangles(random, batch);
    const unsigned front =
        collision::place_triangles(random_frame(random), {0, 0, 0}, count, batch);
    const collision::CapsuleAxis capsule = random_capsule(random);
    const collision::CappedShape capped = random_capped(random, i % 2 == 0);
    TriangleBatch ground = batch;
    for (int lane = 0; lane < count; lane += 2) level_triangle(random, capped, ground, lane);
    TriangleClips clips;
    TriangleAxes axes;
    touch_triangles_reference(capsule, 0.05f, kClipQuery, front, batch, clips);
    const collision::CapLanes cap = cap_triangles_reference(capped, 0.02f, front, ground, axes);
    ASSERT_EQ(cap.flat & ~cap.near, 0u);
    for (int c = 0; c < kOfCapsule; ++c) points += std::popcount(clips.valid[c]);
    flat += std::popcount(cap.flat);
    parted += std::popcount(front & ~cap.near);
    on_every_instruction_set([&](const std::string& name) {
      TriangleClips wide_clips;
      TriangleAxes wide_axes;
      touch_triangles(capsule, 0.05f, kClipQuery, front, batch, wide_clips);
      ASSERT_TRUE(same_clips(clips, wide_clips, kOfCapsule)) << name;
      const collision::CapLanes wide = cap_triangles(capped, 0.02f, front, ground, wide_axes);
      ASSERT_EQ(wide.near, cap.near) << name;
      ASSERT_EQ(wide.flat, cap.flat) << name;
      ASSERT_TRUE(same_lanes(axes.of_b, wide_axes.of_b, cap.flat)) << name;
      ASSERT_TRUE(same_lanes(axes.facing, wide_axes.facing, cap.flat)) << name;
    });
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(points, 1000);
  EXPECT_GT(flat, 500);
  EXPECT_GT(parted, 100);
}

Vec3 corner_of(const TriangleBatch& batch, int lane, int i) {
  const int row = TriangleBatch::kCorner + 3 * i;
  return {double(batch.rows[row][lane]), double(batch.rows[row + 1][lane]),
          double(batch.rows[row + 2][lane])};
}
Vec3 normal_of(const TriangleBatch& batch, int lane) {
  return {double(batch.rows[TriangleBatch::kNormal][lane]),
          double(batch.rows[TriangleBatch::kNormal + 1][lane]),
          double(batch.rows[TriangleBatch::kNormal + 2][lane])};
}

// How far a polytope's vertices reach along a direction, in the pair's frame.
double reach(const Polytope& polytope, const Vec3& along) {
  const collision::PolytopeLanes& a = polytope.search.a;
  double most = -1e30;
  for (std::uint32_t i = 0; i < a.vertex_count; ++i) {
    const V3f v{a.vertices[i], a.vertices[a.vertex_stride + i],
                a.vertices[2 * a.vertex_stride + i]};
    most = std::max(most,
                    along.dot(core::to_double(polytope.placed.center + polytope.placed.axes * v)));
  }
  return most;
}
// Of the triangle from the polytope along a direction.
double separation(const Polytope& polytope, const TriangleBatch& batch, int lane,
                  const Vec3& along) {
  double least = 1e30;
  for (int i = 0; i < 3; ++i) least = std::min(least, along.dot(corner_of(batch, lane, i)));
  return least - reach(polytope, along);
}

TEST(TriangleBatch, a_polytopes_axes_have_the_separations_told) {
  Random random(22);
  int faces = 0, edges = 0;
  for (int i = 0; i < 1500; ++i) {
    TriangleBatch batch;
    const int count = random_triangles(random, batch);
    const Polytope polytope(random, i % 2 == 0);
    collision::place_triangles(random_frame(random), {0, 0, 0}, count, batch);
    TriangleAxes axes;
    for (unsigned near = search_triangles(polytope.search, count, batch, axes); near != 0;
         near &= near - 1) {
      const int lane = std::countr_zero(near);
      const auto at = static_cast<std::size_t>(lane);
      ASSERT_NEAR(double(axes.face_b[at]),
                  separation(polytope, batch, lane, -normal_of(batch, lane)), 1e-5);
      if (axes.face_a[at] > -1e30f) {
        ++faces;
        const auto face = static_cast<std::uint32_t>(axes.face_a_index[at]);
        const Vec3 normal = core::to_double(polytope.search.face_normals[face]);
        ASSERT_NEAR(double(axes.face_a[at]), separation(polytope, batch, lane, normal), 1e-5);
      }
      if (axes.edges[at] > -1e30f) {
        ++edges;
        const auto pair = static_cast<std::uint32_t>(axes.edges_index[at]);
        const int e = static_cast<int>(pair % 3);
        ASSERT_GT(batch.rows[TriangleBatch::kTouchable + e][lane], 0);
        const Vec3 along = corner_of(batch, lane, (e + 1) % 3) - corner_of(batch, lane, e);
        const Vec3 cross =
            core::to_double(polytope.search.edges[pair / 3].along).cross(along).normalized();
        const double told = double(axes.edges[at]);
        // The axis' supporting plane of the polytope holds its edge; the triangle's edge may stop
        // short of the plane of a neighbour that this test does not have.
        const Vec3 tail = core::to_double(polytope.search.edges[pair / 3].tail);
        const double gap = std::abs(cross.dot(corner_of(batch, lane, e) - tail));
        ASSERT_NEAR(std::abs(told), gap, 1e-4);
      }
    }
  }
  EXPECT_GT(faces, 1000);
  EXPECT_GT(edges, 200);
}

// Where a face and a triangle lie over each other: every point halfway between the two planes along the
// contact's normal, as far apart as told, over the triangle and over the face.
TEST(TriangleBatch, clipped_points_lie_between_the_face_and_the_triangle) {
  Random random(24);
  int points = 0;
  for (int i = 0; i < 1500; ++i) {
    TriangleBatch batch;
    const int count = random_triangles(random, batch);
    const Polytope polytope(random, i % 2 == 0);
    collision::place_triangles(random_frame(random), {0, 0, 0}, count, batch);
    TriangleAxes axes;
    const unsigned near = search_triangles(polytope.search, count, batch, axes);
    const FaceToClip face(polytope, near & ~axes.by_edges, axes);
    if (face.lanes == 0) continue;
    TriangleClips clips;
    clip_triangles(face.clip, {{0, 0, 0}, {0, 0, 0}, 0, 10}, face.lanes, batch, axes, clips);
    const Vec3 face_normal = core::to_double(face.clip.normal);
    const Vec3 on_face = core::to_double(face.clip.corners[0]);
    for (int c = 0; c < face.candidates(); ++c)
      for (unsigned lanes = clips.valid[c]; lanes != 0; lanes &= lanes - 1) {
        const int lane = std::countr_zero(lanes);
        const auto& from = clips.candidates[c];
        const auto value = [&](const float(&row)[TriangleBatch::kSize]) {
          return double(row[lane]);
        };
        const Vec3 normal(value(clips.normal[0]), value(clips.normal[1]), value(clips.normal[2]));
        const Vec3 middle(value(from.position[0]), value(from.position[1]),
                          value(from.position[2]));
        const double separation = value(from.separation);
        const Vec3 of_face = middle - 0.5 * separation * normal;
        const Vec3 of_triangle = middle + 0.5 * separation * normal;
        if (normal.dot(face_normal) < 0.2 || normal.dot(-normal_of(batch, lane)) < 0.2) continue;
        ++points;
        ASSERT_NEAR(face_normal.dot(of_face - on_face), 0, 2e-5);
        ASSERT_NEAR(normal_of(batch, lane).dot(of_triangle - corner_of(batch, lane, 0)), 0, 2e-5);
        for (std::uint32_t k = 0; k < face.clip.count; ++k) {
          const Vec3 tail = core::to_double(face.clip.corners[k]);
          const Vec3 head = core::to_double(face.clip.corners[(k + 1) % face.clip.count]);
          const Vec3 out = (head - tail).cross(face_normal).normalized();
          ASSERT_LT(out.dot(of_face - tail), 3e-3);
        }
        for (int k = 0; k < 3; ++k) {
          const Vec3 tail = corner_of(batch, lane, k), head = corner_of(batch, lane, (k + 1) % 3);
          const Vec3 out = (head - tail).cross(normal_of(batch, lane)).normalized();
          ASSERT_LT(out.dot(of_triangle - tail), 2e-2 * (1 + std::abs(separation)));
        }
      }
  }
  EXPECT_GT(points, 2000);
}

double segment_distance(const Vec3& a, const Vec3& b, const Vec3& p) {
  const Vec3 along = b - a;
  return (p - a - along * std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0)).norm();
}
// In double, by barycentric coordinates of the foot on the plane; else by the three edges.
double triangle_distance(const TriangleBatch& batch, int lane, const Vec3& p) {
  const Vec3 a = corner_of(batch, lane, 0), b = corner_of(batch, lane, 1),
             c = corner_of(batch, lane, 2);
  const Vec3 u = b - a, v = c - a, w = p - a, n = u.cross(v);
  const double s = w.cross(v).dot(n) / n.squaredNorm(), t = u.cross(w).dot(n) / n.squaredNorm();
  if (s >= 0 && t >= 0 && s + t <= 1) return std::abs(w.dot(n)) / n.norm();
  return std::min(
      {segment_distance(a, b, p), segment_distance(b, c, p), segment_distance(c, a, p)});
}

TEST(TriangleBatch, a_spheres_distance_is_that_of_the_nearest_point) {
  Random random(23);
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    TriangleBatch batch;
    const int count = random_triangles(random, batch);
    const V3f center = random_vector(random, 0.5);
    collision::place_triangles(random_frame(random), center, count, batch);
    TriangleTouches touches;
    for (unsigned near = touch_triangles(center, 0.5f, count, batch, touches); near != 0;
         near &= near - 1) {
      const int lane = std::countr_zero(near);
      ++hits;
      const double distance = double(touches.distance[lane]);
      ASSERT_NEAR(distance, triangle_distance(batch, lane, core::to_double(center)), 1e-5);
      const Vec3 out{double(touches.out[0][lane]), double(touches.out[1][lane]),
                     double(touches.out[2][lane])};
      ASSERT_NEAR(out.norm(), 1, 1e-5);
      ASSERT_GE(out.dot(normal_of(batch, lane)), 0);
      ASSERT_NEAR(triangle_distance(batch, lane, core::to_double(center) - distance * out), 0,
                  1e-3);
    }
  }
  EXPECT_GT(hits, 1000);
}

// Of the nearest points of a triangle and a capsule's axis, by a search along the axis: the distance of
// a point of it from the triangle is convex.
double axis_distance(const TriangleBatch& batch, int lane, const collision::CapsuleAxis& capsule) {
  const Vec3 tail = core::to_double(capsule.tail), along = core::to_double(capsule.along);
  const auto at = [&](double part) { return triangle_distance(batch, lane, tail + part * along); };
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (at(a) < at(b) ? high : low) = at(a) < at(b) ? b : a;
  }
  return at(low);
}

// Every point of a capsule's contact lies halfway between the capsule and the triangle along the normal;
// beside the face the deepest one tells the distance, and over the face none is told but of its plane.
TEST(TriangleBatch, a_capsules_points_lie_between_its_surface_and_the_triangle) {
  Random random(26);
  int on_faces = 0, on_edges = 0;
  for (int i = 0; i < 4000; ++i) {
    TriangleBatch batch;
    const int count = random_triangles(random, batch);
    const unsigned front =
        collision::place_triangles(random_frame(random), {0, 0, 0}, count, batch);
    const collision::CapsuleAxis capsule = random_capsule(random);
    TriangleClips clips;
    touch_triangles(capsule, 10, {{0, 0, 0}, {0, 0, 0}, 0, 10}, front, batch, clips);
    for (int c = 0; c < kOfCapsule; ++c)
      for (unsigned lanes = clips.valid[c]; lanes != 0; lanes &= lanes - 1) {
        const int lane = std::countr_zero(lanes);
        const auto value = [&](const float(&row)[TriangleBatch::kSize]) {
          return double(row[lane]);
        };
        const Vec3 up(-value(clips.normal[0]), -value(clips.normal[1]), -value(clips.normal[2]));
        const auto& from = clips.candidates[c];
        const Vec3 middle(value(from.position[0]), value(from.position[1]),
                          value(from.position[2]));
        const double separation = value(from.separation);
        const Vec3 of_triangle = middle - 0.5 * separation * up;
        const Vec3 of_axis = middle + (0.5 * separation + double(capsule.radius)) * up;
        ASSERT_NEAR(up.norm(), 1, 1e-5);
        ASSERT_NEAR(segment_distance(core::to_double(capsule.tail),
                                     core::to_double(capsule.tail + capsule.along), of_axis),
                    0, 1e-5);
        ASSERT_NEAR(triangle_distance(batch, lane, of_triangle), 0, 1e-4);
        if (c == TriangleClips::kNearest) {
          ++on_edges;
          ASSERT_NEAR(separation + double(capsule.radius), axis_distance(batch, lane, capsule),
                      1e-4);
        } else {
          ++on_faces;
          ASSERT_NEAR(up.dot(normal_of(batch, lane)), 1, 1e-5);
        }
      }
  }
  EXPECT_GT(on_faces, 1000);
  EXPECT_GT(on_edges, 1000);
}

}  // namespace
}  // namespace skerry::test
