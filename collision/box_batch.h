// Sixteen box pairs side by side, as the box kernel takes and gives them.
#pragma once

#include <cstdint>

namespace skerry::collision {

struct BoxBatch {
  static constexpr int kSize = 16;  // lanes; every SIMD width divides it

  // Rows of inputs. Frame: world axes, origin at the centre of box a.
  enum In {
    kDx,
    kDy,
    kDz,  // m, centre of box b
    kQax,
    kQay,
    kQaz,
    kQaw,  // box axes in world axes
    kQbx,
    kQby,
    kQbz,
    kQbw,
    kHax,
    kHay,
    kHaz,  // m, half extents
    kHbx,
    kHby,
    kHbz,
    kVx,
    kVy,
    kVz,  // m/s and rad/s, see Query
    kWx,
    kWy,
    kWz,
    kDt,
    kSlop,
    kMargin,  // s, m, m
    kKind,    // the pair's last kind of contact: 0 none, else kOut kKindOut
    kInCount
  };
  // Rows of results. Of four points each: position, separation, feature; feature < 0: no point.
  enum Out {
    kNx,
    kNy,
    kNz,
    kKindOut,  // 1: a face of a, 2: a face of b, 3: two edges
    kApart,    // m: the boxes are apart by so much at least
    kPoints,
    kPx = 0,
    kPy,
    kPz,
    kSeparation,
    kFeature,
    kPointRows,
    kOutCount = kPoints + 4 * kPointRows
  };

  alignas(64) float in[kInCount][kSize];
  alignas(64) float out[kOutCount][kSize];
};

// Full manifolds of the first `count` pairs (lanes above it hold rubbish); the widest instruction
// set of this machine. Same bits as the reference.
//
//   Method   separating axes (15), then the incident face clipped against the reference face:
//            Gregorius, "Robust contact creation for physics simulations" (GDC 2015). Faces win over
//            edges, and the kind of contact of the last step over others, by a small tolerance.
void collide_boxes(BoxBatch& batch, int count);

// The same source with float for lanes.
void collide_boxes_reference(BoxBatch& batch, int count);

}  // namespace skerry::collision
