// The box against box kernel, written once for any lane type. Included once per instruction set,
// inside the namespace that holds its lane type, so no include guard.
//
// A lane type L has + - * / and unary -, and min, max, abs, square_root, select(mask, yes, no);
// comparisons give L::Mask, which has & | !. Only operations that round alike in every width.
// There is no branch on data, except to skip work whose result would be thrown away.
// SKERRY_LANES is what a lambda needs to be compiled for the instruction set.

// Value of the axis (0, 1, 2) that the masks single out.
template <class L, class Mask, class T>
T pick(Mask is0, Mask is1, const T& v0, const T& v1, const T& v2) {
  return select(is0, v0, select(is1, v1, v2));
}

template <class L>
struct OrientedBox {
  Vec<L> axis[3];
  L half[3];
};

// Rows of a rotation matrix of a unit quaternion, as core::to_matrix gives its columns.
template <class L>
void set_axes(OrientedBox<L>& box, L x, L y, L z, L w) {
  const L x2 = x + x, y2 = y + y, z2 = z + z, one = L(1.0f);
  const L xx = x * x2, yy = y * y2, zz = z * z2, xy = x * y2, xz = x * z2, yz = y * z2;
  const L wx = w * x2, wy = w * y2, wz = w * z2;
  box.axis[0] = {one - (yy + zz), xy + wz, xz - wy};
  box.axis[1] = {xy - wz, one - (xx + zz), yz + wx};
  box.axis[2] = {xz + wy, yz - wx, one - (xx + yy)};
}

template <class L>
struct Axes {
  L c[3][3];       // c[i][j] = axis i of a . axis j of b
  L ac[3][3];      // its magnitude
  L da[3], db[3];  // centre of b from centre of a, in the axes of a and of b
};

template <class L>
struct Widest {
  L separation;
  L i;  // axis, as a number in lanes
};

// Largest separation over face normals of one box.
template <class L>
Widest<L> widest_face(const L* distance, const L* half, const L (*reach)[3], const L* other_half,
                      bool transposed) {
  Widest<L> widest{L(-3e38f), L(0.0f)};
  for (int i = 0; i < 3; ++i) {
    const L r0 = transposed ? reach[0][i] : reach[i][0];
    const L r1 = transposed ? reach[1][i] : reach[i][1];
    const L r2 = transposed ? reach[2][i] : reach[i][2];
    const L extent = half[i] + ((other_half[0] * r0 + other_half[1] * r1) + other_half[2] * r2);
    const L separation = abs(distance[i]) - extent;
    const typename L::Mask wider = separation > widest.separation;
    widest.separation = select(wider, separation, widest.separation);
    widest.i = select(wider, L(static_cast<float>(i)), widest.i);
  }
  return widest;
}

template <class L>
struct WidestEdges {
  L separation;
  L i, j;      // axis of a, axis of b
  L distance;  // signed, of the centres along the (unscaled) cross product
  L length;    // of the cross product
};

// Largest separation over cross products of axes. The nine candidates are compared by their signed
// squares, which spares nine roots and divisions.
template <class L>
WidestEdges<L> widest_edges(const Axes<L>& at, const L* ha, const L* hb) {
  // Closer to parallel than half a milliradian rounding decides the direction of a cross product,
  // and a face is as good within the tolerance.
  const L parallel = L(2.5e-7f), none = L(-1e30f);
  L best = none, best_squared = L(1.0f), best_distance = L(0.0f), best_i = L(0.0f),
    best_j = L(0.0f), best_signed = none;
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const L distance = at.da[i2] * at.c[i1][j] - at.da[i1] * at.c[i2][j];
      const L reach_a = ha[i1] * at.ac[i2][j] + ha[i2] * at.ac[i1][j];
      const L reach_b = hb[j1] * at.ac[i][j2] + hb[j2] * at.ac[i][j1];
      const L gap = abs(distance) - (reach_a + reach_b);
      const L squared = at.c[i1][j] * at.c[i1][j] + at.c[i2][j] * at.c[i2][j];
      const L signed_square = gap * abs(gap);
      const typename L::Mask wider =
          (squared > parallel) & (signed_square * best_squared > best_signed * squared);
      best = select(wider, gap, best);
      best_signed = select(wider, signed_square, best_signed);
      best_squared = select(wider, squared, best_squared);
      best_distance = select(wider, distance, best_distance);
      best_i = select(wider, L(static_cast<float>(i)), best_i);
      best_j = select(wider, L(static_cast<float>(j)), best_j);
    }
  }
  const L length = square_root(best_squared);
  return {best / length, best_i, best_j, best_distance, length};
}

