// build_hull: triangles of the exact hull, merged into polygons.
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "collision/geometry_build.h"
#include "collision/polytope_lanes.h"
#include "collision/quickhull.h"
#include "core/rounding.h"

namespace skerry::collision {
namespace {

using core::HullGeometry;
using core::kNone;
using std::uint32_t;
using Loop = std::vector<uint32_t>;  // points of a face, counter-clockwise
using Indices = std::array<uint32_t, 3>;

// How far a point may lie below a face's plane and still be a corner of it, in longest extents:
// some tens of the grid cells of quickhull.
constexpr double kFlat = 2e-6;

// A directed edge of a face.
struct HalfEdge {
  uint32_t tail, head, face;
  friend bool operator<(const HalfEdge& a, const HalfEdge& b) {
    return a.tail != b.tail ? a.tail < b.tail : a.head < b.head;
  }
};

std::vector<HalfEdge> sorted_half_edges(const std::vector<Loop>& loops) {
  std::vector<HalfEdge> edges;
  for (uint32_t face = 0; face < loops.size(); ++face)
    for (std::size_t i = 0; i < loops[face].size(); ++i)
      edges.push_back({loops[face][i], loops[face][(i + 1) % loops[face].size()], face});
  std::sort(edges.begin(), edges.end());
  return edges;
}

// The face on the other side of an edge; kNone if it is not there exactly once.
uint32_t face_across(const std::vector<HalfEdge>& edges, uint32_t tail, uint32_t head) {
  const auto [first, last] = std::equal_range(edges.begin(), edges.end(), HalfEdge{head, tail, 0});
  return last - first == 1 ? first->face : kNone;
}

// Area vector: normal times area (Newell's method).
Vec3 area_vector(const Loop& loop, std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  const Vec3& origin = points[loop[0]];
  for (std::size_t i = 1; i + 1 < loop.size(); ++i)
    sum += (points[loop[i]] - origin).cross(points[loop[i + 1]] - origin);
  return sum / 2;
}

// Merges triangles whose corners lie in one plane.
class FaceMerger {
 public:
  FaceMerger(std::span<const Vec3> points, const std::vector<Indices>& triangles, double flat)
      : points_(points), flat_(flat) {
    for (const Indices& t : triangles) triangles_.emplace_back(t.begin(), t.end());
    edges_ = sorted_half_edges(triangles_);
  }

  // Nothing if what comes out is no closed polyhedron of simple polygons.
  std::optional<std::vector<Loop>> run() {
    grow_regions();
    std::vector<Loop> loops;
    for (uint32_t region = 0; region < region_count_; ++region) {
      Loop loop = boundary(region);
      if (loop.empty()) return std::nullopt;
      loops.push_back(std::move(loop));
    }
    drop_straight_corners(loops);
    return closed(loops) ? std::optional(std::move(loops)) : std::nullopt;
  }

 private:
  // From the largest triangles outward: they know their plane best, slivers join them.
  void grow_regions() {
    std::vector<double> area;
    std::vector<uint32_t> order;
    for (uint32_t t = 0; t < triangles_.size(); ++t) {
      area.push_back(area_vector(triangles_[t], points_).squaredNorm());
      order.push_back(t);
    }
    std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
      return area[a] > area[b] || (area[a] == area[b] && a < b);
    });
    region_.assign(triangles_.size(), kNone);
    members_.clear();
    for (const uint32_t seed : order)
      if (region_[seed] == kNone) grow_region(seed);
    region_count_ = static_cast<uint32_t>(members_.size());
  }

  void grow_region(uint32_t seed) {
    const auto region = static_cast<uint32_t>(members_.size());
    const Vec3 normal = area_vector(triangles_[seed], points_).normalized();
    const double offset = normal.dot(points_[triangles_[seed][0]]);
    std::vector<uint32_t> members = {seed};
    region_[seed] = region;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const Loop& triangle = triangles_[members[i]];
      for (std::size_t e = 0; e < 3; ++e) {
        const uint32_t next = face_across(edges_, triangle[e], triangle[(e + 1) % 3]);
        if (region_[next] != kNone || !in_plane(triangles_[next], normal, offset)) continue;
        region_[next] = region;
        members.push_back(next);
      }
    }
    members_.push_back(std::move(members));
  }

  bool in_plane(const Loop& triangle, const Vec3& normal, double offset) const {
    return std::all_of(triangle.begin(), triangle.end(), [&](uint32_t point) {
      return std::abs(normal.dot(points_[point]) - offset) <= flat_;
    });
  }

  // The region's border as one loop; empty if it is not one.
  Loop boundary(uint32_t region) const {
    std::vector<HalfEdge> border;
    for (const uint32_t t : members_[region]) {
      const Loop& triangle = triangles_[t];
      for (std::size_t e = 0; e < 3; ++e) {
        const uint32_t tail = triangle[e], head = triangle[(e + 1) % 3];
        if (region_[face_across(edges_, tail, head)] != region) border.push_back({tail, head, t});
      }
    }
    std::sort(border.begin(), border.end());
    Loop loop;
    if (border.empty()) return loop;
    for (uint32_t point = border[0].tail; loop.size() < border.size();) {
      loop.push_back(point);
      const auto next = std::lower_bound(border.begin(), border.end(), HalfEdge{point, 0, 0});
      if (next == border.end() || next->tail != point) return {};
      if (next + 1 != border.end() && (next + 1)->tail == point) return {};
      point = next->head;
      if (point == loop[0]) break;
    }
    return loop.size() == border.size() ? loop : Loop{};
  }

  // A point between two faces only is no corner; a face that is left with two points is an edge.
  static void drop_straight_corners(std::vector<Loop>& loops) {
    for (bool changed = true; changed;) {
      uint32_t points = 0;
      for (const Loop& loop : loops)
        for (const uint32_t point : loop) points = std::max(points, point + 1);
      std::vector<uint32_t> faces_at(points, 0);
      for (const Loop& loop : loops)
        for (const uint32_t point : loop) ++faces_at[point];
      std::size_t dropped = 0;
      for (Loop& loop : loops)
        dropped += std::erase_if(loop, [&](uint32_t point) { return faces_at[point] < 3; });
      std::erase_if(loops, [](const Loop& loop) { return loop.size() < 3; });
      changed = dropped > 0;
    }
  }

  static bool closed(const std::vector<Loop>& loops) {
    const std::vector<HalfEdge> edges = sorted_half_edges(loops);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const uint32_t across = face_across(edges, edges[i].tail, edges[i].head);
      if (across == kNone || across == edges[i].face) return false;
      if (i > 0 && !(edges[i - 1] < edges[i])) return false;
    }
    return loops.size() >= 4;
  }

  std::span<const Vec3> points_;
  double flat_;
  std::vector<Loop> triangles_;
  std::vector<HalfEdge> edges_;
  std::vector<uint32_t> region_;                // [triangle]
  std::vector<std::vector<uint32_t>> members_;  // [region] triangles
  uint32_t region_count_ = 0;
};

