// Boxes, hulls and triangles by separating axes.
#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

using core::cross;
using core::dot;
using core::HullGeometry;
using core::transposed_times;

namespace {

struct Face {
  V3f normal;    // unit, outward
  float offset;  // m, normal.x on the face
};
struct Edge {
  V3f tail, head;
  V3f left, right;  // normals of the two faces; head - tail lies along left x right
};

// A convex polytope in its own frame, over whatever stores it.
class Polytope {
 public:
  explicit Polytope(const PlacedShape& shape) : shape_(shape) {
    if (shape.triangle != nullptr)
      from_triangle(*shape.triangle);
    else if (shape.collider->type == ShapeType::box)
      from_box(shape.collider->size);
    else
      from_hull(*shape.collider->hull);
  }

  const PlacedShape& shape() const { return shape_; }
  std::uint32_t face_count() const { return face_count_; }
  std::uint32_t edge_count() const { return edge_count_; }
  V3f center() const { return center_; }
  float size() const { return size_; }  // m, some length like half its extent

  Face face(std::uint32_t i) const {
    if (hull_ == nullptr) return faces_[i];
    return {hull_->faces[i].normal, hull_->faces[i].offset};
  }
  Edge edge(std::uint32_t i) const {
    if (hull_ == nullptr) return edges_[i];
    const HullGeometry::Edge& e = hull_->edges[i];
    return {hull_->vertices[e.tail], hull_->vertices[e.head], hull_->faces[e.left_face].normal,
            hull_->faces[e.right_face].normal};
  }
  // Largest extent along a direction (of any length).
  float support(const V3f& d) const {
    if (is_box_)
      return (std::fabs(d.x) * half_.x + std::fabs(d.y) * half_.y) + std::fabs(d.z) * half_.z;
    float best = -3e38f;
    for (std::uint32_t i = 0; i < vertex_count_; ++i) best = std::max(best, dot(d, vertices_[i]));
    return best;
  }

 private:
  void from_box(const V3f& half) {
    is_box_ = true;
    half_ = half;
    size_ = std::max(half.x, std::max(half.y, half.z));
    center_ = {0, 0, 0};
    const V3f axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const float h[3] = {half.x, half.y, half.z};
    for (int i = 0; i < 3; ++i) {
      faces_[face_count_++] = {-axis[i], h[i]};
      faces_[face_count_++] = {axis[i], h[i]};
      const int u = (i + 1) % 3, v = (i + 2) % 3;
      for (const float su : {-1.0f, 1.0f}) {
        for (const float sv : {-1.0f, 1.0f}) {
          const V3f middle = axis[u] * (su * h[u]) + axis[v] * (sv * h[v]);
          // u x v = axis i, so along axis i the left face is u's if the signs agree.
          const V3f nu = axis[u] * su, nv = axis[v] * sv;
          const bool agree = su * sv > 0;
          edges_[edge_count_++] = {middle - axis[i] * h[i], middle + axis[i] * h[i],
                                   agree ? nu : nv, agree ? nv : nu};
        }
      }
    }
  }

  void from_hull(const HullGeometry& hull) {
    hull_ = &hull;
    vertices_ = hull.vertices.data();
    vertex_count_ = static_cast<std::uint32_t>(hull.vertices.size());
    face_count_ = static_cast<std::uint32_t>(hull.faces.size());
    edge_count_ = static_cast<std::uint32_t>(hull.edges.size());
    center_ = hull.center;
    size_ = hull.inner_radius;
  }

  void from_triangle(const Triangle& triangle) {
    vertices_ = triangle.corner;
    vertex_count_ = 3;
    faces_[0] = {triangle.normal, dot(triangle.normal, triangle.corner[0])};
    face_count_ = 1;
    for (int i = 0; i < 3; ++i) {
      if (!triangle.touchable[i]) continue;
      edges_[edge_count_++] = {triangle.corner[i], triangle.corner[(i + 1) % 3], triangle.normal,
                               triangle.beyond[i]};
    }
    // A point behind the middle, so that normals can be told from their opposites.
    const V3f middle = (triangle.corner[0] + triangle.corner[1] + triangle.corner[2]) * (1.0f / 3);
    size_ = core::length(triangle.corner[1] - triangle.corner[0]);
    center_ = middle - triangle.normal * size_;
  }

  const PlacedShape& shape_;
  const HullGeometry* hull_ = nullptr;
  const V3f* vertices_ = nullptr;
  std::uint32_t vertex_count_ = 0, face_count_ = 0, edge_count_ = 0;
  bool is_box_ = false;
  float size_;
  V3f half_, center_;
  Face faces_[6];
  Edge edges_[12];
};

enum Kind : std::uint32_t { kNothing, kFaceOfA, kFaceOfB, kEdges };

// What is remembered from step to step.
struct AxisName {
  Kind kind = kNothing;
  std::uint32_t a = 0, b = 0;

