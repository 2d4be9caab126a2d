// The triangle kernels, written once for any lane type. Included once per instruction set, after
// axis_lanes-inl.h, so no include guard.

template <class L>
Vec<L> rotated(const core::M3f& m, const Vec<L>& v) {
  return (spread<L>(m.c0) * v.x + spread<L>(m.c1) * v.y) + spread<L>(m.c2) * v.z;
}
template <class L>
Vec<L> unit(const Vec<L>& v, const Vec<L>& otherwise) {
  const L squared = dot(v, v);
  const typename L::Mask good = squared > L(1e-30f);
  return select(good, v * (L(1.0f) / square_root(select(good, squared, L(1.0f)))), otherwise);
}

template <class L>
Vec<L> load_row(const TriangleBatch& batch, int row, int k) {
  return {L::load(batch.rows[row] + k), L::load(batch.rows[row + 1] + k),
          L::load(batch.rows[row + 2] + k)};
}
template <class L>
void store_row(const Vec<L>& v, int row, int k, TriangleBatch& batch) {
  v.x.store(batch.rows[row] + k);
  v.y.store(batch.rows[row + 1] + k);
  v.z.store(batch.rows[row + 2] + k);
}

template <class L>
struct TriangleLanes {
  Vec<L> corner[3], edge[3], normal;
};
template <class L>
void load_triangles(const TriangleBatch& batch, int k, TriangleLanes<L>& t) {
  for (int i = 0; i < 3; ++i) t.corner[i] = load_row<L>(batch, TriangleBatch::kCorner + 3 * i, k);
  for (int i = 0; i < 3; ++i) t.edge[i] = t.corner[(i + 1) % 3] - t.corner[i];
  t.normal = load_row<L>(batch, TriangleBatch::kNormal, k);
}

// The bits of lanes k on, of which only those below `count` hold triangles.
template <class L>
unsigned lane_bits(typename L::Mask mask, int k, int count) {
  return (bits(mask) << k) & ((1u << count) - 1);
}

template <class L>
unsigned place_triangle_lanes(const SurfaceFrame& surface, const core::V3f& middle, int count,
                              TriangleBatch& batch) {
  unsigned in_front = 0;
  for (int k = 0; k < count; k += L::kLanes) {
    for (int i = 0; i < 3; ++i) {
      const int row = TriangleBatch::kCorner + 3 * i;
      store_row(spread<L>(surface.center) + rotated(surface.axes, load_row<L>(batch, row, k)), row,
                k, batch);
    }
    const Vec<L> normal = rotated(surface.axes, load_row<L>(batch, TriangleBatch::kNormal, k));
    store_row(normal, TriangleBatch::kNormal, k, batch);
    TriangleLanes<L> t;
    load_triangles(batch, k, t);
    for (int i = 0; i < 3; ++i) {
      const int row = TriangleBatch::kBeyond + 3 * i;
      const typename L::Mask border = L::load(batch.rows[TriangleBatch::kBorder + i] + k) > L(0.0f);
      const Vec<L> away = unit(cross(t.edge[i], normal), normal);
      store_row(select(border, away, rotated(surface.axes, load_row<L>(batch, row, k))), row, k,
                batch);
    }
    const L height = dot(normal, spread<L>(middle) - t.corner[0]);
    in_front |= lane_bits<L>(!(height < L(0.0f)), k, count);
  }
  return in_front;
}

// Directions in which a shape may not be pushed away from triangles (see leans_too_far).
template <class L>
struct LeanLimits {
  Vec<L> up, away[3];               // the normals; across the edges
  L most_up[3], most_away[3];       // components of the direction beyond each edge
  typename L::Mask untouchable[3];  // edges
};
template <class L>
void lean_limits(const TriangleBatch& batch, int k, const TriangleLanes<L>& t,
                 LeanLimits<L>& limits) {
  const L zero = L(0.0f);
  limits.up = t.normal;
  for (int i = 0; i < 3; ++i) {
    limits.away[i] = unit(cross(t.edge[i], t.normal), Vec<L>{zero, zero, zero});
    const Vec<L> beyond = load_row<L>(batch, TriangleBatch::kBeyond + 3 * i, k);
    limits.most_up[i] = dot(beyond, t.normal);
    limits.most_away[i] = dot(beyond, limits.away[i]);
    limits.untouchable[i] = L::load(batch.rows[TriangleBatch::kTouchable + i] + k) == zero;
  }
}
template <class L>
typename L::Mask may_lean(const LeanLimits<L>& limits, const Vec<L>& out) {
  const L up = dot(out, limits.up);
  typename L::Mask bad = up < L(0.0f);
  for (int i = 0; i < 3; ++i) {
    const L lean = dot(out, limits.away[i]);
    const typename L::Mask too_far =
        limits.untouchable[i] | (lean * limits.most_up[i] > limits.most_away[i] * up + L(1e-3f));
    bad = bad | ((lean > L(1e-3f)) & too_far);
  }
  return !bad | (up > L(0.9999f));
}