// Candidate contact points in the plane of the reference face.
template <class L>
struct Candidates {
  static constexpr int kCount = 12;
  L u[kCount], v[kCount];  // m, along the two tangents of the reference face
  L height[kCount];        // m, over the reference face
  L out[kCount];           // 0, or hugely negative if there is no such point
};

template <class L>
struct Chosen {
  L u, v, height, index;  // index < 0: none
};

// Takes the candidate of the highest score; it is then out.
template <class L, class Score>
Chosen<L> take(Candidates<L>& from, Score score) {
  L best = L(-1e37f);
  Chosen<L> chosen{L(0.0f), L(0.0f), L(0.0f), L(-1.0f)};
  for (int k = 0; k < Candidates<L>::kCount; ++k) {
    const L value = score(from.u[k], from.v[k], from.height[k]) + from.out[k];
    const typename L::Mask better = value > best;
    best = select(better, value, best);
    chosen.u = select(better, from.u[k], chosen.u);
    chosen.v = select(better, from.v[k], chosen.v);
    chosen.height = select(better, from.height[k], chosen.height);
    chosen.index = select(better, L(static_cast<float>(k)), chosen.index);
  }
  for (int k = 0; k < Candidates<L>::kCount; ++k)
    from.out[k] = select(chosen.index == L(static_cast<float>(k)), L(-3e38f), from.out[k]);
  return chosen;
}

// All candidates of up to four, in their order.
template <class L>
void take_all(const Candidates<L>& from, Chosen<L>* chosen) {
  const L zero = L(0.0f), one = L(1.0f);
  for (int i = 0; i < 4; ++i) chosen[i] = {zero, zero, zero, -one};
  L taken = zero;
  for (int k = 0; k < Candidates<L>::kCount; ++k) {
    const typename L::Mask there = !(from.out[k] < zero);
    for (int i = 0; i <= k && i < 4; ++i) {
      const typename L::Mask here = there & (taken == L(static_cast<float>(i)));
      chosen[i].u = select(here, from.u[k], chosen[i].u);
      chosen[i].v = select(here, from.v[k], chosen[i].v);
      chosen[i].height = select(here, from.height[k], chosen[i].height);
      chosen[i].index = select(here, L(static_cast<float>(k)), chosen[i].index);
    }
    taken = taken + select(there, one, zero);
  }
}

template <class L>
void exchange(typename L::Mask where, Chosen<L>& a, Chosen<L>& b) {
  const Chosen<L> before = a;
  a = {select(where, b.u, a.u), select(where, b.v, a.v), select(where, b.height, a.height),
       select(where, b.index, a.index)};
  b = {select(where, before.u, b.u), select(where, before.v, b.v),
       select(where, before.height, b.height), select(where, before.index, b.index)};
}

// In the order of the candidates, missing ones last.
template <class L>
void sort(Chosen<L>* chosen) {
  const L zero = L(0.0f), last = L(99.0f);
  const int first[5] = {0, 2, 0, 1, 1}, second[5] = {1, 3, 2, 3, 2};
  for (int i = 0; i < 5; ++i) {
    Chosen<L>& a = chosen[first[i]];
    Chosen<L>& b = chosen[second[i]];
    const L rank_a = select(a.index < zero, last, a.index);
    const L rank_b = select(b.index < zero, last, b.index);
    exchange<L>(rank_b < rank_a, a, b);
  }
}