  std::uint32_t pack() const { return kind | (a & 0x7fffu) << 2 | (b & 0x7fffu) << 17; }
  static AxisName unpack(std::uint32_t bits) {
    return {static_cast<Kind>(bits & 3u), bits >> 2 & 0x7fffu, bits >> 17};
  }
};

struct AxisFound {
  AxisName name;
  float separation = -3e38f;
  V3f normal{0, 1, 0};                     // world, from a to b
  V3f point_a, along_a, point_b, along_b;  // edges only: world
};

class SeparatingAxes {
 public:
  SeparatingAxes(const Polytope& a, const Polytope& b, const Query& query)
      : a_(a), b_(b), query_(query) {
    const M3f &ra = a.shape().axes, &rb = b.shape().axes;
    rotation_ = {transposed_times(ra, rb.c0), transposed_times(ra, rb.c1),
                 transposed_times(ra, rb.c2)};
    offset_ = transposed_times(ra, b.shape().center - a.shape().center);
  }

  // Largest separation; false as soon as one exceeds the margin (its name is then in `found`).
  bool search(AxisFound& found) const {
    AxisFound face_a, face_b, edges;
    for (std::uint32_t i = 0; i < a_.face_count(); ++i)
      if (!keep(face_of_a(i), face_a, found)) return false;
    for (std::uint32_t i = 0; i < b_.face_count(); ++i)
      if (!keep(face_of_b(i), face_b, found)) return false;
    for (std::uint32_t i = 0; i < a_.edge_count(); ++i)
      if (!search_edges(i, edges, found)) return false;
    found = prefer(face_a, face_b, edges);
    return found.name.kind != kNothing;
  }

  // The axis of a name, if it still is one.
  AxisFound recall(const AxisName& name) const {
    if (name.kind == kFaceOfA && name.a < a_.face_count()) return face_of_a(name.a);
    if (name.kind == kFaceOfB && name.b < b_.face_count()) return face_of_b(name.b);
    if (name.kind == kEdges && name.a < a_.edge_count() && name.b < b_.edge_count())
      return of_edges(name.a, edge_in_b(name.a), name.b);
    return {};
  }

 private:
  // A direction that parts the shapes beyond the margin ends the search even where it may not be
  // the normal of a contact.
  bool keep(const AxisFound& axis, AxisFound& best, AxisFound& found) const {
    if (axis.separation > query_.margin) {
      found = axis;
      return false;
    }
    if (axis.separation > best.separation && !forbidden(axis)) best = axis;
    return true;
  }
  bool forbidden(const AxisFound& axis) const {
    const Triangle* triangle = b_.shape().triangle;
    return triangle != nullptr && axis.name.kind == kFaceOfA &&
           leans_too_far(*triangle, -axis.normal);
  }

  AxisFound face_of_a(std::uint32_t i) const {
    const Face face = a_.face(i);
    const V3f in_b = transposed_times(rotation_, face.normal);
    AxisFound axis;
    axis.name = {kFaceOfA, i, 0};
    axis.separation = (dot(face.normal, offset_) - b_.support(-in_b)) - face.offset;
    axis.normal = a_.shape().axes * face.normal;
    return axis;
  }
  AxisFound face_of_b(std::uint32_t i) const {
    const Face face = b_.face(i);
    const V3f in_a = rotation_ * face.normal;
    AxisFound axis;
    axis.name = {kFaceOfB, 0, i};
    axis.separation = (-dot(in_a, offset_) - a_.support(-in_a)) - face.offset;
    axis.normal = -(b_.shape().axes * face.normal);
    return axis;
  }

  Edge edge_in_b(std::uint32_t i) const {
    const Edge e = a_.edge(i);
    return {transposed_times(rotation_, e.tail - offset_),
            transposed_times(rotation_, e.head - offset_), transposed_times(rotation_, e.left),
            transposed_times(rotation_, e.right)};
  }

  // Do the arcs of an edge of a and of a mirrored edge of b cross on the Gauss map? Only then do
  // the two edges make a face of the Minkowski difference.
  static bool cross_on_gauss_map(const Edge& ea, const Edge& eb) {
    const V3f along_a = ea.head - ea.tail, along_b = eb.head - eb.tail;
    const float cba = dot(eb.left, along_a), dba = dot(eb.right, along_a);
    if (cba * dba >= 0) return false;
    const float adc = dot(ea.left, along_b), bdc = dot(ea.right, along_b);
    return adc * bdc < 0 && cba * bdc < 0;
  }

  AxisFound of_edges(std::uint32_t i, const Edge& ea, std::uint32_t j) const {
    const Edge eb = b_.edge(j);
    AxisFound axis;
    if (!cross_on_gauss_map(ea, eb)) return axis;
    const V3f along_a = ea.head - ea.tail, along_b = eb.head - eb.tail;
    V3f normal = cross(along_a, along_b);
    const float squared = dot(normal, normal);
    if (!(squared > 1e-6f * dot(along_a, along_a) * dot(along_b, along_b))) return axis;
    normal = normal * (1 / std::sqrt(squared));
    if (dot(normal, ea.left + ea.right) < 0) normal = -normal;
    axis.name = {kEdges, i, j};
    axis.separation = dot(normal, eb.tail - ea.tail);
    const PlacedShape& shape = b_.shape();
    axis.normal = shape.axes * normal;
    axis.point_a = shape.center + shape.axes * ea.tail;
    axis.along_a = shape.axes * along_a;
    axis.point_b = shape.center + shape.axes * eb.tail;
    axis.along_b = shape.axes * along_b;
    return axis;
  }

