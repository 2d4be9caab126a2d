// Kernels of the narrowphase: one pair of shapes in, at most four contact points out.
//
//   Frame    world axes; the origin is the centre of mass of body a, so that single precision holds
//            far from the world's origin.
//   Normals  unit, from the first shape to the second. Points halfway between the surfaces.
//   Threads  pure functions.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "collision/broadphase.h"
#include "collision/triangle_batch.h"
#include "core/colliders.h"
#include "core/contacts.h"
#include "core/vec.h"

namespace skerry::collision {

using core::Collider;
using core::M3f;
using core::ShapeType;
using core::V3f;

// A triangle of a mesh. Its frame has world axes.
struct Triangle {
  V3f corner[3];  // m, counter-clockwise seen from the front
  V3f normal;     // unit, to the front
  // Edge i runs from corner i to the next one. Only convex and border edges may be touched; their
  // contact normals lie between the triangle's own and `beyond`: the neighbour's, or at a border
  // the direction away from the edge in the triangle's plane.
  bool touchable[3];
  V3f beyond[3];
};

struct PlacedShape {
  const Collider* collider = nullptr;  // null: a triangle
  const Triangle* triangle = nullptr;
  V3f center{0, 0, 0};  // m, origin of the shape frame
  M3f axes{};           // columns: axes of the shape frame
  float height = 0;     // m, planes only: of the other shape's centre over the plane, from doubles
};

inline bool is_polytope(const PlacedShape& shape) {
  return shape.collider->type == ShapeType::box || shape.collider->type == ShapeType::hull;
}

// What of a pair is not its shapes: how far to look, how the two move, what was chosen last time.
// The second shape's velocity relative to the first at the place p is linear + angular x p.
struct Query {
  V3f linear{0, 0, 0};                  // m/s
  V3f angular{0, 0, 0};                 // rad/s
  float dt = 0;                         // s
  float slop = kSpeculativeDistance;    // m: gap at the end of the step up to which a point counts
  float margin = kSpeculativeDistance;  // m: gap beyond which no point can close to `slop`
  float touch = 3e38f;                  // m: gap up to which a fast pair touches; else no limit
  std::uint32_t cache = 0;              // ContactPair::cache
  core::PolytopeMemory* memory = nullptr;  // of two polytopes
  // m, set by kernels that know: if there is no contact, the shapes are apart by so much at least.
  float apart = 0;

  float normal_velocity(const V3f& position, const V3f& normal) const {
    return core::dot(normal, linear + core::cross(angular, position));
  }
  // Separation at the end of the step; what now departs counts as staying.
  float predicted(const V3f& position, const V3f& normal, float separation) const {
    const float vn = normal_velocity(position, normal);
    return separation + dt * (vn < 0 ? vn : 0);
  }
};

struct ContactPoint {
  V3f position;
  float separation;
  std::uint32_t feature;
};

// Points that share a normal.
struct ContactPatch {
  static constexpr std::uint32_t kMaxPoints = 4;
  V3f normal{0, 1, 0};
  std::uint32_t count = 0;
  ContactPoint points[kMaxPoints];
};

// Candidates from which a patch is chosen; those that cannot touch within the step are left out.
class PointList {
 public:
  static constexpr std::uint32_t kCapacity = 64;

  PointList(const Query& query, const V3f& normal)
      : query_(query),
        normal_(normal),
        speed_(core::dot(normal, query.linear)),
        gradient_(core::cross(normal, query.angular)) {}
  void add(const V3f& position, float separation, std::uint32_t feature) {
    const float vn = speed_ + core::dot(gradient_, position);
    // Negated, so that NaN is left out.
    if (!(separation + query_.dt * (vn < 0 ? vn : 0) <= query_.slop)) return;
    if (count_ < kCapacity) points_[count_++] = {position, separation, feature};
  }
  std::uint32_t size() const { return count_; }
  ContactPoint* begin() { return points_; }
  ContactPoint* end() { return points_ + count_; }
  // At most four: a deep one, the one farthest from it, and those that span the largest area. All
  // of them if there are no more than four.
  void choose(ContactPatch& patch) const;

