// Boxes and hulls, against each other and against triangles, by separating axes.
#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"
#include "collision/polytope_axes.h"
#include "collision/triangle_batch.h"

namespace skerry::collision {

using core::cross;
using core::dot;
using core::PolytopeMemory;
using core::RelativePose;
using core::transposed_times;

namespace {

// The last axis is kept without a search while no other can be better by more than this, as a part
// of the shapes' size: 2 mm for shapes of half a metre.
constexpr float kKeptAxis = 5e-3f;
// The last manifold is kept while no point has moved by more than this part of the shapes' size, nor by
// more than this part of the gap up to which points count: 0.4 mm for shapes of half a metre, 0.5 mm
// for large ones.
constexpr float kKeptManifold = 1e-3f, kKeptGap = 0.1f;
// While it is, no point may come nearer in the step by more than this part of that gap: what was left
// out as too far away cannot touch.
constexpr float kSlow = 0.05f;
// Axes that are better by no more than this part of the size tie with the preferred one.
constexpr float kTie = 1e-3f;
// Faces that look along an axis by cosines that differ by less than this do so alike (1 degree at 45).
constexpr float kSameSlope = 0.02f;

PolytopeLanes lanes_of(const PlacedShape& shape, BoxLanes& room) {
  if (shape.collider->type == ShapeType::box) return room.box(shape.collider->size);
  return shape.collider->hull->lanes->view;
}

float size_of(const PlacedShape& shape) {
  const V3f half = shape.collider->size;
  if (shape.collider->type == ShapeType::box) return std::max(half.x, std::max(half.y, half.z));
  return shape.collider->hull->lanes->view.size;
}
float radius_of(const PlacedShape& shape) {
  if (shape.collider->type == ShapeType::box) return core::length(shape.collider->size);
  return shape.collider->hull->lanes->view.radius;
}

// Two polytopes, and how they move in this step (see AxisQuery).
struct Approach {
  RelativePose pose;
  float size;      // m, of the smaller
  float radius_b;  // m
  V3f way;
  float spin;