// The one across from the first comes second: what is symmetric cancels in the solver's sums, to the bit.
template <class L>
void pair_up(Chosen<L>* chosen) {
  const L zero = L(0.0f);
  L far[4];
  for (int i = 1; i < 4; ++i) {
    const L du = chosen[i].u - chosen[0].u, dv = chosen[i].v - chosen[0].v;
    far[i] = select(chosen[i].index < zero, -L(1.0f), du * du + dv * dv);
  }
  const typename L::Mask third = far[1] < far[2];
  const typename L::Mask fourth = max(far[1], far[2]) < far[3];
  exchange<L>(third & !fourth, chosen[1], chosen[2]);
  exchange<L>(fourth, chosen[1], chosen[3]);
}

// The same choice as choose_points: deep and far out, far from that, and twice the largest area. In the
// order of the candidates but for pair_up, so that points that stay keep their places.
template <class L>
void choose_four(Candidates<L>& from, L tolerance, Chosen<L>* chosen) {
  const L zero = L(0.0f), one = L(1.0f);
  L deepest = L(3e38f), mean_u = zero, mean_v = zero, count = zero;
  for (int k = 0; k < Candidates<L>::kCount; ++k) {
    const typename L::Mask there = !(from.out[k] < zero);
    deepest = min(deepest, from.height[k] - from.out[k]);
    mean_u = mean_u + select(there, from.u[k], zero);
    mean_v = mean_v + select(there, from.v[k], zero);
    count = count + select(there, one, zero);
  }
  if (all(!(count > L(4.0f)))) {
    take_all(from, chosen);
    return pair_up(chosen);
  }
  mean_u = mean_u / max(count, one);
  mean_v = mean_v / max(count, one);
  // The same one in every step where several are as far out.
  const L limit = deepest + tolerance, shallow = L(-1e30f);
  const L pu = L(60.0f) * tolerance, pv = L(80.0f) * tolerance;
  const Chosen<L> p1 = take(from, [&](L u, L v, L h) SKERRY_LANES {
    const L du = u - mean_u, dv = v - mean_v;
    return select(h > limit, shallow, (du * du + dv * dv) + (pu * du + pv * dv));
  });
  const Chosen<L> p2 = take(from, [&](L u, L v, L) SKERRY_LANES {
    const L du = u - p1.u, dv = v - p1.v;
    return du * du + dv * dv;
  });
  const L u12 = p2.u - p1.u, v12 = p2.v - p1.v;
  const auto area = [](L eu, L ev, L u, L v) SKERRY_LANES { return eu * v - ev * u; };
  const Chosen<L> p3 =
      take(from, [&](L u, L v, L) SKERRY_LANES { return abs(area(u12, v12, u - p1.u, v - p1.v)); });
  const L turn = select(area(u12, v12, p3.u - p1.u, p3.v - p1.v) > L(0.0f), L(-1.0f), L(1.0f));
  const L a12u = u12 * turn, a12v = v12 * turn;
  const L a23u = (p3.u - p2.u) * turn, a23v = (p3.v - p2.v) * turn;
  const L a31u = (p1.u - p3.u) * turn, a31v = (p1.v - p3.v) * turn;
  const Chosen<L> p4 = take(from, [&](L u, L v, L) SKERRY_LANES {
    return max(area(a12u, a12v, u - p1.u, v - p1.v),
               max(area(a23u, a23v, u - p2.u, v - p2.v), area(a31u, a31v, u - p3.u, v - p3.v)));
  });
  chosen[0] = p1;
  chosen[1] = p2;
  chosen[2] = p3;
  chosen[3] = p4;
  sort(chosen);
  pair_up(chosen);
}

// The incident face, a parallelogram, in the frame of the reference face.
template <class L>
struct IncidentFace {
  L cu, cv, ch;  // centre
  L pu, pv, ph;  // half edges
  L qu, qv, qh;
};

