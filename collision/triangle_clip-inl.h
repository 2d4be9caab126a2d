// Clipping a face against triangles, written once for any lane type. Included once per instruction
// set, after triangle_lanes-inl.h, so no include guard.
//
// All is seen along each contact's normal, in the plane of the face: there a triangle is a triangle,
// and what they share is bounded by stretches of its edges and of the face's, so that its corners are
// the ends of those stretches.

// How triangles come nearer along their contacts' normals.
template <class L>
struct Approach {
  Vec<L> gradient;  // 1/s, of the normal velocity over places
  L speed;          // m/s, normal velocity at the frame's origin
};
template <class L>
Approach<L> approach_along(const ClipQuery& query, const Vec<L>& along) {
  return {cross(along, spread<L>(query.angular)), dot(along, spread<L>(query.linear))};
}

// A triangle, moved along the contact's normal into the plane of the face.
template <class L>
struct Shadow {
  Vec<L> along;     // unit, the contact's normal, from the polytope to the triangle
  L x[3], y[3];     // m
  L separation[3];  // m, how far the corners were moved back
  Approach<L> approach;
};
template <class L>
void cast_shadow(const ClipFace& face, const ClipQuery& query, const TriangleLanes<L>& t,
                 typename L::Mask of_b, Shadow<L>& shadow) {
  const L zero = L(0.0f);
  const Vec<L> normal = spread<L>(face.normal);
  shadow.along = select(of_b, Vec<L>{zero, zero, zero} - t.normal, normal);
  const L scale = L(1.0f) / max(dot(normal, shadow.along), L(0.1f));
  for (int i = 0; i < 3; ++i) {
    shadow.separation[i] = (dot(normal, t.corner[i]) - L(face.offset)) * scale;
    const Vec<L> p = t.corner[i] - shadow.along * shadow.separation[i];
    shadow.x[i] = dot(spread<L>(face.u), p);
    shadow.y[i] = dot(spread<L>(face.v), p);
  }
  shadow.approach = approach_along(query, shadow.along);
}

// The stretch of an edge inside the face, in parts of its length.
template <class L>
struct Stretch {
  L enter, leave;            // none if enter > leave
  L enter_side, leave_side;  // the face's edge there, -1: its own end

  // Heights of its ends over one edge of the face.
  void cut(L tail, L head, L side) {
    const L zero = L(0.0f);
    const typename L::Mask tail_out = tail > zero, head_out = head > zero;
    const L at = tail / (tail - head);
    const typename L::Mask later = tail_out & ((at > enter) | head_out);
    const typename L::Mask sooner = head_out & ((at < leave) | tail_out);
    enter = select(later, select(head_out, L(3.0f), at), enter);
    enter_side = select(later, side, enter_side);
    leave = select(sooner, select(tail_out, L(-3.0f), at), leave);
    leave_side = select(sooner, side, leave_side);
  }
};

template <class L>
void store_normal(const Vec<L>& along, int k, TriangleClips& clips) {
  along.x.store(clips.normal[0] + k);
  along.y.store(clips.normal[1] + k);
  along.z.store(clips.normal[2] + k);
}

template <class L>
void store_candidate(const Approach<L>& approach, const ClipQuery& query, const Vec<L>& position,
                     L separation, L side, typename L::Mask valid, int k, unsigned lanes, int index,
                     TriangleClips& clips) {
  TriangleClips::Candidate& to = clips.candidates[index];
  position.x.store(to.position[0] + k);
  position.y.store(to.position[1] + k);
  position.z.store(to.position[2] + k);
  separation.store(to.separation + k);
  side.store(to.side + k);
  const L speed = approach.speed + dot(approach.gradient, position);
  const L foreseen = separation + L(query.dt) * min(speed, L(0.0f));
  const typename L::Mask touches = (foreseen < L(query.slop)) | (foreseen == L(query.slop));
  clips.valid[index] |= (bits(valid & touches) << k) & lanes;
}