// The triangles' own normals as axes.
template <class L>
L face_separation_of_triangles(const TriangleSearch& search, const TriangleLanes<L>& t) {
  const Vec<L> in_a = into(search.axes, t.normal);
  const float* x = search.a.vertices;
  const float* y = x + search.a.vertex_stride;
  const float* z = y + search.a.vertex_stride;
  L low = L(3e38f);
  for (std::uint32_t v = 0; v < search.a.vertex_count; ++v)
    low = min(low, dot(in_a, Vec<L>{L(x[v]), L(y[v]), L(z[v])}));
  return (dot(t.normal, spread<L>(search.center)) + low) - dot(t.normal, t.corner[0]);
}

// The polytope's faces as axes: the best that may be a contact's normal. Returns the separation along
// the best of all.
template <class L>
L search_faces_of_a(const TriangleSearch& search, const TriangleLanes<L>& t,
                    const LeanLimits<L>& limits, Best<L>& best) {
  LeanLimits<L> in_a = limits;
  in_a.up = into(search.axes, limits.up);
  for (int i = 0; i < 3; ++i) in_a.away[i] = into(search.axes, limits.away[i]);
  L widest = L(-3e38f);
  for (std::uint32_t i = 0; i < search.a.face_count; ++i) {
    const Vec<L> along = spread<L>(search.face_normals[i]);
    const L low = min(min(min(L(3e38f), dot(along, t.corner[0])), dot(along, t.corner[1])),
                      dot(along, t.corner[2]));
    const core::V3f normal = search.a.face_normal(i);
    const L separation = (L(core::dot(normal, search.offset)) + low) -
                         L(search.a.faces[PolytopeLanes::kOffset * search.a.face_stride + i]);
    widest = max(separation, widest);
    best.consider(may_lean(in_a, spread<L>(-normal)), separation, L(static_cast<float>(i)));
  }
  return widest;
}

template <class L>
void search_triangle_edges(const TriangleSearch& search, const TriangleBatch& batch, int k,
                           const TriangleLanes<L>& t, L threshold, Best<L>& best) {
  // Zeroes cross nothing on the Gauss map.
  const Vec<L> none = spread<L>(core::V3f{0, 0, 0});
  EdgeLanes<L> of_triangle[3];
  unsigned in_use[3];
  for (int e = 0; e < 3; ++e) {
    const typename L::Mask touchable =
        L::load(batch.rows[TriangleBatch::kTouchable + e] + k) > L(0.0f);
    in_use[e] = bits(touchable);
    of_triangle[e] = {
        t.corner[e], t.edge[e], select(touchable, t.normal, none),
        select(touchable, load_row<L>(batch, TriangleBatch::kBeyond + 3 * e, k), none)};
  }
  if ((in_use[0] | in_use[1] | in_use[2]) == 0) return;
  for (std::size_t i = 0; i < search.edges.size(); ++i) {
    const TriangleSearch::Edge& edge = search.edges[i];
    const Vec<L> left = spread<L>(edge.left), right = spread<L>(edge.right);
    // The bound of search_axes, for the best of the corners.
    L most = L(3e38f);
    for (int c = 0; c < 3; ++c)
      most = min(most, max(dot(t.corner[c], left) - L(edge.left_offset),
                           dot(t.corner[c], right) - L(edge.right_offset)));
    const typename L::Mask in_reach = (most > threshold) | (most > L(0.0f));
    if (bits(in_reach) == 0) continue;
    const EdgeLanes<L> of_a = {spread<L>(edge.tail), spread<L>(edge.along), left, right};
    Best<L> found = best;
    for (unsigned e = 0; e < 3; ++e)
      if (in_use[e] != 0)
        cross_edges(of_a, of_triangle[e], L(static_cast<float>(3 * i + e)), found);
    // Not what only a neighbour in the register asked for.
    best = {select(in_reach, found.value, best.value), select(in_reach, found.index, best.index)};
  }
}

// Which face of a looks most along each direction.
template <class L>
L facing_face_of_a(const TriangleSearch& search, const Vec<L>& toward) {
  Best<L> best = none_yet<L>();
  for (std::uint32_t i = 0; i < search.a.face_count; ++i)
    best.consider(dot(spread<L>(search.face_normals[i]), toward), L(static_cast<float>(i)));
  return best.index;
}