// Corners of the incident face cut to the reference rectangle, as up to 12 candidates: per incident
// edge where it enters (its tail if that is inside) and where it leaves; and the rectangle's corners
// within the incident face. `tolerance` favours incident vertices over crossings and corners: boxes
// of one size exactly above each other would otherwise change features with every rounding.
template <class L>
void clip(const IncidentFace<L>& face, L hu, L hv, L tolerance, Candidates<L>& out) {
  const L zero = L(0.0f), one = L(1.0f), two = L(2.0f), gone = L(-3e38f);
  const L limit_u = hu + tolerance, limit_v = hv + tolerance;
  const auto inverse = [&](L d) SKERRY_LANES {  // of a length that may vanish
    const L tiny = L(1e-20f);
    return one / select(abs(d) < tiny, tiny, d);
  };
  const L edge_u[2] = {two * face.pu, two * face.qu}, edge_v[2] = {two * face.pv, two * face.qv};
  const L edge_h[2] = {two * face.ph, two * face.qh};
  const L inverse_u[2] = {inverse(edge_u[0]), inverse(edge_u[1])};
  const L inverse_v[2] = {inverse(edge_v[0]), inverse(edge_v[1])};
  for (int k = 0; k < 4; ++k) {
    // Tails (-,-) (+,-) (+,+) (-,+); directions p, q, -p, -q.
    const bool p_plus = k == 1 || k == 2, q_plus = k >= 2;
    const int e = k % 2;
    const L u0 = p_plus ? face.cu + face.pu : face.cu - face.pu;
    const L v0 = p_plus ? face.cv + face.pv : face.cv - face.pv;
    const L h0 = p_plus ? face.ch + face.ph : face.ch - face.ph;
    const L u = q_plus ? u0 + face.qu : u0 - face.qu;
    const L v = q_plus ? v0 + face.qv : v0 - face.qv;
    const L h = q_plus ? h0 + face.qh : h0 - face.qh;
    const L du = k < 2 ? edge_u[e] : -edge_u[e], dv = k < 2 ? edge_v[e] : -edge_v[e];
    const L dh = k < 2 ? edge_h[e] : -edge_h[e];
    const L iu = k < 2 ? inverse_u[e] : -inverse_u[e], iv = k < 2 ? inverse_v[e] : -inverse_v[e];
    const L tu1 = (-limit_u - u) * iu, tu2 = (limit_u - u) * iu;
    const L tv1 = (-limit_v - v) * iv, tv2 = (limit_v - v) * iv;
    const L first = max(max(min(tu1, tu2), min(tv1, tv2)), zero);
    const L last = min(min(max(tu1, tu2), max(tv1, tv2)), one);
    const typename L::Mask inside = !(first > last);
    // Candidates that are out must stay finite all the same: their scores are computed.
    const L enter = min(first, one), leave = max(last, zero);
    out.u[k] = u + enter * du;
    out.v[k] = v + enter * dv;
    out.height[k] = h + enter * dh;
    out.out[k] = select(inside & (enter < one), zero, gone);
    out.u[4 + k] = u + leave * du;
    out.v[4 + k] = v + leave * dv;
    out.height[4 + k] = h + leave * dh;
    out.out[4 + k] = select(inside & (leave < one), zero, gone);
  }
  const L scale = one / (face.pu * face.qv - face.pv * face.qu);
  // As near to the incident edges as the tolerance: their ends stand for the corner.
  const L within_p = one - tolerance * inverse(square_root(face.pu * face.pu + face.pv * face.pv));
  const L within_q = one - tolerance * inverse(square_root(face.qu * face.qu + face.qv * face.qv));
  for (int k = 0; k < 4; ++k) {
    const L u = k == 1 || k == 2 ? hu : -hu, v = k >= 2 ? hv : -hv;
    const L ru = u - face.cu, rv = v - face.cv;
    const L alpha = (ru * face.qv - rv * face.qu) * scale;
    const L beta = (face.pu * rv - face.pv * ru) * scale;
    out.u[8 + k] = u;
    out.v[8 + k] = v;
    out.height[8 + k] = (face.ch + alpha * face.ph) + beta * face.qh;
    out.out[8 + k] = select((abs(alpha) < within_p) & (abs(beta) < within_q), zero, gone);
  }
}

