// The separating-axis search between two convex polytopes, over lanes of faces and edges.
#pragma once

#include "collision/polytope_lanes.h"

namespace skerry::collision {

// Names a separating axis: a face, or an edge of each.
struct AxisName {
  enum Kind : std::uint32_t { kNothing, kFaceOfA, kFaceOfB, kEdges };
  Kind kind = kNothing;
  std::uint32_t a = 0, b = 0;

  // Indices above 32,767 come back as others; what is recalled is tested, so that costs time only.
  std::uint32_t pack() const { return kind | (a & 0x7fffu) << 2 | (b & 0x7fffu) << 17; }
  static AxisName unpack(std::uint32_t bits) {
    return {static_cast<Kind>(bits & 3u), bits >> 2 & 0x7fffu, bits >> 17};
  }
};

struct Axis {
  AxisName name;
  float separation = -3e38f;  // m, along it; negative: overlap
};

struct AxisQuery {
  PolytopeLanes a, b;
  core::M3f rotation;  // axes of b in the frame of a
  core::V3f offset;    // origin of b in the frame of a
  float margin = 0;    // m: beyond this separation the search ends, as where an axis parts the two
  // How b's points move in this step, in a's frame: by `way` (m), and turning adds at most `spin` (m).
  // An axis along which the two will not come as near as `slop` (m) parts them to the end of the step,
  // whatever other axes foresee.
  core::V3f way{0, 0, 0};
  float spin = 0;
  float slop = 3e38f;
  float tolerance = 0;  // m: edges are of interest if they reach the best face less this
  // The axis of last time, as recall_axis found it. Edges of less separation are not looked for.
  Axis recalled;
};

struct AxisAnswer {
  Axis apart;                  // an axis that parts the two, if one was met; the search ended there
  Axis face_a, face_b, edges;  // the best of each kind; lowest index among equals
};

// The unit direction of an axis in a's frame, from a to b.
core::V3f axis_normal(const AxisQuery& query, const AxisName& name);

// Does an axis part the shapes to the end of the step?
bool parts(const AxisQuery& query, const Axis& axis);

// The named axis as the shapes are now: nothing if they have no such axis.
Axis recall_axis(const AxisQuery& query, const AxisName& name);

//   Method   all faces of a and of b; of the pairs of edges those that are arcs crossing on the Gauss
//            map (Gregorius, "The separating axis test between convex polyhedra", GDC 2013), and of
//            those only edges that can reach beyond the best face: along the arc between the normals
//            l and r of an edge's faces, the separation is at most max(l.w, r.w) less their offsets
//            for any point w of the other shape, if that is negative.
//   Bits     the same for every instruction set.
void search_axes(const AxisQuery& query, AxisAnswer& answer);

// The face whose normal is nearest to a direction of the shape's frame; lowest index among equals.
std::uint32_t facing_face(const PolytopeLanes& shape, const core::V3f& toward);

// The same source with float for lanes.
std::uint32_t facing_face_reference(const PolytopeLanes& shape, const core::V3f& toward);
Axis recall_axis_reference(const AxisQuery& query, const AxisName& name);
void search_axes_reference(const AxisQuery& query, AxisAnswer& answer);

}  // namespace skerry::collision
