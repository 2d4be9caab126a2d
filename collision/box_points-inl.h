// The points in which two faces lie on each other: one face clipped against the other, and which four of
// the corners stand for all. For any lane type, see box_lanes-inl.h, which it is included before.

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