  bool slow(const Query& query) const { return core::length(way) + spin <= kSlow * query.slop; }
};

// Upper bound of the way that any point of b has gone in a's frame since it was there. No separation
// along any direction can have changed by more.
float moved(const RelativePose& then, const Approach& now) {
  const M3f &r = now.pose.rotation, &s = then.rotation;
  const V3f turn[3] = {r.c0 - s.c0, r.c1 - s.c1, r.c2 - s.c2};
  const float squared = (dot(turn[0], turn[0]) + dot(turn[1], turn[1])) + dot(turn[2], turn[2]);
  return core::length(now.pose.offset - then.offset) + std::sqrt(squared) * now.radius_b;
}

Approach approach_of(const PlacedShape& a, const PlacedShape& b, const Query& query) {
  Approach now;
  now.pose.rotation = {transposed_times(a.axes, b.axes.c0), transposed_times(a.axes, b.axes.c1),
                       transposed_times(a.axes, b.axes.c2)};
  now.pose.offset = transposed_times(a.axes, b.center - a.center);
  now.size = std::min(size_of(a), size_of(b));
  const float radius_a = radius_of(a);
  now.radius_b = radius_of(b);
  // Points of a contact are no farther than this from the middle of the smaller shape.
  const float radius = std::min(radius_a, now.radius_b) + query.margin;
  const V3f middle = radius_a < now.radius_b ? a.center : b.center, w = query.angular;
  now.way = transposed_times(a.axes, query.linear + cross(w, middle)) * query.dt;
  // The 1-norm spares a root.
  now.spin = ((std::fabs(w.x) + std::fabs(w.y)) + std::fabs(w.z)) * (radius * query.dt);
  return now;
}

AxisQuery axis_query(const Approach& now, const PolytopeLanes& a, const PolytopeLanes& b,
                     const Query& query) {
  AxisQuery ask;
  ask.a = a;
  ask.b = b;
  ask.rotation = now.pose.rotation;
  ask.offset = now.pose.offset;
  ask.margin = query.margin;
  ask.way = now.way;
  ask.spin = now.spin;
  ask.slop = query.slop;
  ask.tolerance = kTie * now.size;
  return ask;
}

// The last manifold, gone with the shapes: its points on a stay there, those on b move with it. To
// first order that is what the features would give. False if the two have moved too far, or are
// about to.
bool take_along(const PlacedShape& a, const Approach& now, const Query& query,
                ContactPatch& patch) {
  const PolytopeMemory& memory = *query.memory;
  if (!now.slow(query) || moved(memory.made_at, now) > memory.budget) return false;
  const M3f &r = now.pose.rotation, &then = memory.made_at.rotation;
  const M3f turn = {r * V3f{then.c0.x, then.c1.x, then.c2.x},
                    r * V3f{then.c0.y, then.c1.y, then.c2.y},
                    r * V3f{then.c0.z, then.c1.z, then.c2.z}};
  const V3f normal = memory.turns_with_b ? turn * memory.normal : memory.normal;
  PointList list(query, a.axes * normal);
  for (std::uint32_t i = 0; i < memory.point_count; ++i) {
    const PolytopeMemory::Point& point = memory.points[i];
    const V3f was_on_b = point.on_a + memory.normal * point.separation;
    const V3f on_b = turn * (was_on_b - memory.made_at.offset) + now.pose.offset;
    const V3f middle = (point.on_a + on_b) * 0.5f;
    list.add(a.center + a.axes * middle, dot(normal, on_b - point.on_a), memory.feature[i]);
  }
  list.choose(patch);
  return patch.count > 0;
}

// `slack`: m, by which an axis may be better than the manifold's until it is looked for.
void remember(const ContactPatch& patch, const PlacedShape& a, const Approach& now, float slack,
              bool of_b, const Query& query) {
  PolytopeMemory& memory = *query.memory;
  memory.budget = -1;
  if (patch.count == 0 || !now.slow(query)) return;
  memory.made_at = now.pose;
  // Both the manifold's axis and the best may change by the way.
  memory.budget = std::min(0.5f * slack, std::min(kKeptManifold * now.size, kKeptGap * query.slop));
  memory.point_count = patch.count;
  memory.normal = transposed_times(a.axes, patch.normal);
  memory.turns_with_b = of_b;
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    const ContactPoint& point = patch.points[i];
    const V3f on_a = point.position - patch.normal * (0.5f * point.separation);
    memory.points[i] = {transposed_times(a.axes, on_a - a.center), point.separation};
    memory.feature[i] = point.feature;
  }
}

// Faces over edges and a's faces over b's, unless the other is better by more than a tolerance;
// what was chosen last time wins ties.
Axis prefer(const AxisAnswer& answer, AxisName::Kind last, float tolerance) {
  const float for_a = last == AxisName::kFaceOfB ? 0 : tolerance, for_b = tolerance - for_a;
  const bool of_b = answer.face_b.separation + for_b > answer.face_a.separation + for_a;
  const Axis& face = of_b ? answer.face_b : answer.face_a;
  const float for_face =
      last == AxisName::kEdges ? 0 : tolerance + 0.01f * std::fabs(face.separation);
  return answer.edges.separation > face.separation + for_face ? answer.edges : face;
}

// An axis in world axes.
struct AxisFound {
  AxisName name;
  float separation;
  V3f normal;                              // from a to b
  V3f point_a, along_a, point_b, along_b;  // edges only
};

// `point_b` and `along_b` of the edge of b are known.
void place_edges(std::uint32_t edge_of_a, const PlacedShape& a, const PolytopeLanes& lanes_a,
                 AxisFound& found) {
  found.point_a = a.center + a.axes * lanes_a.edge(PolytopeLanes::kTail, edge_of_a);
  found.along_a = a.axes * lanes_a.edge(PolytopeLanes::kAlong, edge_of_a);
  const V3f out = a.axes * (lanes_a.edge(PolytopeLanes::kLeft, edge_of_a) +
                            lanes_a.edge(PolytopeLanes::kRight, edge_of_a));
  found.normal = direction(cross(found.along_a, found.along_b), direction(out, {0, 1, 0}));
  if (dot(found.normal, out) < 0) found.normal = -found.normal;
}

AxisFound placed(const Axis& axis, const PlacedShape& a, const PlacedShape& b,
                 const AxisQuery& query) {
  AxisFound found;
  found.name = axis.name;
  found.separation = axis.separation;
  if (axis.name.kind == AxisName::kEdges) {
    found.point_b = b.center + b.axes * query.b.edge(PolytopeLanes::kTail, axis.name.b);
    found.along_b = b.axes * query.b.edge(PolytopeLanes::kAlong, axis.name.b);
    place_edges(axis.name.a, a, query.a, found);
  } else if (axis.name.kind == AxisName::kFaceOfA) {
    found.normal = a.axes * query.a.face_normal(axis.name.a);
  } else {
    found.normal = -(b.axes * query.b.face_normal(axis.name.b));
  }
  return found;
}

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

// Does a point show, up to a tolerance, how deep the shapes lie in each other?
bool has_deepest(PointList& list, const AxisFound& axis, float tolerance) {
  float deepest = 3e38f;
  for (const ContactPoint& point : list) deepest = std::min(deepest, point.separation);
  return deepest <= axis.separation + tolerance;
}

// Of the two faces beside an edge the one that looks more along a direction; the one of last time while
// the other does so hardly more. Returns whether it is the left one.
bool face_beside(const PlacedShape& shape, std::uint32_t edge, const V3f& toward, bool was_left,
                 Feature& feature) {
  if (shape.collider->type != ShapeType::hull) {
    facing_feature(shape, toward, feature);
    return was_left;
  }
  const core::HullGeometry& hull = *shape.collider->hull;
  const core::HullGeometry::Edge& sides = hull.edges[edge];
  const V3f d = transposed_times(shape.axes, toward);
  const float left_looks = dot(d, hull.faces[sides.left_face].normal);
  const float right_looks = dot(d, hull.faces[sides.right_face].normal);
  const bool left = left_looks + (was_left ? kSameSlope : -kSameSlope) >= right_looks;
  face_feature(shape, left ? sides.left_face : sides.right_face, feature);
  return left;
}

// Two edges that cross, and what of the faces beside them lies nearly as deep: where these are almost
// at right angles to the axis, other edges meet along almost the same one, and the point of a single
// pair of edges would jump from one end of the contact to the other. (Not with
// triangles: their neighbours hold what lies beside.)
void edges_and_faces(const AxisFound& axis, const PlacedShape& a, const PlacedShape& b, float size,
                     PolytopeMemory& last, PointList& list) {
  if (b.triangle == nullptr) {
    Feature face_a, face_b;
    last.left_of_a = face_beside(a, axis.name.a, axis.normal, last.left_of_a, face_a);
    last.left_of_b = face_beside(b, axis.name.b, -axis.normal, last.left_of_b, face_b);
    clip_features(face_a, face_b, axis.normal, list);
    // A face that slopes and is cut a little beyond its rim seems deeper there than the edge is.
    for (ContactPoint& point : list) point.separation = std::max(point.separation, axis.separation);
    if (has_deepest(list, axis, kTie * size)) return;
  }
  edge_contact(axis, axis.name.pack(), list);
}

// Where the shapes meet beside the two faces (near a rim, edge against edge, with a face preferred),
// clipping may miss the deepest corner.
void add_deepest(const PlacedShape& incident, const AxisFound& axis, bool incident_is_b, float size,
                 PointList& list) {
  if (has_deepest(list, axis, 0.01f * std::fabs(axis.separation) + 2e-3f * size)) return;
  const V3f toward = incident_is_b ? -axis.normal : axis.normal;
  const Corner corner = farthest_corner(incident, toward);
  list.add(corner.point + toward * (0.5f * axis.separation), axis.separation, corner.id);
}

void reference_face(const PlacedShape& shape, std::uint32_t face, const V3f& outward,
                    Feature& feature) {
  if (shape.collider->type == ShapeType::hull)
    face_feature(shape, face, feature);
  else
    facing_feature(shape, outward, feature);
}

void contact(const AxisFound& axis, const PlacedShape& a, const PlacedShape& b, const Query& query,
             float size, ContactPatch& patch) {
  PointList list(query, axis.normal);
  if (axis.name.kind == AxisName::kEdges) {
    edges_and_faces(axis, a, b, size, *query.memory, list);
  } else {
    const bool of_a = axis.name.kind == AxisName::kFaceOfA;
    const V3f outward = of_a ? axis.normal : -axis.normal;
    Feature reference, incident;
    reference_face(of_a ? a : b, of_a ? axis.name.a : axis.name.b, outward, reference);
    facing_feature(of_a ? b : a, -outward, incident);
    clip_against(reference, outward, incident, outward, of_a, list);
    add_deepest(of_a ? b : a, axis, of_a, size, list);
  }
  list.choose(patch);
}

}  // namespace

