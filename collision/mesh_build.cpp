// build_mesh and solid_defect.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "collision/box_tree_build.h"
#include "collision/geometry_build.h"
#include "collision/mesh_tree.h"
#include "collision/narrowphase_kernels.h"

namespace skerry::collision {
namespace {

using core::kNone;
using core::MeshGeometry;
using core::V3f;
using std::uint32_t;
using Corners = std::array<uint32_t, 3>;

// Triangles lower than this, relative to their longest edge, are left out: their normal is noise.
constexpr double kDegenerate = 1e-7;

// [vertex] lowest vertex at the same place. Corners soups (STL) share no vertices.
template <class Vertices, class Coordinates>
std::vector<uint32_t> weld(const Vertices& vertices, const Coordinates& coordinates) {
  std::vector<uint32_t> order(vertices.size());
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    const auto pa = coordinates(vertices[a]), pb = coordinates(vertices[b]);
    return pa != pb ? pa < pb : a < b;
  });
  std::vector<uint32_t> welded(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    welded[order[i]] =
        i > 0 && coordinates(vertices[order[i]]) == coordinates(vertices[order[i - 1]])
            ? welded[order[i - 1]]
            : order[i];
  return welded;
}

// An edge of a triangle, by its welded vertices.
struct TriangleEdge {
  uint32_t low, high;
  uint32_t triangle;
  std::uint8_t edge;
  bool forward;  // from low to high in its triangle
  bool same_edge(const TriangleEdge& other) const { return low == other.low && high == other.high; }
};

// Sorted by vertices, then triangle. Triangles with two equal corners have no edges.
std::vector<TriangleEdge> triangle_edges(const std::vector<Corners>& triangles,
                                         const std::vector<uint32_t>& welded) {
  std::vector<TriangleEdge> edges;
  edges.reserve(3 * triangles.size());
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    const uint32_t v[3] = {welded[triangles[t][0]], welded[triangles[t][1]],
                           welded[triangles[t][2]]};
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
    for (std::uint8_t e = 0; e < 3; ++e) {
      const uint32_t tail = v[e], head = v[(e + 1) % 3];
      edges.push_back({std::min(tail, head), std::max(tail, head), t, e, tail < head});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const TriangleEdge& a, const TriangleEdge& b) {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    return a.triangle < b.triangle;
  });
  return edges;
}

// Calls group(first, count) for the edges of each pair of vertices.
template <class Group>
void for_each_edge(const std::vector<TriangleEdge>& edges, const Group& group) {
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first + 1;
    while (last < edges.size() && edges[last].same_edge(edges[first])) ++last;
    group(first, last - first);
    first = last;
  }
}

// What is wrong with the indices and numbers; empty if nothing.
std::string input_defect(const MeshData& mesh) {
  if (mesh.triangles.empty()) return "the mesh has no triangles";
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].cast<float>().allFinite())
      return "vertex " + std::to_string(i) + " of the mesh is not finite";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t])
      if (vertex >= mesh.vertices.size())
        return "triangle " + std::to_string(t) + " of the mesh names vertex " +
               std::to_string(vertex) + " of " + std::to_string(mesh.vertices.size());
  if (mesh.triangles.size() >= BoxNode::kItem) return "the mesh has too many triangles";
  return {};
}

Vec3 corner(const MeshGeometry& mesh, uint32_t triangle, unsigned i) {
  return core::to_double(mesh.vertices[mesh.triangles[triangle][i % 3]]);
}
Vec3 area_vector(const MeshGeometry& mesh, uint32_t t) {
  return (corner(mesh, t, 1) - corner(mesh, t, 0)).cross(corner(mesh, t, 2) - corner(mesh, t, 0));
}

bool degenerate(const MeshGeometry& mesh, uint32_t t) {
  double longest = 0;  // squared
  for (unsigned i = 0; i < 3; ++i)
    longest = std::max(longest, (corner(mesh, t, i + 1) - corner(mesh, t, i)).squaredNorm());
  return area_vector(mesh, t).norm() <= kDegenerate * longest;
}

void set_triangles(MeshGeometry& mesh, const MeshData& data, const Vec3& scale) {
  for (const Vec3& vertex : data.vertices) {
    const Vec3 scaled = vertex.cwiseProduct(scale) + Vec3::Zero();  // -0 becomes +0
    mesh.vertices.push_back(core::to_float(scaled));
  }
  const bool mirrored = scale.prod() < 0;
  uint32_t source = 0;
  for (Corners triangle : data.triangles) {
    if (mirrored) std::swap(triangle[1], triangle[2]);
    mesh.triangles.push_back(triangle);
    mesh.source.push_back(source++);
    if (!degenerate(mesh, static_cast<uint32_t>(mesh.triangles.size() - 1))) continue;
    mesh.triangles.pop_back();
    mesh.source.pop_back();
  }
  if (mesh.source.size() == data.triangles.size()) mesh.source = {};
}

// True if the surface bends outward from triangle t across its edge e to the far corner of the
// neighbour: that corner lies below t's plane.
bool bends_outward(const MeshGeometry& mesh, const TriangleEdge& edge, const TriangleEdge& other) {
  return is_convex_edge(area_vector(mesh, edge.triangle), corner(mesh, edge.triangle, edge.edge),
                        corner(mesh, edge.triangle, edge.edge + 1u),
                        corner(mesh, other.triangle, other.edge + 2u));
}

void set_normals(MeshGeometry& mesh) {
  mesh.normals.reserve(mesh.triangles.size());
  for (const Corners& t : mesh.triangles) {
    const V3f a = mesh.vertices[t[0]];
    const V3f area = cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
    mesh.normals.push_back(direction(area, {0, 1, 0}));
  }
}