template <class L>
struct BoxContact {
  Vec<L> normal;
  L kind, apart;
  Vec<L> position[4];
  L separation[4], feature[4];
};

template <class L>
struct BoxQuery {
  Vec<L> linear, angular;
  L dt, slop, margin, kind;
};

// The contact of a face of one box (`on_b`: of box b) with the box on the other side.
template <class L, class Mask>
void face_contact(const OrientedBox<L>& a, const OrientedBox<L>& b, const Vec<L>& d,
                  const Axes<L>& at, const BoxQuery<L>& query, Mask on_b, const Widest<L>& face,
                  L tolerance, BoxContact<L>& contact) {
  const L zero = L(0.0f), one = L(1.0f);
  // x: the reference box, y: the incident one; everything from the centre of x.
  Vec<L> x[3], y[3];
  L hx[3], hy[3], c[3][3], dx[3];
  for (int i = 0; i < 3; ++i) {
    x[i] = select(on_b, b.axis[i], a.axis[i]);
    y[i] = select(on_b, a.axis[i], b.axis[i]);
    hx[i] = select(on_b, b.half[i], a.half[i]);
    hy[i] = select(on_b, a.half[i], b.half[i]);
    dx[i] = select(on_b, -at.db[i], at.da[i]);
    for (int j = 0; j < 3; ++j) c[i][j] = select(on_b, at.c[j][i], at.c[i][j]);
  }
  // The reference face: axis n with tangents u, v (right-handed), outward sign.
  const typename L::Mask n0 = face.i == zero, n1 = face.i == one;
  const Vec<L> n = pick<L>(n0, n1, x[0], x[1], x[2]), u = pick<L>(n0, n1, x[1], x[2], x[0]);
  const Vec<L> v = pick<L>(n0, n1, x[2], x[0], x[1]);
  const L hn = pick<L>(n0, n1, hx[0], hx[1], hx[2]), hu = pick<L>(n0, n1, hx[1], hx[2], hx[0]);
  const L hv = pick<L>(n0, n1, hx[2], hx[0], hx[1]);
  const L dn = pick<L>(n0, n1, dx[0], dx[1], dx[2]), du = pick<L>(n0, n1, dx[1], dx[2], dx[0]);
  const L dv = pick<L>(n0, n1, dx[2], dx[0], dx[1]);
  L cn[3], cu[3], cv[3];
  for (int j = 0; j < 3; ++j) {
    cn[j] = pick<L>(n0, n1, c[0][j], c[1][j], c[2][j]);
    cu[j] = pick<L>(n0, n1, c[1][j], c[2][j], c[0][j]);
    cv[j] = pick<L>(n0, n1, c[2][j], c[0][j], c[1][j]);
  }
  const L sign = select(dn < zero, -one, one);

  // The incident face: the one whose normal opposes the reference normal most.
  const L steep01 = max(abs(cn[0]), abs(cn[1]));
  const typename L::Mask m0 = !(abs(cn[1]) > abs(cn[0])) & !(abs(cn[2]) > steep01);
  const typename L::Mask m2 = abs(cn[2]) > steep01;
  const typename L::Mask m1 = !(m0 | m2);
  const auto incident = [&](const L* row) SKERRY_LANES {
    return Vec<L>{pick<L>(m0, m1, row[0], row[1], row[2]), pick<L>(m0, m1, row[1], row[2], row[0]),
                  pick<L>(m0, m1, row[2], row[0], row[1])};
  };
  const Vec<L> on_n = incident(cn), on_u = incident(cu), on_v = incident(cv), h = incident(hy);
  const L side = select(on_n.x * sign > zero, -one, one);
  const L out_of_y = side * h.x;
  const IncidentFace<L> incident_face = {
      du + on_u.x * out_of_y, dv + on_v.x * out_of_y, sign * (dn + on_n.x * out_of_y) - hn,
      on_u.y * h.y,           on_v.y * h.y,           sign * (on_n.y * h.y),
      on_u.z * h.z,           on_v.z * h.z,           sign * (on_n.z * h.z)};
  Candidates<L> candidates;
  clip(incident_face, hu, hv, tolerance, candidates);

  // Normal velocity as a function of place on the face: k0 + ku u + kv v.
  const L toward_b = select(on_b, -sign, sign);
  const Vec<L> normal = n * toward_b;
  const Vec<L> origin = {select(on_b, d.x, zero), select(on_b, d.y, zero), select(on_b, d.z, zero)};
  const L k0 = dot(normal, query.linear + cross(query.angular, origin));
  const L ku = -(toward_b * dot(query.angular, v)), kv = toward_b * dot(query.angular, u);
  for (int k = 0; k < Candidates<L>::kCount; ++k) {
    const L vn = (k0 + ku * candidates.u[k]) + kv * candidates.v[k];
    const L predicted = candidates.height[k] + query.dt * min(vn, zero);
    candidates.out[k] = select(predicted > query.slop, L(-3e38f), candidates.out[k]);
  }

  Chosen<L> chosen[4];
  choose_four(candidates, tolerance, chosen);

  // Feature: reference face and incident face, then the candidate's number.
  const L reference_id = (face.i + face.i) + select(sign > zero, one, zero);
  const L incident_axis = select(m0, zero, select(m1, one, L(2.0f)));
  const L incident_id = (incident_axis + incident_axis) + select(side > zero, one, zero);
  const L faces = (reference_id * L(8.0f) + incident_id) + select(on_b, L(64.0f), zero);
  contact.normal = normal;
  contact.kind = select(on_b, L(2.0f), one);
  for (int k = 0; k < 4; ++k) {
    const L middle = sign * (hn + L(0.5f) * chosen[k].height);
    contact.position[k] = (origin + n * middle) + (u * chosen[k].u + v * chosen[k].v);
    contact.separation[k] = chosen[k].height;
    contact.feature[k] = select(chosen[k].index < zero, -one, faces * L(16.0f) + chosen[k].index);
  }
}

