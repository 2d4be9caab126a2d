// The box against box kernel, written once for any lane type. Included once per instruction set,
// inside the namespace that holds its lane type and box_points-inl.h, so no include guard.
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

// One face of box x, that of box a or b which the contact is on; all that the other box, y, is to it. What
// makes and uses it is inlined: so much does not go through memory well.
template <class L>
struct ReferenceFace {
  Vec<L> n, u, v;         // normal but for the sign, tangents (right-handed), world axes
  L sign;                 // 1: the outward normal is n, -1: -n
  L hn, hu, hv;           // m, half extents of x
  L dn, du, dv;           // m, centre of y from that of x
  L cn[3], cu[3], cv[3];  // n, u, v . axis j of y
  L hy[3];                // m, half extents of y
};

template <class L, class Mask>
[[gnu::always_inline]] inline ReferenceFace<L> reference_face(const OrientedBox<L>& a,
                                                              const OrientedBox<L>& b,
                                                              const Axes<L>& at, Mask on_b,
                                                              const L& axis) {
  Vec<L> x[3];
  L hx[3], c[3][3], dx[3];
  ReferenceFace<L> face;
  for (int i = 0; i < 3; ++i) {
    x[i] = select(on_b, b.axis[i], a.axis[i]);
    hx[i] = select(on_b, b.half[i], a.half[i]);
    face.hy[i] = select(on_b, a.half[i], b.half[i]);
    dx[i] = select(on_b, -at.db[i], at.da[i]);
    for (int j = 0; j < 3; ++j) c[i][j] = select(on_b, at.c[j][i], at.c[i][j]);
  }
  const L zero = L(0.0f), one = L(1.0f);
  const typename L::Mask n0 = axis == zero, n1 = axis == one;
  face.n = pick<L>(n0, n1, x[0], x[1], x[2]);
  face.u = pick<L>(n0, n1, x[1], x[2], x[0]);
  face.v = pick<L>(n0, n1, x[2], x[0], x[1]);
  face.hn = pick<L>(n0, n1, hx[0], hx[1], hx[2]);
  face.hu = pick<L>(n0, n1, hx[1], hx[2], hx[0]);
  face.hv = pick<L>(n0, n1, hx[2], hx[0], hx[1]);
  face.dn = pick<L>(n0, n1, dx[0], dx[1], dx[2]);
  face.du = pick<L>(n0, n1, dx[1], dx[2], dx[0]);
  face.dv = pick<L>(n0, n1, dx[2], dx[0], dx[1]);
  for (int j = 0; j < 3; ++j) {
    face.cn[j] = pick<L>(n0, n1, c[0][j], c[1][j], c[2][j]);
    face.cu[j] = pick<L>(n0, n1, c[1][j], c[2][j], c[0][j]);
    face.cv[j] = pick<L>(n0, n1, c[2][j], c[0][j], c[1][j]);
  }
  face.sign = select(face.dn < zero, -one, one);
  return face;
}

// The face of y whose normal opposes the reference normal most. Returns its number, 0 to 5.
template <class L>
[[gnu::always_inline]] inline L incident_face(const ReferenceFace<L>& face,
                                              IncidentFace<L>& incident) {
  const L zero = L(0.0f), one = L(1.0f);
  const L* const cn = face.cn;
  const L steep01 = max(abs(cn[0]), abs(cn[1]));
  const typename L::Mask m0 = !(abs(cn[1]) > abs(cn[0])) & !(abs(cn[2]) > steep01);
  const typename L::Mask m2 = abs(cn[2]) > steep01;
  const typename L::Mask m1 = !(m0 | m2);
  const auto along = [&](const L* row) SKERRY_LANES {
    return Vec<L>{pick<L>(m0, m1, row[0], row[1], row[2]), pick<L>(m0, m1, row[1], row[2], row[0]),
                  pick<L>(m0, m1, row[2], row[0], row[1])};
  };
  const Vec<L> on_n = along(cn), on_u = along(face.cu), on_v = along(face.cv), h = along(face.hy);
  const L side = select(on_n.x * face.sign > zero, -one, one);
  const L out_of_y = side * h.x;
  incident = {face.du + on_u.x * out_of_y,
              face.dv + on_v.x * out_of_y,
              face.sign * (face.dn + on_n.x * out_of_y) - face.hn,
              on_u.y * h.y,
              on_v.y * h.y,
              face.sign * (on_n.y * h.y),
              on_u.z * h.z,
              on_v.z * h.z,
              face.sign * (on_n.z * h.z)};
  const L axis = select(m0, zero, select(m1, one, L(2.0f)));
  return (axis + axis) + select(side > zero, one, zero);
}

// Takes out the candidates that will not come within the slop.
template <class L>
[[gnu::always_inline]] inline void drop_distant(const ReferenceFace<L>& face,
                                                const BoxQuery<L>& query, const Vec<L>& normal,
                                                const Vec<L>& origin, const L& toward_b,
                                                Candidates<L>& candidates) {
  const L zero = L(0.0f);
  // Normal velocity as a function of place on the face: k0 + ku u + kv v.
  const L k0 = dot(normal, query.linear + cross(query.angular, origin));
  const L ku = -(toward_b * dot(query.angular, face.v)), kv = toward_b * dot(query.angular, face.u);
  for (int k = 0; k < Candidates<L>::kCount; ++k) {
    const L vn = (k0 + ku * candidates.u[k]) + kv * candidates.v[k];
    const L predicted = candidates.height[k] + query.dt * min(vn, zero);
    candidates.out[k] = select(predicted > query.slop, L(-3e38f), candidates.out[k]);
  }
}

// The contact of a face (`widest`) of one box (`on_b`: of box b) with the box on the other side.
template <class L, class Mask>
void face_contact(const OrientedBox<L>& a, const OrientedBox<L>& b, const Vec<L>& d,
                  const Axes<L>& at, const BoxQuery<L>& query, Mask on_b, const Widest<L>& widest,
                  L tolerance, BoxContact<L>& contact) {
  const L zero = L(0.0f), one = L(1.0f);
  const ReferenceFace<L> face = reference_face(a, b, at, on_b, widest.i);
  IncidentFace<L> incident;
  const L incident_id = incident_face(face, incident);
  Candidates<L> candidates;
  clip(incident, face.hu, face.hv, tolerance, candidates);
  const L toward_b = select(on_b, -face.sign, face.sign);
  const Vec<L> normal = face.n * toward_b;
  const Vec<L> origin = {select(on_b, d.x, zero), select(on_b, d.y, zero), select(on_b, d.z, zero)};
  drop_distant(face, query, normal, origin, toward_b, candidates);
  Chosen<L> chosen[4];
  choose_four(candidates, tolerance, chosen);

  // Feature: reference face and incident face, then the candidate's number.
  const L reference_id = (widest.i + widest.i) + select(face.sign > zero, one, zero);
  const L faces = (reference_id * L(8.0f) + incident_id) + select(on_b, L(64.0f), zero);
  contact.normal = normal;
  contact.kind = select(on_b, L(2.0f), one);
  for (int k = 0; k < 4; ++k) {
    const L middle = face.sign * (face.hn + L(0.5f) * chosen[k].height);
    contact.position[k] =
        (origin + face.n * middle) + (face.u * chosen[k].u + face.v * chosen[k].v);
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