void polytope_polytope(const PlacedShape& a, const PlacedShape& b, Query& query,
                       ContactPatch& patch) {
  patch.count = 0;
  const Approach now = approach_of(a, b, query);
  PolytopeMemory& memory = *query.memory;
  const AxisName last = AxisName::unpack(query.cache);
  if (last.kind != AxisName::kNothing && take_along(a, now, query, patch)) return;

  BoxLanes room_a, room_b;
  AxisQuery ask = axis_query(now, lanes_of(a, room_a), lanes_of(b, room_b), query);
  const auto make = [&](const Axis& axis, float best) {
    contact(placed(axis, a, b, ask), a, b, query, now.size, patch);
    remember(patch, a, now, kKeptAxis * now.size - (best - axis.separation),
             axis.name.kind == AxisName::kFaceOfB, query);
  };
  if (last.kind == AxisName::kNothing) {
    memory.left_of_a = memory.left_of_b = true;
  } else {
    ask.recalled = recall_axis(ask, last);
    query.apart = ask.recalled.separation;
    if (parts(ask, ask.recalled)) return;
    const float best = memory.separation + moved(memory.searched_at, now);
    if (ask.recalled.separation > best - kKeptAxis * now.size) return make(ask.recalled, best);
  }
  AxisAnswer answer;
  search_axes(ask, answer);
  if (answer.apart.name.kind != AxisName::kNothing) {
    query.cache = answer.apart.name.pack();
    query.apart = answer.apart.separation;
    // Nothing is known of the other axes: this one is good only while it parts the shapes.
    memory.separation = 3e38f;
    memory.budget = -1;
    return;
  }
  const Axis chosen = prefer(answer, last.kind, ask.tolerance);
  query.cache = chosen.name.pack();
  memory.searched_at = now.pose;
  memory.separation = std::max(answer.face_a.separation,
                               std::max(answer.face_b.separation, answer.edges.separation));
  make(chosen, memory.separation);
}

