#include "collision/bounds.h"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "collision/geometry_build.h"

namespace skerry::collision {
namespace {

using core::Collider;
using core::ShapeType;

struct Case {
  std::string name;
  Collider collider;
  // Point of the shape that lies farthest along a direction, in the shape's frame.
  std::function<Vec3(const Vec3&)> support;
};

Vec3 flat_unit(const Vec3& d) {
  const Vec3 flat(d.x(), 0, d.z());
  return flat.norm() > 1e-12 ? Vec3(flat.normalized()) : Vec3(0, 0, 0);
}

Collider of_type(ShapeType type, float x, float y, float z) {
  Collider collider;
  collider.type = type;
  collider.size = {x, y, z};
  return collider;
}

// Triangles that lie anyhow.
std::shared_ptr<const core::MeshGeometry> triangle_soup(std::uint32_t count) {
  std::mt19937 random(20);
  std::normal_distribution<double> normal;
  MeshData data;
  for (std::uint32_t i = 0; i < 3 * count; ++i)
    data.vertices.push_back(Vec3{normal(random), normal(random), normal(random)});
  for (std::uint32_t t = 0; t < count; ++t) data.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  return build_mesh(data, {1, 1, 1});
}

std::vector<Case> solids() {
  static std::vector<std::shared_ptr<const core::HullGeometry>> hulls;
  static std::vector<std::shared_ptr<const core::MeshGeometry>> meshes;
  const double r = 0.25, h = 0.75;
  std::vector<Case> cases;
  cases.push_back({"sphere", of_type(ShapeType::sphere, 0.25f, 0, 0),
                   [=](const Vec3& d) { return Vec3(d.normalized() * r); }});
  cases.push_back({"capsule", of_type(ShapeType::capsule, 0.25f, 0.75f, 0), [=](const Vec3& d) {
                     return Vec3(d.normalized() * r + Vec3(0, d.y() > 0 ? h : -h, 0));
                   }});
  cases.push_back({"box", of_type(ShapeType::box, 0.25f, 0.5f, 0.75f), [](const Vec3& d) {
                     return Vec3(std::copysign(0.25, d.x()), std::copysign(0.5, d.y()),
                                 std::copysign(0.75, d.z()));
                   }});
  cases.push_back({"cylinder", of_type(ShapeType::cylinder, 0.25f, 0.75f, 0), [=](const Vec3& d) {
                     return Vec3(flat_unit(d) * r + Vec3(0, d.y() > 0 ? h : -h, 0));
                   }});
  cases.push_back({"cone", of_type(ShapeType::cone, 0.25f, 0.75f, 0), [=](const Vec3& d) {
                     const Vec3 apex(0, h, 0), rim = flat_unit(d) * r - apex;
                     return d.dot(apex) > d.dot(rim) ? apex : rim;
                   }});
  cases.push_back(
      {"ellipsoid", of_type(ShapeType::ellipsoid, 0.25f, 0.5f, 0.75f), [](const Vec3& d) {
         const Vec3 s(0.25, 0.5, 0.75);
         const Vec3 scaled = d.cwiseProduct(s);
         return Vec3(scaled.cwiseProduct(s) / scaled.norm());
       }});
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 0.5, 0}, {0, 0, 0.25}};
  const auto farthest = [points](const Vec3& d) {
    return *std::max_element(points.begin(), points.end(),
                             [&](const Vec3& a, const Vec3& b) { return a.dot(d) < b.dot(d); });
  };
  hulls.push_back(build_hull(points));
  Collider hull = of_type(ShapeType::hull, 0, 0, 0);
  hull.hull = hulls.back().get();
  cases.push_back({"hull", hull, farthest});
  meshes.push_back(build_mesh({points, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}}, {1, 1, 1}));
  Collider mesh = of_type(ShapeType::mesh, 0, 0, 0);
  mesh.mesh = meshes.back().get();
  cases.push_back({"mesh", mesh, farthest});
  mesh.mesh = meshes.emplace_back(triangle_soup(1500)).get();
  cases.push_back({"soup", mesh, [soup = mesh.mesh](const Vec3& d) {
                     Vec3 best = core::to_double(soup->vertices[0]);
                     for (const core::V3f& vertex : soup->vertices)
                       if (core::to_double(vertex).dot(d) > best.dot(d))
                         best = core::to_double(vertex);
                     return best;
                   }});
  return cases;
}