// What the contact takes, see TriangleAxes. Returns the lanes in which a pair of edges is the best.
template <class L>
typename L::Mask choose_axes(const TriangleSearch& search, const TriangleLanes<L>& t,
                             const Best<L>& face_a, L face_b, const Best<L>& edges, int k,
                             TriangleAxes& axes) {
  const L tie = L(search.tie) * min(L(search.a.size), square_root(dot(t.edge[0], t.edge[0])));
  const typename L::Mask of_b = face_b > face_a.value + tie;
  const L face = select(of_b, face_b, face_a.value);
  L facing = face_a.index;
  if (bits(of_b) != 0) {
    const L zero = L(0.0f);
    const Vec<L> down = Vec<L>{zero, zero, zero} - t.normal;
    facing = select(of_b, facing_face_of_a(search, down), facing);
  }
  select(of_b, L(1.0f), L(0.0f)).store(axes.of_b + k);
  facing.store(axes.facing + k);
  return edges.value > face + (tie + L(0.01f) * abs(face));
}

template <class L>
unsigned search_triangle_lanes(const TriangleSearch& search, int count, const TriangleBatch& batch,
                               TriangleAxes& axes) {
  unsigned near = 0;
  axes.by_edges = 0;
  for (int k = 0; k < count; k += L::kLanes) {
    TriangleLanes<L> t;
    load_triangles(batch, k, t);
    const L face_b = face_separation_of_triangles(search, t);
    typename L::Mask apart = face_b > L(search.margin);
    if (all(apart)) continue;
    LeanLimits<L> limits;
    lean_limits(batch, k, t, limits);
    Best<L> face_a = none_yet<L>(), edges = none_yet<L>();
    const L widest = search_faces_of_a(search, t, limits, face_a);
    apart = apart | (widest > L(search.margin));
    if (all(apart)) continue;
    search_triangle_edges(search, batch, k, t,
                          max(face_a.value, face_b) - L(search.tie * search.a.size), edges);
    apart = apart | (edges.value > L(search.margin));
    near |= lane_bits<L>(!apart, k, count);
    const typename L::Mask by_edges =
        choose_axes(search, t, face_a, face_b, edges, k, axes) & !(widest > edges.value);
    axes.by_edges |= lane_bits<L>(by_edges & !apart, k, count);
    face_a.value.store(axes.face_a + k);
    face_a.index.store(axes.face_a_index + k);
    face_b.store(axes.face_b + k);
    edges.value.store(axes.edges + k);
    edges.index.store(axes.edges_index + k);
  }
  return near;
}

template <class L>
L clamped(L part) {
  return min(max(part, L(0.0f)), L(1.0f));
}
template <class L>
Vec<L> nearest_on_segment(const Vec<L>& tail, const Vec<L>& along, const Vec<L>& p) {
  return tail + along * clamped(dot(p - tail, along) / max(dot(along, along), L(1e-30f)));
}

// Is a point neither over a triangle's face nor below it?
template <class L>
typename L::Mask beside_face(const TriangleLanes<L>& t, const Vec<L>& p) {
  const L zero = L(0.0f);
  typename L::Mask beside = L(1.0f) < zero;
  for (int i = 0; i < 3; ++i)
    beside = beside | (dot(cross(t.normal, t.edge[i]), p - t.corner[i]) < zero);
  return beside;
}

template <class L>
struct NearestLanes {
  Vec<L> point;
  L squared;
};
// Nearest points of triangles to a point.
template <class L>
NearestLanes<L> nearest_on_triangles(const TriangleLanes<L>& t, const Vec<L>& p) {
  const typename L::Mask beside = beside_face(t, p);
  NearestLanes<L> rim = {p, L(3e38f)};
  for (int i = 0; i < 3; ++i) {
    const Vec<L> on_edge = nearest_on_segment(t.corner[i], t.edge[i], p);
    const L squared = dot(p - on_edge, p - on_edge);
    const typename L::Mask nearer = squared < rim.squared;
    rim = {select(nearer, on_edge, rim.point), select(nearer, squared, rim.squared)};
  }
  const Vec<L> on_face = p - t.normal * dot(t.normal, p - t.corner[0]);
  return {select(beside, rim.point, on_face),
          select(beside, rim.squared, dot(p - on_face, p - on_face))};
}

template <class L>
unsigned touch_triangle_lanes(const core::V3f& center, float reach, int count,
                              const TriangleBatch& batch, TriangleTouches& touches) {
  unsigned near = 0;
  const Vec<L> p = spread<L>(center);
  for (int k = 0; k < count; k += L::kLanes) {
    TriangleLanes<L> t;
    load_triangles(batch, k, t);
    const NearestLanes<L> nearest = nearest_on_triangles(t, p);
    const L distance = square_root(nearest.squared);
    const typename L::Mask far = distance > L(reach);
    if (all(far)) continue;
    const Vec<L> out = unit(p - nearest.point, t.normal);
    LeanLimits<L> limits;
    lean_limits(batch, k, t, limits);
    near |= lane_bits<L>(may_lean(limits, out) & !far, k, count);
    out.x.store(touches.out[0] + k);
    out.y.store(touches.out[1] + k);
    out.z.store(touches.out[2] + k);
    distance.store(touches.distance + k);
  }
  return near;
}