// True if the axis of two crossing edges is within 8 degrees of the face's normal. Boxes that lie on
// each other with a slight tilt meet in such edges, which have one point where the face has up to
// four: a tower that lands on single points sinks into itself.
template <class L>
typename L::Mask is_nearly_face_normal(const OrientedBox<L>& a, const OrientedBox<L>& b,
                                       const WidestEdges<L>& edges, const Vec<L>& normal) {
  const L zero = L(0.0f), one = L(1.0f);
  const Vec<L> ea = pick<L>(edges.i == zero, edges.i == one, a.axis[0], a.axis[1], a.axis[2]);
  const Vec<L> eb = pick<L>(edges.j == zero, edges.j == one, b.axis[0], b.axis[1], b.axis[2]);
  return abs(dot(cross(ea, eb), normal)) > L(0.99f) * edges.length;
}

// The contact of two crossing edges; written over the lanes of `mask`.
template <class L, class Mask>
void edge_contact(const OrientedBox<L>& a, const OrientedBox<L>& b, const Vec<L>& d,
                  const BoxQuery<L>& query, const WidestEdges<L>& edges, Mask mask,
                  BoxContact<L>& contact) {
  const L zero = L(0.0f), one = L(1.0f);
  const typename L::Mask i0 = edges.i == zero, i1 = edges.i == one, j0 = edges.j == zero,
                         j1 = edges.j == one;
  const Vec<L> ea = pick<L>(i0, i1, a.axis[0], a.axis[1], a.axis[2]);
  const Vec<L> eb = pick<L>(j0, j1, b.axis[0], b.axis[1], b.axis[2]);
  const L toward_b = select(edges.distance < zero, -one, one);
  const Vec<L> normal = cross(ea, eb) * (toward_b / edges.length);
  // Middles of the two edges, and which of the four parallel ones each is.
  Vec<L> pa = {zero, zero, zero}, pb = d;
  L corner = zero;
  for (int k = 0; k < 3; ++k) {
    const typename L::Mask same_a = edges.i == L(static_cast<float>(k));
    const typename L::Mask same_b = edges.j == L(static_cast<float>(k));
    const typename L::Mask plus_a = dot(normal, a.axis[k]) > zero,
                           plus_b = dot(normal, b.axis[k]) < zero;
    const L bit = L(static_cast<float>(1 << k));
    pa = pa + a.axis[k] * select(same_a, zero, select(plus_a, a.half[k], -a.half[k]));
    pb = pb + b.axis[k] * select(same_b, zero, select(plus_b, b.half[k], -b.half[k]));
    corner = corner + select(same_a, zero, select(plus_a, bit, zero));
    corner = corner + L(8.0f) * select(same_b, zero, select(plus_b, bit, zero));
  }
  // Nearest points of the two lines, kept on the edges.
  const Vec<L> between = pb - pa;
  const L cosine = dot(ea, eb), along_a = dot(between, ea), along_b = dot(between, eb);
  const L scale = one / (edges.length * edges.length);
  const L ha = pick<L>(i0, i1, a.half[0], a.half[1], a.half[2]);
  const L hb = pick<L>(j0, j1, b.half[0], b.half[1], b.half[2]);
  const L s = min(max((along_a - cosine * along_b) * scale, -ha), ha);
  const L t = min(max((cosine * along_a - along_b) * scale, -hb), hb);
  const Vec<L> position = ((pa + ea * s) + (pb + eb * t)) * L(0.5f);
  const L vn = dot(normal, query.linear + cross(query.angular, position));
  const L predicted = edges.separation + query.dt * min(vn, zero);
  const L number = edges.i * L(3.0f) + edges.j;
  const L feature = (L(4096.0f) + number * L(64.0f)) + corner;

  contact.normal = select(mask, normal, contact.normal);
  contact.kind = select(mask, L(3.0f), contact.kind);
  contact.position[0] = select(mask, position, contact.position[0]);
  contact.separation[0] = select(mask, edges.separation, contact.separation[0]);
  contact.feature[0] =
      select(mask, select(predicted > query.slop, -one, feature), contact.feature[0]);
  for (int k = 1; k < 4; ++k) contact.feature[k] = select(mask, -one, contact.feature[k]);
}