Quat random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Quat{normal(random), normal(random), normal(random), normal(random)}.normalized();
}

// Support along +-axis from the shape's own support function, in double.
void expect_tight(const Case& item, const core::BodyPose& pose) {
  const Collider& c = item.collider;
  const Quat local(double(c.local_rotation.w), double(c.local_rotation.x),
                   double(c.local_rotation.y), double(c.local_rotation.z));
  const Mat3 axes = pose.orientation.toRotationMatrix() * local.toRotationMatrix();
  const Vec3 origin =
      pose.center + pose.orientation.toRotationMatrix() * core::to_double(c.local_position);
  const Aabb box = tight_bounds(c, pose);
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 direction = axes.transpose() * (sign * Vec3::Unit(axis));
      const double reach = (origin + axes * item.support(direction))[axis];
      const double bound = sign > 0 ? double(box.max[axis]) : double(box.min[axis]);
      const double ulp = std::abs(reach) * 0x1p-22 + 1e-7;
      // A local rotation is in float: unit to 1e-7 only.
      const double skew = c.has_local_rotation ? 1e-6 : 0;
      EXPECT_GE(sign * (bound - reach), -1e-12 * std::abs(reach) - skew)
          << item.name << " axis " << axis;
      EXPECT_LE(sign * (bound - reach), ulp + skew) << item.name << " axis " << axis;
    }
}

TEST(TightBounds, touch_the_support_points_of_every_shape_from_outside) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> uniform(-5, 5);
  for (Case& item : solids())
    for (int i = 0; i < 200; ++i) {
      if (i % 3 == 1) {
        item.collider.local_position = {0.5f, -0.25f, 1};
        item.collider.local_rotation = core::to_float(random_rotation(random));
        item.collider.has_local_rotation = true;
      }
      // Rows 0: axis-aligned; then any pose, every other one 1000 km away.
      const double far = i % 2 ? 1e6 : 0;
      const Quat turn = i == 0 ? Quat(1, 0, 0, 0) : random_rotation(random);
      expect_tight(item, {{far + uniform(random), uniform(random) - far, uniform(random)}, turn});
    }
}

TEST(TightBounds, hold_random_points_of_the_surface) {
  std::mt19937 random(22);
  std::normal_distribution<double> normal;
  for (const Case& item : solids())
    for (int i = 0; i < 50; ++i) {
      const core::BodyPose pose{Vec3::Random() * 1e5, random_rotation(random)};
      const Aabb box = tight_bounds(item.collider, pose);
      for (int k = 0; k < 100; ++k) {
        const Vec3 point =
            pose.center +
            pose.orientation * item.support(Vec3{normal(random), normal(random), normal(random)});
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_LE(double(box.min[axis]), point[axis]);
          EXPECT_GE(double(box.max[axis]), point[axis]);
        }
      }
    }
}

TEST(TightBounds, plane_along_an_axis_is_a_half_space_and_else_boundless) {
  Collider plane = of_type(ShapeType::plane, 0, 1, 0);
  plane.plane_offset = 0.5;
  Aabb box = tight_bounds(plane, {Vec3(1, 2, 3), Quat::Identity()});
  EXPECT_NEAR(box.max[1], 2.5, 1e-6);
  EXPECT_GE(box.max[1], 2.5f);
  EXPECT_EQ(box.min[1], -3e38f);
  EXPECT_EQ(box.max[0], 3e38f);
  plane.size = {0, 0, -1};
  box = tight_bounds(plane, {Vec3(1, 2, 3), Quat::Identity()});
  EXPECT_NEAR(box.min[2], 2.5, 1e-6);
  EXPECT_EQ(box.max[2], 3e38f);
  plane.size = {0.6f, 0.8f, 0};
  box = tight_bounds(plane, {Vec3(1, 2, 3), Quat::Identity()});
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(box.min[axis], -3e38f);
    EXPECT_EQ(box.max[axis], 3e38f);
  }
}

TEST(TightBounds, stay_finite_however_far) {
  for (const Case& item : solids()) {
    const Aabb box = tight_bounds(item.collider, {Vec3(1e200, -1e40, 0), Quat::Identity()});
    for (int axis = 0; axis < 3; ++axis) EXPECT_TRUE(std::isfinite(box.min[axis] + box.max[axis]));
  }
}

}  // namespace
}  // namespace skerry::collision
