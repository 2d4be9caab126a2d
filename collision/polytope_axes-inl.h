// The separating-axis search, written once for any lane type. Included once per instruction set,
// inside the namespace that holds its lane type, so no include guard.

// Lowest of the dot products of a polytope's vertices with a direction, in its frame.
template <class L>
struct Lowest {
  float value;
  std::uint32_t vertex;
};
template <class L>
Lowest<L> lowest_vertex(const PolytopeLanes& shape, const core::V3f& along) {
  const Vec<L> d = spread<L>(along);
  Best<L> best = none_yet<L>();
  for (std::uint32_t i = 0; i < shape.vertex_count; i += L::kLanes) {
    const L height = dot(d, load3<L>(shape.vertices, shape.vertex_stride, i));
    best.consider(-height, L::counting(static_cast<float>(i)));
  }
  const float top = best.top();
  return {-top, best.top_index(top)};
}

template <class L>
std::uint32_t facing_face_lanes(const PolytopeLanes& shape, const core::V3f& toward) {
  const Vec<L> d = spread<L>(toward);
  Best<L> best = none_yet<L>();
  for (std::uint32_t i = 0; i < shape.face_count; i += L::kLanes) {
    const L index = L::counting(static_cast<float>(i));
    const L cosine = dot(d, load3<L>(shape.faces, shape.face_stride, i));
    best.consider(index < L(static_cast<float>(shape.face_count)), cosine, index);
  }
  return best.top_index(best.top());
}

struct FaceAxis {
  float separation;
  std::uint32_t face;
};

// Largest separation over the faces of one polytope; `frame` holds the axes of the other.
template <class L>
FaceAxis widest_face(const PolytopeLanes& self, const PolytopeLanes& other, const core::M3f& frame,
                     const core::V3f& offset) {
  Best<L> best = none_yet<L>();
  for (std::uint32_t i = 0; i < self.face_count; i += L::kLanes) {
    const Vec<L> normal = load3<L>(self.faces, self.face_stride, i);
    const Vec<L> in_other = into(frame, normal);
    const float* x = other.vertices;
    const float* y = x + other.vertex_stride;
    const float* z = y + other.vertex_stride;
    L low = L(3e38f);
    for (std::uint32_t v = 0; v < other.vertex_count; ++v)
      low = min(low, dot(in_other, Vec<L>{L(x[v]), L(y[v]), L(z[v])}));
    const L face_offset = L::load(self.faces + PolytopeLanes::kOffset * self.face_stride + i);
    best.consider((dot(normal, spread<L>(offset)) + low) - face_offset,
                  L::counting(static_cast<float>(i)));
  }
  const float top = best.top();
  return {top, top > -3e38f ? best.top_index(top) : 0};
}

// Edges that may be part of the best axis.
struct EdgeBlock {
  static constexpr std::uint32_t kCapacity = 64, kStride = kCapacity + PolytopeLanes::kPad;
  std::uint32_t count = 0;
  std::uint32_t edge[kCapacity];
  // Tail, along, left, right; behind the last edge zeros, which cross nothing on the Gauss map.
  alignas(64) float rows[PolytopeLanes::kLeftOffset][kStride];
};

// Takes edges from `first` on until the block is full; returns the first that is left. `w` is a
// point of the other polytope.
template <class L>
std::uint32_t take_edges(const PolytopeLanes& self, const core::V3f& w, float threshold,
                         std::uint32_t first, EdgeBlock& block) {
  block.count = 0;
  const Vec<L> point = spread<L>(w);
  std::uint32_t i = first;
  for (; i < self.edge_count && block.count + L::kLanes <= EdgeBlock::kCapacity; i += L::kLanes) {
    const auto height = [&](std::uint32_t normal, std::uint32_t offset) SKERRY_LANES {
      return dot(point, load3<L>(self.edges + normal * self.edge_stride, self.edge_stride, i)) -
             L::load(self.edges + offset * self.edge_stride + i);
    };
    const L most = max(height(PolytopeLanes::kLeft, PolytopeLanes::kLeftOffset),
                       height(PolytopeLanes::kRight, PolytopeLanes::kRightOffset));
    const typename L::Mask chosen = (most > L(threshold)) | (most > L(0.0f));
    unsigned set = bits(chosen);
    if (set == 0) continue;
    for (std::uint32_t row = 0; row < PolytopeLanes::kLeftOffset; ++row)
      pack(chosen, L::load(self.edges + row * self.edge_stride + i), block.rows[row] + block.count);
    for (; set != 0; set &= set - 1)
      block.edge[block.count++] = i + static_cast<std::uint32_t>(std::countr_zero(set));
  }
  const L zero = L(0.0f);
  for (std::uint32_t row = 0; row < PolytopeLanes::kLeftOffset; ++row)
    pack(zero < zero, zero, block.rows[row] + block.count);
  return i;
}