 private:
  const Query& query_;
  V3f normal_;
  float speed_;   // m/s, normal velocity at the frame's origin
  V3f gradient_;  // 1/s, of the normal velocity over places
  std::uint32_t count_ = 0;
  ContactPoint points_[kCapacity];
};

// A patch of one point, or of none if it cannot touch within the step.
void single_point(const Query& query, const V3f& normal, const V3f& position, float separation,
                  std::uint32_t feature, ContactPatch& patch);

// The first point of a patch is a deep one, but at rest all are equally deep up to rounding: among
// those the farthest along this fixed direction is taken, so that the choice does not flicker.
inline constexpr V3f kPreferred{0.6f, 0.2f, 0.77f};

// Chooses at most four of `count` points (see PointList::choose).
void choose_points(const ContactPoint* points, std::uint32_t count, const V3f& normal,
                   ContactPatch& patch);

// A unit vector along v, or `otherwise` if v is too short to have a direction.
inline V3f direction(const V3f& v, const V3f& otherwise) {
  const float squared = core::dot(v, v);
  if (!(squared > 1e-30f)) return otherwise;
  return v * (1 / std::sqrt(squared));
}
// Some unit vector at right angles to a unit vector; continuous except near one great circle.
V3f perpendicular(const V3f& unit);

// -- Closed forms (Ericson, "Real-Time Collision Detection", 2005, chapter 5).
void sphere_sphere(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);
void sphere_capsule(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);
void sphere_box(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);
void sphere_hull(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);
void capsule_capsule(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);
void capsule_box(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);

// The face, edge or vertex of a convex shape that looks in a direction, with rims of discs as
// polygons. Counter-clockwise seen from outside.
struct Feature {
  static constexpr std::uint32_t kMaxPoints = 24;
  std::uint32_t count = 0;
  V3f points[kMaxPoints];
  std::uint16_t ids[kMaxPoints];  // the same for the same place of the shape
};
void facing_feature(const PlacedShape& shape, const V3f& toward, Feature& feature);
// One face of a hull.
void face_feature(const PlacedShape& hull, std::uint32_t face, Feature& feature);

// How far a convex shape reaches from its frame's origin along a direction (of any length).
float extent(const PlacedShape& shape, const V3f& along);

// A point that a cylinder, cone or ellipsoid reaches farthest with along a direction.
V3f farthest_point(const PlacedShape& shape, const V3f& along);

// The vertex of a box or hull that reaches farthest along a direction; id as in facing_feature.
struct Corner {
  V3f point;
  std::uint16_t id;
};
Corner farthest_corner(const PlacedShape& shape, const V3f& along);

// The stretch of one feature that lies over the other, seen along `normal` (from a to b), with its
// separations. Needs a polygon or two lines; adds nothing else.
void clip_features(const Feature& a, const Feature& b, const V3f& normal, PointList& list);
// The same with the polygon of one side (`a_is_reference`) given as the plane to measure from; `face`
// is its normal, which need not be quite the contact's, `outward`.
void clip_against(const Feature& reference, const V3f& face, const Feature& incident,
                  const V3f& outward, bool a_is_reference, PointList& list);

// Any convex shape against a plane: the points of its feature that faces the plane.
void convex_plane(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);

// Boxes and hulls: separating axes of faces and edges (those that are arcs crossing on the Gauss
// map: Gregorius, "The separating axis test between convex polyhedra", GDC 2013), then face
// clipping. Remembers the separating feature in Query::cache and what else Query::memory holds; while
// the two have hardly moved the last manifold goes with them.
void polytope_polytope(const PlacedShape& a, const PlacedShape& b, Query& query,
                       ContactPatch& patch);
// A box or hull against many triangles: what does not depend on the triangle, for search_triangles
// (the search holds on to `room` and to the hull); a face, for clip_triangles; and the contact with a
// triangle whose contact takes a pair of edges, which comes second.
void prepare_search(const PlacedShape& a, float margin, BoxLanes& room, TriangleSearch& search);
void clip_face(const PlacedShape& a, std::uint32_t face, const V3f& normal, ClipFace& clip);
void edge_triangle(const PlacedShape& a, const PlacedShape& b, const TriangleSearch& search,
                   const TriangleAxes& axes, int lane, const Query& query, ContactPatch& patch);

// May a contact push away from a triangle this way? `out`: unit, from the triangle to the other
// shape. Over an edge it may lean only if that is touchable, and no farther than `beyond`.
bool leans_too_far(const Triangle& triangle, const V3f& out);

// Is a point over the triangle's face or below it?
bool over_face(const Triangle& triangle, const V3f& point);

// Outward normal of the flat end of a cylinder or cone: 0 at -y, 1 at +y.
V3f cap_normal(const PlacedShape& shape, std::uint32_t index);

// Any two convex shapes but planes. Remembers the normal in Query::cache. Returns false if no
// direction could be found (values that are not finite).
bool convex_convex(const PlacedShape& a, const PlacedShape& b, Query& query, ContactPatch& patch);

}  // namespace skerry::collision
