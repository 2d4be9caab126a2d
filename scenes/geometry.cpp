#include "scenes/geometry.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "scenes/rigid_maths.h"

namespace skerry::scenes {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Faces of icosahedron(), counter-clockwise from outside.
std::vector<Triangle> icosahedron_faces(const std::vector<Vec3>& corners) {
  const double edge = (corners[0] - corners[1]).norm();
  const auto near = [&](std::size_t a, std::size_t b) {
    return (corners[a] - corners[b]).norm() < 1.1 * edge;
  };
  std::vector<Triangle> faces;
  for (std::uint32_t a = 0; a < 12; ++a) {
    for (std::uint32_t b = a + 1; b < 12; ++b) {
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        if (!near(a, b) || !near(b, c) || !near(a, c)) continue;
        const Vec3 normal = (corners[b] - corners[a]).cross(corners[c] - corners[a]);
        faces.push_back(normal.dot(corners[a]) > 0 ? Triangle{a, b, c} : Triangle{a, c, b});
      }
    }
  }
  return faces;
}

class Splitter {
 public:
  Splitter(MeshData& mesh, double radius) : mesh_(mesh), radius_(radius) {}

  void split() {
    std::vector<Triangle> old;
    old.swap(mesh_.triangles);
    for (const auto& [a, b, c] : old) {
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      for (const Triangle& part :
           {Triangle{a, ab, ca}, Triangle{b, bc, ab}, Triangle{c, ca, bc}, Triangle{ab, bc, ca}}) {
        mesh_.triangles.push_back(part);
      }
    }
  }

 private:
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
    const auto [found, fresh] = middles_.try_emplace(std::minmax(a, b), next);
    if (fresh) {
      const Vec3 point = mesh_.vertices[a] + mesh_.vertices[b];
      mesh_.vertices.push_back(point * (radius_ / point.norm()));
    }
    return found->second;
  }

  MeshData& mesh_;
  double radius_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles_;
};

double ground_height(double x, double z, double half, double wave_height, double rim_height) {
  const double waves = sin_cos(2 * kPi * x / 9).sin * sin_cos(2 * kPi * z / 7 + 0.5).cos;
  const double out = std::max(std::abs(x), std::abs(z)) / half;
  const double rim = std::max(0.0, (out - 0.7) / 0.3);
  return wave_height * waves + rim_height * rim * rim;
}

}  // namespace

std::vector<Vec3> icosahedron(double circumradius) {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  const double scale = circumradius / std::sqrt(1 + golden * golden);
  std::vector<Vec3> corners;
  for (const double s : {-1.0, 1.0}) {
    for (const double t : {-1.0, 1.0}) {
      const double one = s * scale;
      const double phi = t * golden * scale;
      corners.emplace_back(0, one, phi);
      corners.emplace_back(one, phi, 0);
      corners.emplace_back(phi, 0, one);
    }
  }
  return corners;
}

MeshData ball_mesh(double radius, int splits) {
  MeshData mesh;
  mesh.vertices = icosahedron(radius);
  // Corners 0 and 1 lie on one edge (dot product of neighbours is positive).
  mesh.triangles = icosahedron_faces(mesh.vertices);
  Splitter splitter(mesh, radius);
  for (int i = 0; i < splits; ++i) splitter.split();
  return mesh;
}

MeshData wavy_ground(int cells, double width, double wave_height, double rim_height) {
  MeshData mesh;
  const double half = width / 2;
  const auto row = static_cast<std::uint32_t>(cells + 1);
  for (int k = 0; k <= cells; ++k) {
    for (int i = 0; i <= cells; ++i) {
      const double x = -half + width * i / cells;
      const double z = -half + width * k / cells;
      mesh.vertices.emplace_back(x, ground_height(x, z, half, wave_height, rim_height), z);
    }
  }
  for (std::uint32_t k = 0; k + 1 < row; ++k) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t at = k * row + i;
      mesh.triangles.push_back({at, at + row, at + 1});
      mesh.triangles.push_back({at + 1, at + row, at + row + 1});
    }
  }
  return mesh;
}

MeshData torus_mesh(double ring_radius, double tube_radius, int ring_segments, int tube_segments) {
  MeshData mesh;
  for (int i = 0; i < ring_segments; ++i) {
    const SinCos ring = sin_cos(2 * kPi * i / ring_segments);
    for (int k = 0; k < tube_segments; ++k) {
      const SinCos tube = sin_cos(2 * kPi * k / tube_segments);
      const double out = ring_radius + tube_radius * tube.cos;
      mesh.vertices.emplace_back(out * ring.cos, out * ring.sin, tube_radius * tube.sin);
    }
  }
  const auto at = [&](int i, int k) {
    return static_cast<std::uint32_t>(i % ring_segments * tube_segments + k % tube_segments);
  };
  for (int i = 0; i < ring_segments; ++i) {
    for (int k = 0; k < tube_segments; ++k) {
      mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return mesh;
}

}  // namespace skerry::scenes