// Renumbers the corners in the order of the input and turns each loop so that its lowest comes
// first; returns the input index of each corner.
std::vector<uint32_t> number_corners(std::vector<Loop>& loops) {
  std::vector<uint32_t> corners;
  for (const Loop& loop : loops) corners.insert(corners.end(), loop.begin(), loop.end());
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  for (Loop& loop : loops) {
    for (uint32_t& point : loop)
      point = static_cast<uint32_t>(std::lower_bound(corners.begin(), corners.end(), point) -
                                    corners.begin());
    std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
  }
  std::sort(loops.begin(), loops.end());
  return corners;
}

void set_faces(HullGeometry& hull, const std::vector<Loop>& loops, std::span<const Vec3> corners) {
  for (const Loop& loop : loops) {
    const Vec3 normal = area_vector(loop, corners).normalized();
    double offset = normal.dot(corners[loop[0]]);
    for (const uint32_t corner : loop) offset = std::max(offset, normal.dot(corners[corner]));
    hull.faces.push_back({core::to_float(normal), core::rounded_to_float(offset),
                          static_cast<std::uint16_t>(hull.face_vertices.size()),
                          static_cast<std::uint16_t>(loop.size())});
    for (const uint32_t corner : loop)
      hull.face_vertices.push_back(static_cast<std::uint16_t>(corner));
  }
}

void set_edges(HullGeometry& hull, const std::vector<Loop>& loops) {
  const std::vector<HalfEdge> edges = sorted_half_edges(loops);
  for (const HalfEdge& edge : edges) {
    if (edge.tail > edge.head) continue;
    const auto small = [](uint32_t value) { return static_cast<std::uint16_t>(value); };
    hull.edges.push_back({small(edge.tail), small(edge.head), small(edge.face),
                          small(face_across(edges, edge.tail, edge.head))});
  }
}

// Centre of volume and the distance from it to the nearest face.
void set_center(HullGeometry& hull, const std::vector<Loop>& loops, std::span<const Vec3> corners) {
  const Vec3 origin = corners[0];  // on the surface: volumes of all signs but one are positive
  double volume = 0;
  Vec3 first = Vec3::Zero();
  for (const Loop& loop : loops)
    for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
      const Vec3 a = corners[loop[0]] - origin, b = corners[loop[i]] - origin,
                 c = corners[loop[i + 1]] - origin;
      const double six_volume = a.dot(b.cross(c));
      volume += six_volume;
      first += six_volume * (a + b + c) / 4;
    }
  hull.center = core::to_float(Vec3(origin + first / volume));
  hull.inner_radius = HUGE_VALF;
  for (const HullGeometry::Face& face : hull.faces)
    hull.inner_radius =
        std::min(hull.inner_radius, face.offset - core::dot(face.normal, hull.center));
}

}  // namespace

std::shared_ptr<const HullGeometry> build_hull(std::vector<Vec3> points, const Vec3& scale) {
  for (Vec3& point : points) point = point.cwiseProduct(scale);
  const std::vector<Indices> triangles = quickhull(points);
  Vec3 low = points[0], high = points[0];
  for (const Vec3& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  auto merged = FaceMerger(points, triangles, kFlat * (high - low).maxCoeff()).run();
  std::vector<Loop> loops;
  if (merged)
    loops = std::move(*merged);
  else
    for (const Indices& triangle : triangles) loops.emplace_back(triangle.begin(), triangle.end());

  const std::vector<uint32_t> used = number_corners(loops);
  std::size_t face_corners = 0;
  for (const Loop& loop : loops) face_corners += loop.size();
  if (face_corners > 0xffff)
    throw std::invalid_argument("the convex hull has " + std::to_string(used.size()) +
                                " vertices, more than its 16-bit tables hold; simplify the points");
  std::vector<Vec3> corners;
  auto hull = std::make_shared<HullGeometry>();
  for (const uint32_t point : used) {
    hull->vertices.push_back(core::to_float(points[point]));
    corners.push_back(core::to_double(hull->vertices.back()));
  }
  set_faces(*hull, loops, corners);
  set_edges(*hull, loops);
  set_center(*hull, loops, corners);
  hull->lanes = std::make_shared<core::HullLanes>(*hull);
  return hull;
}

}  // namespace skerry::collision
