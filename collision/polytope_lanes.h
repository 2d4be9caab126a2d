// Convex polytopes as rows of floats side by side, as the separating-axis kernel reads them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/colliders.h"

namespace skerry::collision {

// A view. Rows are 64-byte aligned and as long as their stride, a multiple of kPad, which every
// SIMD width divides. Beyond the counts: copies of the first vertex, faces and edges that no
// direction finds.
struct PolytopeLanes {
  static constexpr std::uint32_t kPad = 16;
  enum FaceRow { kNormal = 0, kOffset = 3, kFaceRows };  // unit, outward; m, normal.x on the face
  enum EdgeRow {
    kTail = 0,         // m
    kAlong = 3,        // m, head - tail; lies along left x right
    kLeft = 6,         // unit, normals of the two faces
    kRight = 9,        //
    kLeftOffset = 12,  // m, of those faces
    kRightOffset = 13,
    kEdgeRows
  };

  std::uint32_t vertex_count = 0, face_count = 0, edge_count = 0;
  std::uint32_t vertex_stride = 0, face_stride = 0, edge_stride = 0;
  const float* vertices = nullptr;  // x, y, z
  const float* faces = nullptr;     // FaceRow
  const float* edges = nullptr;     // EdgeRow
  float size = 0;                   // m, some length like half its extent
  float radius = 0;                 // m, of the sphere about the frame's origin that holds it

  core::V3f face_normal(std::uint32_t i) const { return row(faces, face_stride, kNormal, i); }
  core::V3f edge(EdgeRow first, std::uint32_t i) const { return row(edges, edge_stride, first, i); }

 private:
  static core::V3f row(const float* rows, std::uint32_t stride, std::uint32_t first,
                       std::uint32_t i) {
    const float* at = rows + first * stride + i;
    return {at[0], at[stride], at[2 * stride]};
  }
};

// Rows of a box.
class BoxLanes {
 public:
  BoxLanes() = default;
  BoxLanes(const BoxLanes&) = delete;
  BoxLanes& operator=(const BoxLanes&) = delete;

  PolytopeLanes box(const core::V3f& half);

 private:
  static constexpr std::uint32_t kPad = PolytopeLanes::kPad;

  alignas(64) float vertices_[3][kPad];
  alignas(64) float faces_[PolytopeLanes::kFaceRows][kPad];
  alignas(64) float edges_[PolytopeLanes::kEdgeRows][kPad];
};

}  // namespace skerry::collision

namespace skerry::core {

// Rows of a hull.
struct HullLanes {
  struct alignas(64) Block {
    float values[collision::PolytopeLanes::kPad];
  };
  std::vector<Block> vertices, faces, edges;
  collision::PolytopeLanes view;  // of these rows; so HullLanes is never copied

  explicit HullLanes(const HullGeometry& hull);
  HullLanes(const HullLanes&) = delete;
  HullLanes& operator=(const HullLanes&) = delete;
};

}  // namespace skerry::core