template <class L>
BoxContact<L> collide_box_lanes(const OrientedBox<L>& a, const OrientedBox<L>& b, const Vec<L>& d,
                                const BoxQuery<L>& query) {
  const L zero = L(0.0f);
  Axes<L> at;
  for (int i = 0; i < 3; ++i) {
    at.da[i] = dot(a.axis[i], d);
    at.db[i] = dot(b.axis[i], d);
    for (int j = 0; j < 3; ++j) {
      at.c[i][j] = dot(a.axis[i], b.axis[j]);
      at.ac[i][j] = abs(at.c[i][j]);
    }
  }
  const Widest<L> face_a = widest_face(at.da, a.half, at.ac, b.half, false);
  const Widest<L> face_b = widest_face(at.db, b.half, at.ac, a.half, true);
  const WidestEdges<L> edges = widest_edges(at, a.half, b.half);

  // What was chosen last time wins ties within the tolerance; else a's faces, then b's, then edges.
  const L size =
      min(max(a.half[0], max(a.half[1], a.half[2])), max(b.half[0], max(b.half[1], b.half[2])));
  const L tolerance = size * L(5e-4f);
  const typename L::Mask was_b = query.kind == L(2.0f), was_edges = query.kind == L(3.0f);
  const L key_a = face_a.separation + select(was_b, zero, tolerance);
  const L key_b = face_b.separation + select(was_b, tolerance, zero);
  const typename L::Mask on_b = key_b > key_a;
  const Widest<L> face = {select(on_b, face_b.separation, face_a.separation),
                          select(on_b, face_b.i, face_a.i)};
  const L bias = select(was_edges, zero, tolerance + L(0.01f) * abs(face.separation));
  const typename L::Mask on_edges = edges.separation > face.separation + bias;

  BoxContact<L> contact;
  contact.apart = max(max(face_a.separation, face_b.separation), edges.separation);
  const typename L::Mask apart = contact.apart > query.margin;
  if (all(apart)) {
    contact.normal = {zero, L(1.0f), zero};
    contact.kind = zero;
    for (int k = 0; k < 4; ++k) {
      contact.position[k] = {zero, zero, zero};
      contact.separation[k] = zero;
      contact.feature[k] = L(-1.0f);
    }
    return contact;
  }
  face_contact(a, b, d, at, query, on_b, face, tolerance, contact);
  // Where two edges cross near the rim of a face, that face may hold no point at all.
  const typename L::Mask empty =
      (contact.feature[0] < zero) & (edges.separation + (tolerance + tolerance) > face.separation);
  const typename L::Mask crossing =
      (on_edges & !is_nearly_face_normal(a, b, edges, contact.normal)) | empty;
  if (!all(!crossing)) edge_contact(a, b, d, query, edges, crossing, contact);
  // Lanes that are apart look the same whether or not their neighbours were.
  contact.normal = select(apart, Vec<L>{zero, L(1.0f), zero}, contact.normal);
  contact.kind = select(apart, zero, contact.kind);
  for (int k = 0; k < 4; ++k) {
    const typename L::Mask none = contact.feature[k] < zero;
    contact.feature[k] = select(apart, L(-1.0f), contact.feature[k]);
    contact.separation[k] = select(apart | none, zero, contact.separation[k]);
    contact.position[k] = select(apart | none, Vec<L>{zero, zero, zero}, contact.position[k]);
  }
  return contact;
}

