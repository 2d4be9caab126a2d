#include "collision/quickhull.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/assert.h"

namespace skerry::collision {
namespace {

using std::int64_t;
using std::uint32_t;
__extension__ using Wide = __int128;

constexpr double kGrid = 1 << 24;
constexpr double kThinnest = 2e-5 * kGrid;

struct Cell {
  int64_t x, y, z;  // below 2^24 + 1 in size, differences below 2^25
  friend Cell operator-(const Cell& a, const Cell& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};
Cell cross(const Cell& a, const Cell& b) {  // below 2^51
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Wide dot(const Cell& a, const Cell& b) {  // below 2^104
  return Wide{a.x} * b.x + Wide{a.y} * b.y + Wide{a.z} * b.z;
}

struct Face {
  uint32_t vertex[3];
  uint32_t neighbour[3];  // across vertex[i], vertex[i + 1]
  Cell normal;            // outward, not unit
  bool alive = true;
  bool visible = false;           // from the point that is being added
  std::vector<uint32_t> outside;  // points above this face that no older face has taken
};

struct HorizonEdge {
  uint32_t tail, head;
  uint32_t beyond;  // face that stays
};

class Quickhull {
 public:
  explicit Quickhull(std::span<const Vec3> points) : cells_(to_cells(points)) {}

  std::vector<std::array<uint32_t, 3>> run() {
    start();
    for (uint32_t face = 0; face < faces_.size(); ++face)
      if (faces_[face].alive && !faces_[face].outside.empty()) add_farthest(face);
    std::vector<std::array<uint32_t, 3>> triangles;
    for (const Face& face : faces_)
      if (face.alive) triangles.push_back({face.vertex[0], face.vertex[1], face.vertex[2]});
    return triangles;
  }

 private:
  static std::vector<Cell> to_cells(std::span<const Vec3> points) {
    if (points.size() < 4)
      throw std::invalid_argument("a convex hull needs at least 4 points, not " +
                                  std::to_string(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
      if (!points[i].cast<float>().allFinite())
        throw std::invalid_argument("point " + std::to_string(i) +
                                    " of the convex hull is not finite");
    Vec3 low = points[0], high = points[0];
    for (const Vec3& point : points) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    const double extent = (high - low).maxCoeff();
    if (!(extent > 0)) throw std::invalid_argument("the points of the convex hull all coincide");
    const auto to_cell = [&](double offset) {
      return static_cast<int64_t>(std::floor(offset / extent * kGrid + 0.5));
    };
    std::vector<Cell> cells;
    cells.reserve(points.size());
    for (const Vec3& p : points)
      cells.push_back(
          {to_cell(p.x() - low.x()), to_cell(p.y() - low.y()), to_cell(p.z() - low.z())});
    return cells;
  }

  // Above the face's plane if positive.
  Wide height(const Face& face, uint32_t point) const {
    return dot(face.normal, cells_[point] - cells_[face.vertex[0]]);
  }

  // First point of largest measure.
  template <class Measure>
  uint32_t farthest(const Measure& measure) const {
    uint32_t best = 0;
    Wide most = measure(cells_[0]);
    for (uint32_t i = 1; i < cells_.size(); ++i)
      if (const Wide value = measure(cells_[i]); value > most) {
        most = value;
        best = i;
      }
    return best;
  }

  uint32_t add_face(uint32_t a, uint32_t b, uint32_t c) {
    Face face;
    face.vertex[0] = a;
    face.vertex[1] = b;
    face.vertex[2] = c;
    face.normal = cross(cells_[b] - cells_[a], cells_[c] - cells_[a]);
    faces_.push_back(std::move(face));
    return static_cast<uint32_t>(faces_.size() - 1);
  }

  // A tetrahedron of points far apart.
  void start() {
    const Cell first = cells_[0];
    const uint32_t a = farthest([&](const Cell& p) { return dot(p - first, p - first); });
    const Cell pa = cells_[a];
    const uint32_t b = farthest([&](const Cell& p) { return dot(p - pa, p - pa); });
    const Cell ab = cells_[b] - pa;
    const uint32_t c = farthest([&](const Cell& p) {
      const Cell area = cross(ab, p - pa);
      return dot(area, area);
    });
    const Cell normal = cross(ab, cells_[c] - pa);
    const double area = std::sqrt(double(dot(normal, normal)));
    if (area < kThinnest * std::sqrt(double(dot(ab, ab))))
      throw std::invalid_argument("the points of the convex hull lie (nearly) on a line");
    const uint32_t d = farthest([&](const Cell& p) {
      const Wide h = dot(normal, p - pa);
      return h < 0 ? -h : h;
    });
    const Wide height_d = dot(normal, cells_[d] - pa);
    if (std::abs(double(height_d)) < kThinnest * area)
      throw std::invalid_argument("the points of the convex hull lie (nearly) in a plane");
    add_tetrahedron(a, height_d < 0 ? b : c, height_d < 0 ? c : b, d);
  }

  // d lies below a, b, c.
  void add_tetrahedron(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    const uint32_t sides[4][3] = {{a, b, c}, {a, d, b}, {b, d, c}, {c, d, a}};
    const uint32_t neighbours[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
    for (const auto& side : sides) add_face(side[0], side[1], side[2]);
    for (uint32_t i = 0; i < 4; ++i) std::copy_n(neighbours[i], 3, faces_[i].neighbour);
    std::vector<uint32_t> points(cells_.size());
    for (uint32_t i = 0; i < points.size(); ++i) points[i] = i;
    hand_out(points, 0);
  }

  // Gives each point to the first of the faces from `first_face` on that it is above.
  void hand_out(const std::vector<uint32_t>& points, uint32_t first_face) {
    for (const uint32_t point : points)
      for (uint32_t f = first_face; f < faces_.size(); ++f)
        if (height(faces_[f], point) > 0) {
          faces_[f].outside.push_back(point);
          break;
        }
  }

  void add_farthest(uint32_t start_face) {
    const Face& face = faces_[start_face];
    uint32_t eye = face.outside[0];
    for (const uint32_t point : face.outside)
      if (height(face, point) > height(face, eye)) eye = point;

    find_horizon(start_face, eye);
    std::vector<uint32_t> orphans;
    for (const uint32_t f : visible_) {
      faces_[f].alive = false;
      orphans.insert(orphans.end(), faces_[f].outside.begin(), faces_[f].outside.end());
      faces_[f].outside = {};
    }
    const uint32_t first_new = add_cone(eye);
    hand_out(orphans, first_new);
  }

  // Fills visible_ and horizon_, the latter as a loop counter-clockwise seen from the eye.
  void find_horizon(uint32_t start_face, uint32_t eye) {
    visible_.assign(1, start_face);
    horizon_.clear();
    faces_[start_face].visible = true;
    for (std::size_t i = 0; i < visible_.size(); ++i) {
      for (uint32_t e = 0; e < 3; ++e) {
        const Face& face = faces_[visible_[i]];
        const uint32_t next = face.neighbour[e];
        if (faces_[next].visible) continue;
        if (height(faces_[next], eye) > 0) {
          faces_[next].visible = true;
          visible_.push_back(next);
        } else {
          horizon_.push_back({face.vertex[e], face.vertex[(e + 1) % 3], next});
        }
      }
    }
    for (std::size_t i = 0; i + 1 < horizon_.size(); ++i)
      for (std::size_t j = i + 1; j < horizon_.size(); ++j)
        if (horizon_[j].tail == horizon_[i].head) {
          std::swap(horizon_[i + 1], horizon_[j]);
          break;
        }
  }

  // Joins the horizon to the eye; returns the first new face.
  uint32_t add_cone(uint32_t eye) {
    const auto first = static_cast<uint32_t>(faces_.size());
    const auto count = static_cast<uint32_t>(horizon_.size());
    for (uint32_t i = 0; i < count; ++i) {
      const auto [tail, head, beyond] = horizon_[i];
      const uint32_t added = add_face(tail, head, eye);
      faces_[added].neighbour[0] = beyond;
      faces_[added].neighbour[1] = first + (i + 1) % count;
      faces_[added].neighbour[2] = first + (i + count - 1) % count;
      Face& other = faces_[beyond];
      for (uint32_t e = 0; e < 3; ++e)
        if (other.vertex[e] == head && other.vertex[(e + 1) % 3] == tail)
          other.neighbour[e] = added;
      SKERRY_ASSERT(horizon_[(i + 1) % count].tail == head, "the horizon is not one loop");
    }
    return first;
  }

  std::vector<Cell> cells_;
  std::vector<Face> faces_;
  std::vector<uint32_t> visible_;
  std::vector<HorizonEdge> horizon_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> quickhull(std::span<const Vec3> points) {
  return Quickhull(points).run();
}

}  // namespace skerry::collision