  bool search_edges(std::uint32_t i, AxisFound& best, AxisFound& found) const {
    const Edge ea = edge_in_b(i);
    for (std::uint32_t j = 0; j < b_.edge_count(); ++j)
      if (!keep(of_edges(i, ea, j), best, found)) return false;
    return true;
  }

  // Faces over edges and a's faces over b's, unless the other is better by more than a tolerance;
  // what was chosen last time wins ties.
  AxisFound prefer(const AxisFound& face_a, const AxisFound& face_b, const AxisFound& edges) const {
    const Kind last = AxisName::unpack(query_.cache).kind;
    const float tolerance = 1e-3f * std::min(a_.size(), b_.size());
    const float for_a = last == kFaceOfB ? 0 : tolerance, for_b = tolerance - for_a;
    const AxisFound& face = face_b.separation + for_b > face_a.separation + for_a ? face_b : face_a;
    const float for_face = last == kEdges ? 0 : tolerance + 0.01f * std::fabs(face.separation);
    return edges.separation > face.separation + for_face ? edges : face;
  }

  const Polytope &a_, &b_;
  const Query& query_;
  M3f rotation_;  // axes of b in the frame of a
  V3f offset_;    // origin of b in the frame of a
};

// Nearest points of two crossing edges, kept on them.
void edge_contact(const AxisFound& axis, std::uint32_t feature, PointList& list) {
  const V3f &u = axis.along_a, &v = axis.along_b, between = axis.point_b - axis.point_a;
  const float uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
  const float scale = 1 / (uu * vv - uv * uv);
  const float s = (dot(between, u) * vv - dot(between, v) * uv) * scale;
  const float t = (dot(between, u) * uv - dot(between, v) * uu) * scale;
  const V3f pa = axis.point_a + u * std::clamp(s, 0.0f, 1.0f);
  const V3f pb = axis.point_b + v * std::clamp(t, 0.0f, 1.0f);
  list.add((pa + pb) * 0.5f, axis.separation, feature);
}

// Where the shapes meet beside the two faces (near a rim, edge against edge, with a face preferred),
// clipping may miss the deepest corner. (Not with triangles: that corner is their neighbours'.)
void add_deepest(const PlacedShape& incident, const AxisFound& axis, bool incident_is_b, float size,
                 PointList& list) {
  float deepest = 3e38f;
  for (const ContactPoint& point : list) deepest = std::min(deepest, point.separation);
  if (deepest <= axis.separation + 0.05f * std::fabs(axis.separation) + 2e-3f * size) return;
  const V3f toward = incident_is_b ? -axis.normal : axis.normal;
  const Corner corner = farthest_corner(incident, toward);
  list.add(corner.point + toward * (0.5f * axis.separation), axis.separation, corner.id);
}

void contact(const AxisFound& axis, const PlacedShape& a, const PlacedShape& b, const Query& query,
             float size, ContactPatch& patch) {
  PointList list(query, axis.normal);
  if (axis.name.kind == kEdges) {
    edge_contact(axis, axis.name.pack(), list);
  } else {
    Feature fa, fb;
    facing_feature(a, axis.normal, fa);
    facing_feature(b, -axis.normal, fb);
    const bool of_a = axis.name.kind == kFaceOfA;
    if (of_a)
      clip_against(fa, fb, axis.normal, true, list);
    else
      clip_against(fb, fa, -axis.normal, false, list);
    if (b.triangle == nullptr) add_deepest(of_a ? b : a, axis, of_a, size, list);
  }
  list.choose(patch);
}

// The cached axis is good enough while the shapes only just touch along it: no other axis can then
// be deeper by more than that. Half a centimetre for shapes of a metre.
constexpr float kCachedDepth = 0.01f;

}  // namespace

void polytope_polytope(const PlacedShape& a, const PlacedShape& b, Query& query,
                       ContactPatch& patch) {
  patch.count = 0;
  const Polytope pa(a), pb(b);
  const float size = std::min(pa.size(), pb.size());
  const SeparatingAxes axes(pa, pb, query);
  const AxisName name = AxisName::unpack(query.cache);
  if (name.kind != kNothing) {
    const AxisFound last = axes.recall(name);
    if (last.separation > query.margin) return;
    if (last.separation > -kCachedDepth * size) {
      contact(last, a, b, query, size, patch);
      if (patch.count >= (name.kind == kEdges ? 1u : 3u)) return;
      patch.count = 0;
    }
  }
  AxisFound found;
  const bool near = axes.search(found);
  query.cache = found.name.pack();
  if (near) contact(found, a, b, query, size, patch);
}

}  // namespace skerry::collision