// Runs the lanes [0, count) of a batch, L::kLanes at a time.
template <class L>
void collide_box_batch(BoxBatch& batch, int count) {
  for (int first = 0; first < count; first += L::kLanes) {
    const auto in = [&](int row) SKERRY_LANES { return L::load(&batch.in[row][first]); };
    OrientedBox<L> a, b;
    set_axes(a, in(BoxBatch::kQax), in(BoxBatch::kQay), in(BoxBatch::kQaz), in(BoxBatch::kQaw));
    set_axes(b, in(BoxBatch::kQbx), in(BoxBatch::kQby), in(BoxBatch::kQbz), in(BoxBatch::kQbw));
    for (int i = 0; i < 3; ++i) {
      a.half[i] = in(BoxBatch::kHax + i);
      b.half[i] = in(BoxBatch::kHbx + i);
    }
    const Vec<L> d = {in(BoxBatch::kDx), in(BoxBatch::kDy), in(BoxBatch::kDz)};
    const BoxQuery<L> query = {{in(BoxBatch::kVx), in(BoxBatch::kVy), in(BoxBatch::kVz)},
                               {in(BoxBatch::kWx), in(BoxBatch::kWy), in(BoxBatch::kWz)},
                               in(BoxBatch::kDt),
                               in(BoxBatch::kSlop),
                               in(BoxBatch::kMargin),
                               in(BoxBatch::kKind)};
    const BoxContact<L> contact = collide_box_lanes(a, b, d, query);
    const auto out = [&](int row, L value) SKERRY_LANES { value.store(&batch.out[row][first]); };
    out(BoxBatch::kNx, contact.normal.x);
    out(BoxBatch::kNy, contact.normal.y);
    out(BoxBatch::kNz, contact.normal.z);
    out(BoxBatch::kKindOut, contact.kind);
    out(BoxBatch::kApart, contact.apart);
    for (int k = 0; k < 4; ++k) {
      const int row = BoxBatch::kPoints + k * BoxBatch::kPointRows;
      out(row + BoxBatch::kPx, contact.position[k].x);
      out(row + BoxBatch::kPy, contact.position[k].y);
      out(row + BoxBatch::kPz, contact.position[k].z);
      out(row + BoxBatch::kSeparation, contact.separation[k]);
      out(row + BoxBatch::kFeature, contact.feature[k]);
    }
  }
}