// Edges of a, into b's frame.
template <class L>
void transform(const AxisQuery& query, EdgeBlock& block) {
  for (std::uint32_t k = 0; k < block.count; k += L::kLanes)
    for (const std::uint32_t row : {PolytopeLanes::kTail, PolytopeLanes::kAlong,
                                    PolytopeLanes::kLeft, PolytopeLanes::kRight}) {
      float* at = block.rows[row] + k;
      Vec<L> v = load3<L>(at, EdgeBlock::kStride, 0);
      if (row == PolytopeLanes::kTail) v = v - spread<L>(query.offset);
      v = into(query.rotation, v);
      v.x.store(at);
      v.y.store(at + EdgeBlock::kStride);
      v.z.store(at + 2 * EdgeBlock::kStride);
    }
}

template <class L>
void search_block(const EdgeBlock& a, const EdgeBlock& b, Axis& edges) {
  const auto lanes_of_b = [&](std::uint32_t row, std::uint32_t k) SKERRY_LANES {
    return load3<L>(b.rows[row] + k, EdgeBlock::kStride, 0);
  };
  Best<L> best = none_yet<L>();
  for (std::uint32_t k = 0; k < b.count; k += L::kLanes) {
    const EdgeLanes<L> eb = {
        lanes_of_b(PolytopeLanes::kTail, k), lanes_of_b(PolytopeLanes::kAlong, k),
        lanes_of_b(PolytopeLanes::kLeft, k), lanes_of_b(PolytopeLanes::kRight, k)};
    for (std::uint32_t i = 0; i < a.count; ++i) {
      const auto of_a = [&](std::uint32_t row) SKERRY_LANES {
        return Vec<L>{L(a.rows[row][i]), L(a.rows[row + 1][i]), L(a.rows[row + 2][i])};
      };
      const EdgeLanes<L> ea = {of_a(PolytopeLanes::kTail), of_a(PolytopeLanes::kAlong),
                               of_a(PolytopeLanes::kLeft), of_a(PolytopeLanes::kRight)};
      // Numbered by a's edge, then b's: that order decides between equals at any width.
      cross_edges(ea, eb, L::counting(static_cast<float>(i * EdgeBlock::kCapacity + k)), best);
    }
  }
  const float top = best.top();
  if (!(top >= edges.separation && top > -3e38f)) return;
  const std::uint32_t index = best.top_index(top);
  const AxisName name = {AxisName::kEdges, a.edge[index / EdgeBlock::kCapacity],
                         b.edge[index % EdgeBlock::kCapacity]};
  const bool lower = name.a < edges.name.a || (name.a == edges.name.a && name.b < edges.name.b);
  if (top > edges.separation || lower) edges = {name, top};
}

// All pairs of the edges that may reach beyond the threshold; wa is a point of a in b's frame, wb one
// of b in a's frame.
template <class L>
void widest_edges(const AxisQuery& query, const core::V3f& wa, const core::V3f& wb, float threshold,
                  Axis& edges) {
  EdgeBlock of_a, of_b;
  for (std::uint32_t i = 0; i < query.a.edge_count;) {
    i = take_edges<L>(query.a, wb, threshold, i, of_a);
    if (of_a.count == 0) continue;
    transform<L>(query, of_a);
    for (std::uint32_t j = 0; j < query.b.edge_count;) {
      j = take_edges<L>(query.b, wa, threshold, j, of_b);
      search_block<L>(of_a, of_b, edges);
    }
  }
}

// Axes of a in b's frame, and a's origin there.
inline core::M3f transposed(const core::M3f& m) {
  return {{m.c0.x, m.c1.x, m.c2.x}, {m.c0.y, m.c1.y, m.c2.y}, {m.c0.z, m.c1.z, m.c2.z}};
}