template <class L>
void clip_edges(const ClipFace& face, const ClipQuery& query, const TriangleLanes<L>& t,
                const Shadow<L>& shadow, int k, unsigned lanes, TriangleClips& clips) {
  const L zero = L(0.0f), one = L(1.0f), none = L(-1.0f);
  Stretch<L> stretch[3] = {
      {zero, one, none, none}, {zero, one, none, none}, {zero, one, none, none}};
  for (std::uint32_t j = 0; j < face.count; ++j) {
    L height[3];
    for (int i = 0; i < 3; ++i)
      height[i] = (L(face.side_x[j]) * shadow.x[i] + L(face.side_y[j]) * shadow.y[i]) -
                  L(face.side_offset[j]);
    for (int i = 0; i < 3; ++i)
      stretch[i].cut(height[i], height[(i + 1) % 3], L(static_cast<float>(j)));
  }
  for (int i = 0; i < 3; ++i) {
    const Stretch<L>& s = stretch[i];
    const L first = shadow.separation[i], change = shadow.separation[(i + 1) % 3] - first;
    const typename L::Mask inside = !(s.enter > s.leave);
    const auto put = [&](L at, L side, typename L::Mask valid, int index) SKERRY_LANES {
      const L separation = first + change * at;
      const Vec<L> position =
          (t.corner[i] + t.edge[i] * at) - shadow.along * (L(0.5f) * separation);
      store_candidate(shadow.approach, query, position, separation, side, valid, k, lanes, index,
                      clips);
    };
    put(s.enter, s.enter_side, inside, TriangleClips::kEnter + i);
    // Its head is the next edge's tail.
    put(s.leave, s.leave_side, inside & (s.leave < one), TriangleClips::kLeave + i);
  }
}

// Corners of the face over the triangle: all its edges have them on their right, seen from outside.
template <class L>
void clip_corners(const ClipFace& face, const ClipQuery& query, const TriangleLanes<L>& t,
                  const Shadow<L>& shadow, int k, unsigned lanes, TriangleClips& clips) {
  const L zero = L(0.0f);
  const L size =
      max(square_root(dot(t.edge[0], t.edge[0])), square_root(dot(t.edge[2], t.edge[2])));
  L edge_x[3], edge_y[3], most[3];
  for (int i = 0; i < 3; ++i) {
    edge_x[i] = shadow.x[(i + 1) % 3] - shadow.x[i];
    edge_y[i] = shadow.y[(i + 1) % 3] - shadow.y[i];
    most[i] = (L(1e-3f) * size) * square_root(edge_x[i] * edge_x[i] + edge_y[i] * edge_y[i]);
  }
  // Triangles seen from the side have no inside.
  const L steepness = dot(t.normal, shadow.along);
  const typename L::Mask open = steepness < L(-0.05f);
  const L scale = L(1.0f) / select(open, steepness, L(1.0f));
  const L height = dot(t.normal, t.corner[0]);
  for (std::uint32_t j = 0; j < face.count; ++j) {
    typename L::Mask inside = open;
    for (int i = 0; i < 3; ++i)
      inside = inside & !(edge_x[i] * (L(face.y[j]) - shadow.y[i]) -
                              edge_y[i] * (L(face.x[j]) - shadow.x[i]) >
                          most[i]);
    const Vec<L> corner = spread<L>(face.corners[j]);
    const L separation = (height - dot(t.normal, corner)) * scale;
    store_candidate(shadow.approach, query, corner + shadow.along * (L(0.5f) * separation),
                    separation, zero, inside, k, lanes,
                    TriangleClips::kCorners + static_cast<int>(j), clips);
  }
}

template <class L>
void clip_triangle_lanes(const ClipFace& face, const ClipQuery& query, unsigned lanes,
                         const TriangleBatch& batch, const TriangleAxes& axes,
                         TriangleClips& clips) {
  for (unsigned& bits_of_candidate : clips.valid) bits_of_candidate = 0;
  for (int k = 0; k < TriangleBatch::kSize; k += L::kLanes) {
    if ((lanes >> k & ((1u << L::kLanes) - 1)) == 0) continue;
    TriangleLanes<L> t;
    load_triangles(batch, k, t);
    Shadow<L> shadow;
    cast_shadow(face, query, t, L::load(axes.of_b + k) > L(0.0f), shadow);
    store_normal(shadow.along, k, clips);
    clip_edges(face, query, t, shadow, k, lanes, clips);
    clip_corners(face, query, t, shadow, k, lanes, clips);
  }
}