void set_adjacency(MeshGeometry& mesh) {
  mesh.neighbours.assign(mesh.triangles.size(), {kNone, kNone, kNone});
  mesh.convex_edges.assign(mesh.triangles.size(), 7);  // borders may give edge contacts
  const auto welded = weld(mesh.vertices, [](const V3f& v) {
    return std::array<float, 3>{v.x, v.y, v.z};
  });
  const std::vector<TriangleEdge> edges = triangle_edges(mesh.triangles, welded);
  for_each_edge(edges, [&](std::size_t first, std::size_t count) {
    const TriangleEdge& a = edges[first];
    const TriangleEdge& b = edges[first + count - 1];
    // Edges of more than two triangles, or of two that wind against each other, are borders.
    if (count != 2 || a.forward == b.forward) return;
    mesh.neighbours[a.triangle][a.edge] = b.triangle;
    mesh.neighbours[b.triangle][b.edge] = a.triangle;
    if (bends_outward(mesh, a, b)) return;
    mesh.convex_edges[a.triangle] &= static_cast<std::uint8_t>(~(1u << a.edge));
    mesh.convex_edges[b.triangle] &= static_cast<std::uint8_t>(~(1u << b.edge));
  });
}

void set_tree(MeshGeometry& mesh) {
  std::vector<BuildItem> items;
  items.reserve(mesh.triangles.size());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    BuildItem item{empty_box(), t};
    for (const uint32_t vertex : mesh.triangles[t]) {
      const V3f& v = mesh.vertices[vertex];
      grow(item.box, {{v.x, v.y, v.z}, {v.x, v.y, v.z}});
    }
    items.push_back(item);
  }
  auto tree = std::make_shared<core::MeshTree>();
  build_nodes(items, tree->nodes);
  mesh.tree = std::move(tree);
}

std::string edge_name(const TriangleEdge& edge) {
  return "edge " + std::to_string(edge.low) + "-" + std::to_string(edge.high);
}

std::string edge_defect(const TriangleEdge* edges, std::size_t count) {
  if (count == 1)
    return edge_name(edges[0]) + " belongs to one triangle only (" +
           std::to_string(edges[0].triangle) + ")";
  if (count > 2) return edge_name(edges[0]) + " belongs to " + std::to_string(count) + " triangles";
  if (edges[0].forward == edges[1].forward)
    return "triangles " + std::to_string(edges[0].triangle) + " and " +
           std::to_string(edges[1].triangle) + " wind against each other at " + edge_name(edges[0]);
  return {};
}

double six_volumes(const MeshData& mesh) {
  const Vec3& origin = mesh.vertices[mesh.triangles[0][0]];
  double sum = 0;
  for (const Corners& t : mesh.triangles)
    sum += (mesh.vertices[t[0]] - origin)
               .dot((mesh.vertices[t[1]] - origin).cross(mesh.vertices[t[2]] - origin));
  return sum;
}

}  // namespace

bool is_convex_edge(const Vec3& area_vector, const Vec3& tail, const Vec3& head, const Vec3& far) {
  constexpr double kConvexSine = 0.02;
  const Vec3 along = (head - tail).normalized();
  const Vec3 to_far = far - tail;
  return area_vector.normalized().dot(to_far) < -kConvexSine * to_far.cross(along).norm();
}

std::shared_ptr<const MeshGeometry> build_mesh(const MeshData& data, const Vec3& scale) {
  if (const std::string defect = input_defect(data); !defect.empty())
    throw std::invalid_argument(defect);
  if (!scale.allFinite() || (scale.array() == 0).any())
    throw std::invalid_argument("the scale of a mesh must be finite and not zero in any axis");
  auto mesh = std::make_shared<MeshGeometry>();
  set_triangles(*mesh, data, scale);
  for (std::size_t i = 0; i < mesh->vertices.size(); ++i) {
    const core::V3f& v = mesh->vertices[i];
    constexpr float kFarthest = 1e7f;  // m; as for the lengths of all shapes
    if (!(std::abs(v.x) <= kFarthest && std::abs(v.y) <= kFarthest && std::abs(v.z) <= kFarthest))
      throw std::invalid_argument("vertex " + std::to_string(i) +
                                  " of the mesh is farther than 1e7 m out in an axis, once scaled");
  }
  if (mesh->triangles.empty())
    throw std::invalid_argument("all triangles of the mesh are degenerate (without area)");
  set_normals(*mesh);
  set_adjacency(*mesh);
  set_tree(*mesh);
  return mesh;
}

std::string solid_defect(const MeshData& mesh) {
  if (std::string defect = input_defect(mesh); !defect.empty()) return defect;
  const auto welded = weld(mesh.vertices, [](const Vec3& v) {
    return std::array<double, 3>{v.x() + 0.0, v.y() + 0.0, v.z() + 0.0};
  });
  const std::vector<TriangleEdge> edges = triangle_edges(mesh.triangles, welded);
  if (edges.empty()) return "all triangles of the mesh are degenerate (without area)";
  std::string defect;
  for_each_edge(edges, [&](std::size_t first, std::size_t count) {
    if (defect.empty()) defect = edge_defect(&edges[first], count);
  });
  if (!defect.empty()) return defect;
  const double volume = six_volumes(mesh);
  if (volume < 0) return "the triangles wind inward: the volume they enclose is negative";
  if (volume == 0) return "the triangles enclose no volume";
  return {};
}

}  // namespace skerry::collision