inline core::V3f vertex(const PolytopeLanes& shape, std::uint32_t i) {
  return {shape.vertices[i], shape.vertices[shape.vertex_stride + i],
          shape.vertices[2 * shape.vertex_stride + i]};
}

template <class L>
float face_separation(const PolytopeLanes& self, std::uint32_t face, const PolytopeLanes& other,
                      const core::M3f& frame, const core::V3f& offset) {
  const core::V3f normal = self.face_normal(face);
  const float low = lowest_vertex<L>(other, transposed_times(frame, normal)).value;
  return (core::dot(normal, offset) + low) -
         self.faces[PolytopeLanes::kOffset * self.face_stride + face];
}

inline core::V3f offset_in_b(const AxisQuery& query) {
  return -transposed_times(query.rotation, query.offset);
}

template <class L>
Axis recall_axis_lanes(const AxisQuery& query, const AxisName& name) {
  Axis axis;
  if (name.kind == AxisName::kFaceOfA && name.a < query.a.face_count) {
    axis = {name, face_separation<L>(query.a, name.a, query.b, query.rotation, query.offset)};
  } else if (name.kind == AxisName::kFaceOfB && name.b < query.b.face_count) {
    axis = {name, face_separation<L>(query.b, name.b, query.a, transposed(query.rotation),
                                     offset_in_b(query))};
  } else if (name.kind == AxisName::kEdges && name.a < query.a.edge_count &&
             name.b < query.b.edge_count) {
    const auto lanes = [](const PolytopeLanes& shape, std::uint32_t i) SKERRY_LANES {
      return EdgeLanes<L>{spread<L>(shape.edge(PolytopeLanes::kTail, i)),
                          spread<L>(shape.edge(PolytopeLanes::kAlong, i)),
                          spread<L>(shape.edge(PolytopeLanes::kLeft, i)),
                          spread<L>(shape.edge(PolytopeLanes::kRight, i))};
    };
    EdgeLanes<L> ea = lanes(query.a, name.a);
    ea.tail = into(query.rotation, ea.tail - spread<L>(query.offset));
    ea.along = into(query.rotation, ea.along);
    ea.left = into(query.rotation, ea.left);
    ea.right = into(query.rotation, ea.right);
    Best<L> best = none_yet<L>();
    cross_edges(ea, lanes(query.b, name.b), L(0.0f), best);
    const float top = best.top();
    if (top > -3e38f) axis = {name, top};
  }
  return axis;
}

template <class L>
void search_axes_lanes(const AxisQuery& query, AxisAnswer& answer) {
  answer = {};
  const FaceAxis fa = widest_face<L>(query.a, query.b, query.rotation, query.offset);
  answer.face_a = {{AxisName::kFaceOfA, fa.face, 0}, fa.separation};
  if (parts(query, answer.face_a)) {
    answer.apart = answer.face_a;
    return;
  }
  const FaceAxis fb =
      widest_face<L>(query.b, query.a, transposed(query.rotation), offset_in_b(query));
  answer.face_b = {{AxisName::kFaceOfB, 0, fb.face}, fb.separation};
  if (parts(query, answer.face_b)) {
    answer.apart = answer.face_b;
    return;
  }

  // The vertices that face each other along the best face's normal.
  const bool of_a = fa.separation >= fb.separation;
  const core::V3f in_a =
      of_a ? query.a.face_normal(fa.face) : -(query.rotation * query.b.face_normal(fb.face));
  const core::V3f in_b = transposed_times(query.rotation, in_a);
  const core::V3f nearest_a = vertex(query.a, lowest_vertex<L>(query.a, -in_a).vertex);
  const core::V3f nearest_b = vertex(query.b, lowest_vertex<L>(query.b, in_b).vertex);
  float threshold = std::max(fa.separation, fb.separation) - query.tolerance;
  if (query.recalled.name.kind == AxisName::kEdges)
    threshold = std::max(threshold, query.recalled.separation - query.tolerance);
  widest_edges<L>(query, transposed_times(query.rotation, nearest_a - query.offset),
                  query.rotation * nearest_b + query.offset, threshold, answer.edges);
  if (parts(query, answer.edges)) answer.apart = answer.edges;
}
