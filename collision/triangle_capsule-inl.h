// A capsule against triangles, written once for any lane type. Included once per instruction set,
// after triangle_clip-inl.h, so no include guard.

template <class L>
struct SegmentLanes {
  Vec<L> tail, along;
  Vec<L> at(L part) const { return tail + along * part; }
};

// The nearest points of a segment and triangles.
template <class L>
struct NearestPair {
  Vec<L> on_segment, on_triangle;
  L squared;

  void consider(const Vec<L>& p, const Vec<L>& q) {
    const L distance = dot(p - q, p - q);
    const typename L::Mask nearer = distance < squared;
    on_segment = select(nearer, p, on_segment);
    on_triangle = select(nearer, q, on_triangle);
    squared = select(nearer, distance, squared);
  }
  // Two segments (Ericson, 5.1.9).
  void consider(const SegmentLanes<L>& a, const SegmentLanes<L>& b) {
    const Vec<L>&u = a.along, &v = b.along, r = a.tail - b.tail;
    const L uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
    const L denominator = uu * vv - uv * uv;
    const typename L::Mask crossing = denominator > L(1e-7f) * uu * vv;
    const L part = clamped((uv * vr - ur * vv) / denominator);
    const Vec<L> on_b = nearest_on_segment(b.tail, v, a.at(select(crossing, part, L(0.5f))));
    consider(nearest_on_segment(a.tail, u, on_b), on_b);
  }
};
template <class L>
NearestPair<L> nearest_to_segment(const TriangleLanes<L>& t, const SegmentLanes<L>& segment) {
  const Vec<L> head = segment.at(L(1.0f));
  NearestPair<L> nearest = {segment.tail, nearest_on_triangles(t, segment.tail).point, L(3e38f)};
  nearest.consider(segment.tail, nearest.on_triangle);
  nearest.consider(head, nearest_on_triangles(t, head).point);
  for (int i = 0; i < 3; ++i) nearest.consider(segment, SegmentLanes<L>{t.corner[i], t.edge[i]});
  return nearest;
}

template <class L>
typename L::Mask pierces(const TriangleLanes<L>& t, const SegmentLanes<L>& segment) {
  const L zero = L(0.0f);
  const L h0 = dot(t.normal, segment.tail - t.corner[0]);
  const L h1 = dot(t.normal, segment.at(L(1.0f)) - t.corner[0]);
  const typename L::Mask below0 = h0 < zero, below1 = h1 < zero;
  return ((below0 & !below1) | (below1 & !below0)) & !beside_face(t, segment.at(h0 / (h0 - h1)));
}

// The stretch of a segment that lies over the faces, in parts of its length: none if low > high.
template <class L>
struct OverFace {
  L low, high;
};
template <class L>
OverFace<L> stretch_over_face(const TriangleLanes<L>& t, const SegmentLanes<L>& segment) {
  const L zero = L(0.0f), one = L(1.0f);
  OverFace<L> over = {zero, one};
  for (int i = 0; i < 3; ++i) {
    const Vec<L> inward = cross(t.normal, t.edge[i]);
    const L height = dot(inward, segment.tail - t.corner[i]), slope = dot(inward, segment.along);
    const typename L::Mask up = slope > zero, down = slope < zero;
    const L at = -height / select(up | down, slope, one);
    over.low = select(up & (at > over.low), at, over.low);
    over.high = select(down & (at < over.high), at, over.high);
    over.low = select(!(up | down) & (height < zero), L(3.0f), over.low);
  }
  return over;
}

template <class L>
void touch_triangle_lanes(const CapsuleAxis& capsule, float margin, const ClipQuery& query,
                          unsigned lanes, const TriangleBatch& batch, TriangleClips& clips) {
  using Clips = TriangleClips;
  for (const int i : {Clips::kLow, Clips::kHigh, Clips::kNearest}) clips.valid[i] = 0;
  const L zero = L(0.0f), radius = L(capsule.radius), half = L(0.5f);
  const SegmentLanes<L> segment = {spread<L>(capsule.tail), spread<L>(capsule.along)};
  for (int k = 0; k < TriangleBatch::kSize; k += L::kLanes) {
    if ((lanes >> k & ((1u << L::kLanes) - 1)) == 0) continue;
    TriangleLanes<L> t;
    load_triangles(batch, k, t);
    const L lower = min(dot(t.normal, segment.tail - t.corner[0]),
                        dot(t.normal, segment.at(L(1.0f)) - t.corner[0]));
    const typename L::Mask far = lower - radius > L(margin);
    if (all(far)) continue;
    const NearestPair<L> nearest = nearest_to_segment(t, segment);
    const Vec<L> out = unit(nearest.on_segment - nearest.on_triangle, t.normal);
    const typename L::Mask on_face = pierces(t, segment) | (dot(out, t.normal) > L(0.999f));
    LeanLimits<L> limits;
    lean_limits(batch, k, t, limits);
    const typename L::Mask touchable = (on_face | may_lean(limits, out)) & !far;
    const Vec<L> up = select(on_face, t.normal, out), along = Vec<L>{zero, zero, zero} - up;
    store_normal(along, k, clips);
    const Approach<L> approach = approach_along(query, along);
    const auto put = [&](const Vec<L>& on_axis, L separation, typename L::Mask valid,
                         int index) SKERRY_LANES {
      store_candidate(approach, query, on_axis - up * (radius + half * separation), separation,
                      zero, valid, k, lanes, index, clips);
    };
    const OverFace<L> over = stretch_over_face(t, segment);
    const auto put_end = [&](L part, typename L::Mask valid, int index) SKERRY_LANES {
      const Vec<L> p = segment.at(part);
      put(p, dot(t.normal, p - t.corner[0]) - radius, touchable & on_face & valid, index);
    };
    put_end(over.low, !(over.low > over.high), Clips::kLow);
    put_end(over.high, !(over.high - over.low < L(1e-4f)), Clips::kHigh);
    put(nearest.on_segment, square_root(nearest.squared) - radius, touchable & !on_face,
        Clips::kNearest);
  }
}
