#include "collision/polytope_lanes.h"

#include <algorithm>
#include <cmath>

namespace skerry::collision {
namespace {

using core::dot;
using core::V3f;

constexpr float kNowhere = 3e38f;  // offset of a face that nothing reaches

// Rows of one kind, to be filled.
struct Rows {
  float* at;
  std::uint32_t stride;

  void put(std::uint32_t row, std::uint32_t i, float value) const { at[row * stride + i] = value; }
  void put(std::uint32_t row, std::uint32_t i, const V3f& v) const {
    put(row, i, v.x);
    put(row + 1, i, v.y);
    put(row + 2, i, v.z);
  }
  void put_face(std::uint32_t i, const V3f& normal, float offset) const {
    put(PolytopeLanes::kNormal, i, normal);
    put(PolytopeLanes::kOffset, i, offset);
  }
  void put_edge(std::uint32_t i, const V3f& tail, const V3f& along, const V3f& left,
                float left_offset, const V3f& right, float right_offset) const {
    put(PolytopeLanes::kTail, i, tail);
    put(PolytopeLanes::kAlong, i, along);
    put(PolytopeLanes::kLeft, i, left);
    put(PolytopeLanes::kRight, i, right);
    put(PolytopeLanes::kLeftOffset, i, left_offset);
    put(PolytopeLanes::kRightOffset, i, right_offset);
  }
  void pad_vertices(std::uint32_t count, const V3f& first) const {
    for (std::uint32_t i = count; i < stride; ++i) put(0, i, first);
  }
  void pad_faces(std::uint32_t count) const {
    for (std::uint32_t i = count; i < stride; ++i) put_face(i, {0, 0, 0}, kNowhere);
  }
  void pad_edges(std::uint32_t count) const {
    const V3f none{0, 0, 0};
    for (std::uint32_t i = count; i < stride; ++i)
      put_edge(i, none, none, none, kNowhere, none, kNowhere);
  }
};

std::uint32_t blocks(std::size_t count) {
  return static_cast<std::uint32_t>((count + PolytopeLanes::kPad - 1) / PolytopeLanes::kPad);
}

}  // namespace

PolytopeLanes BoxLanes::box(const V3f& half) {
  const Rows vertices{vertices_[0], kPad}, faces{faces_[0], kPad}, edges{edges_[0], kPad};
  const V3f axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const float h[3] = {half.x, half.y, half.z};
  for (std::uint32_t i = 0; i < 8; ++i)
    vertices.put(0, i, V3f{i & 1 ? h[0] : -h[0], i & 2 ? h[1] : -h[1], i & 4 ? h[2] : -h[2]});
  std::uint32_t edge = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    faces.put_face(2 * i, -axis[i], h[i]);
    faces.put_face(2 * i + 1, axis[i], h[i]);
    const std::uint32_t u = (i + 1) % 3, v = (i + 2) % 3;
    for (const float su : {-1.0f, 1.0f}) {
      for (const float sv : {-1.0f, 1.0f}) {
        const V3f middle = axis[u] * (su * h[u]) + axis[v] * (sv * h[v]);
        // u x v = axis i, so along axis i the left face is u's if the signs agree.
        const V3f nu = axis[u] * su, nv = axis[v] * sv;
        const bool agree = su * sv > 0;
        edges.put_edge(edge++, middle - axis[i] * h[i], axis[i] * (h[i] + h[i]), agree ? nu : nv,
                       agree ? h[u] : h[v], agree ? nv : nu, agree ? h[v] : h[u]);
      }
    }
  }
  vertices.pad_vertices(8, -half);
  faces.pad_faces(6);
  edges.pad_edges(12);
  PolytopeLanes lanes;
  lanes.vertex_count = 8;
  lanes.face_count = 6;
  lanes.edge_count = 12;
  lanes.vertex_stride = lanes.face_stride = lanes.edge_stride = kPad;
  lanes.vertices = vertices_[0];
  lanes.faces = faces_[0];
  lanes.edges = edges_[0];
  lanes.size = std::max(half.x, std::max(half.y, half.z));
  lanes.radius = core::length(half);
  return lanes;
}

}  // namespace skerry::collision

namespace skerry::core {

HullLanes::HullLanes(const HullGeometry& hull) {
  using collision::PolytopeLanes;
  const std::uint32_t v = collision::blocks(hull.vertices.size());
  const std::uint32_t f = collision::blocks(hull.faces.size());
  const std::uint32_t e = collision::blocks(hull.edges.size());
  vertices.resize(3 * v);
  faces.resize(PolytopeLanes::kFaceRows * f);
  edges.resize(PolytopeLanes::kEdgeRows * e);
  view.vertex_count = static_cast<std::uint32_t>(hull.vertices.size());
  view.face_count = static_cast<std::uint32_t>(hull.faces.size());
  view.edge_count = static_cast<std::uint32_t>(hull.edges.size());
  view.vertex_stride = v * PolytopeLanes::kPad;
  view.face_stride = f * PolytopeLanes::kPad;
  view.edge_stride = e * PolytopeLanes::kPad;
  view.vertices = vertices[0].values;
  view.faces = faces[0].values;
  view.edges = edges[0].values;
  view.size = hull.inner_radius;

  const collision::Rows to_vertices{vertices[0].values, view.vertex_stride};
  const collision::Rows to_faces{faces[0].values, view.face_stride};
  const collision::Rows to_edges{edges[0].values, view.edge_stride};
  for (std::uint32_t i = 0; i < view.vertex_count; ++i) {
    to_vertices.put(0, i, hull.vertices[i]);
    view.radius = std::max(view.radius, length(hull.vertices[i]));
  }
  for (std::uint32_t i = 0; i < view.face_count; ++i)
    to_faces.put_face(i, hull.faces[i].normal, hull.faces[i].offset);
  for (std::uint32_t i = 0; i < view.edge_count; ++i) {
    const HullGeometry::Edge& edge = hull.edges[i];
    const HullGeometry::Face &left = hull.faces[edge.left_face],
                             &right = hull.faces[edge.right_face];
    const V3f tail = hull.vertices[edge.tail];
    to_edges.put_edge(i, tail, hull.vertices[edge.head] - tail, left.normal, left.offset,
                      right.normal, right.offset);
  }
  to_vertices.pad_vertices(view.vertex_count, hull.vertices[0]);
  to_faces.pad_faces(view.face_count);
  to_edges.pad_edges(view.edge_count);
}

}  // namespace skerry::core