void prepare_search(const PlacedShape& a, float margin, BoxLanes& room, TriangleSearch& search) {
  search.a = lanes_of(a, room);
  search.axes = a.axes;
  search.rotation = {transposed_times(a.axes, {1, 0, 0}), transposed_times(a.axes, {0, 1, 0}),
                     transposed_times(a.axes, {0, 0, 1})};
  search.offset = transposed_times(a.axes, -a.center);
  search.center = -transposed_times(search.rotation, search.offset);
  search.margin = margin;
  search.tie = kTie;
  search.face_normals.clear();
  for (std::uint32_t i = 0; i < search.a.face_count; ++i)
    search.face_normals.push_back(a.axes * search.a.face_normal(i));
  search.edges.clear();
  for (std::uint32_t i = 0; i < search.a.edge_count; ++i) {
    const auto edge = [&](PolytopeLanes::EdgeRow row) { return a.axes * search.a.edge(row, i); };
    const V3f tail =
        transposed_times(search.rotation, search.a.edge(PolytopeLanes::kTail, i) - search.offset);
    const V3f left = edge(PolytopeLanes::kLeft), right = edge(PolytopeLanes::kRight);
    search.edges.push_back(
        {tail, edge(PolytopeLanes::kAlong), left, right, dot(left, tail), dot(right, tail)});
  }
}

void clip_face(const PlacedShape& a, std::uint32_t face, const V3f& normal, ClipFace& clip) {
  // How far outside the face a triangle may lie and still count as inside, as a part of its size.
  constexpr float kTolerance = 1e-3f;
  Feature feature;
  reference_face(a, face, normal, feature);
  clip.normal = normal;
  clip.u = direction(feature.points[1] - feature.points[0], perpendicular(normal));
  clip.v = cross(normal, clip.u);
  clip.offset = dot(normal, feature.points[0]);
  clip.count = feature.count;
  float squared = 0;
  for (std::uint32_t i = 0; i < feature.count; ++i) {
    clip.corners[i] = feature.points[i];
    clip.ids[i] = feature.ids[i];
    clip.x[i] = dot(clip.u, feature.points[i]);
    clip.y[i] = dot(clip.v, feature.points[i]);
    const V3f r = feature.points[i] - feature.points[0];
    squared = std::max(squared, dot(r, r));
  }
  const float outside = kTolerance * std::sqrt(squared);
  for (std::uint32_t i = 0; i < feature.count; ++i) {
    const std::uint32_t next = i + 1 < feature.count ? i + 1 : 0;
    const float x = clip.x[next] - clip.x[i], y = clip.y[next] - clip.y[i];
    const float scale = 1 / std::max(std::sqrt(x * x + y * y), 1e-30f);
    clip.side_x[i] = y * scale;
    clip.side_y[i] = -x * scale;
    clip.side_offset[i] = (clip.side_x[i] * clip.x[i] + clip.side_y[i] * clip.y[i]) + outside;
  }
}

void edge_triangle(const PlacedShape& a, const PlacedShape& b, const TriangleSearch& search,
                   const TriangleAxes& axes, int lane, const Query& query, ContactPatch& patch) {
  const Triangle& triangle = *b.triangle;
  const auto edges = static_cast<std::uint32_t>(axes.edges_index[lane]);
  AxisFound found;
  found.name = {AxisName::kEdges, edges / 3, edges % 3};
  found.separation = axes.edges[lane];
  found.point_b = triangle.corner[edges % 3];
  found.along_b = triangle.corner[(edges % 3 + 1) % 3] - triangle.corner[edges % 3];
  place_edges(edges / 3, a, search.a, found);
  PointList list(query, found.normal);
  edge_contact(found, found.name.pack(), list);
  list.choose(patch);
}

}  // namespace skerry::collision
