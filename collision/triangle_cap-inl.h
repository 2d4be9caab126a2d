// The flat end of a cylinder or cone against triangles, written once for any lane type. Included once
// per instruction set, after triangle_capsule-inl.h, so no include guard.

// A direction split along a shape's y axis.
template <class L>
struct SplitLanes {
  L along, across;  // cosine and sine of the angle with the axis
  Vec<L> radial;    // unit, at right angles to the axis
};
template <class L>
SplitLanes<L> split(const CappedShape& shape, const Vec<L>& toward) {
  const Vec<L> axis = spread<L>(shape.axes.c1);
  const L along = dot(axis, toward);
  const Vec<L> rest = toward - axis * along;
  const Vec<L> radial = unit(rest, spread<L>(shape.axes.c0));
  return {along, dot(rest, radial), radial};
}

// Does a point of the shape that reaches farthest along a split direction lie over the triangle's face
// or below it?
template <class L>
typename L::Mask meets_face(const CappedShape& shape, const TriangleLanes<L>& t,
                            const SplitLanes<L>& s) {
  const L half = L(shape.half_height), radius = L(shape.radius);
  const Vec<L> center = spread<L>(shape.center), axis = spread<L>(shape.axes.c1);
  const typename L::Mask at_top =
      shape.pointed ? (half + half) * s.along > radius * s.across : s.along > L(0.0f);
  const Vec<L> rim = s.radial * radius;
  Vec<L> farthest = center + axis * select(at_top, half, -half);
  farthest = shape.pointed ? select(at_top, farthest, farthest + rim) : farthest + rim;
  return !beside_face(t, farthest);
}

// How far the shape reaches from its centre along a split unit direction.
template <class L>
L extent(const CappedShape& shape, const SplitLanes<L>& s) {
  const L up = L(shape.half_height) * s.along, out = L(shape.radius) * s.across;
  return shape.pointed ? max(up, out - up) : out + abs(up);
}

template <class L>
CapLanes cap_triangle_lanes(const CappedShape& shape, float margin, unsigned lanes,
                            const TriangleBatch& batch, TriangleAxes& axes) {
  // Beyond 30 degrees off the triangle it is the rim that touches.
  const L least_facing = L(0.866f);
  // A triangle that is parallel to the cap is as near everywhere.
  const L parallel = L(0.99999f);
  const L tie = L(1e-3f) * L(shape.radius);
  const L zero = L(0.0f), one = L(1.0f);
  const Vec<L> center = spread<L>(shape.center), axis = spread<L>(shape.axes.c1);
  CapLanes result;
  for (int k = 0; k < TriangleBatch::kSize; k += L::kLanes) {
    if ((lanes >> k & ((1u << L::kLanes) - 1)) == 0) continue;
    TriangleLanes<L> t;
    load_triangles(batch, k, t);
    const typename L::Mask top = dot(axis, t.normal) < zero;
    const Vec<L> down = Vec<L>{zero, zero, zero} - t.normal;
    const Vec<L> normal = axis * select(top, one, L(-1.0f));
    const L facing = dot(normal, down);
    typename L::Mask sees = !(facing < least_facing);
    if (shape.pointed) sees = sees & !top;
    Vec<L> nearest = t.corner[0] - center;
    for (int i = 1; i < 3; ++i) {
      const Vec<L> corner = t.corner[i] - center;
      nearest = select(dot(normal, corner) < dot(normal, nearest), corner, nearest);
    }
    const L along = dot(normal, nearest), separation = along - L(shape.half_height);
    const Vec<L> across = nearest - normal * along;
    const SplitLanes<L> s = split(shape, down);
    const L of_face = dot(t.normal, center - t.corner[0]) - extent(shape, s);
    const typename L::Mask within_rim =
        (facing > parallel) | (dot(across, across) < L(shape.radius * shape.radius));
    const typename L::Mask on_cap = within_rim & (separation > of_face - tie);
    LeanLimits<L> limits;
    lean_limits(batch, k, t, limits);
    const Vec<L> away = Vec<L>{zero, zero, zero} - normal;
    const typename L::Mask along_cap = on_cap & may_lean(limits, away);
    const typename L::Mask lies =
        on_cap | (limits.untouchable[0] & limits.untouchable[1] & limits.untouchable[2]);
    const typename L::Mask near = !(sees & (separation > L(margin)));
    result.near |= bits(near) << k;
    result.flat |= bits(near & sees & lies & !meets_face(shape, t, s)) << k;
    select(along_cap, zero, one).store(axes.of_b + k);
    select(top, one, zero).store(axes.facing + k);
  }
  result.near &= lanes;
  result.flat &= lanes;
  return result;
}
