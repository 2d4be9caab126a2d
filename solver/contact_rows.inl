// Manifolds into blocks before a step, and what the blocks hold back into manifolds after it. Part of
// KernelsOf in contact_kernels.inl, which says what holds here.

// Any unit vector across n, without a seam where resting contacts live (n along an axis).
SKERRY_LANE V across(const V& n) {
  const F none = zero();
  const M flat = L::less(n.x * n.x, L::set(0.3333f));
  const V a = select(flat, V{none, n.z, none - n.y}, V{n.y, none - n.x, none});
  return mul(a, L::set(1.0f) / L::sqrt(dot(a, a)));
}

struct Bodies2 {
  V ma, mb;
  Sym ia, ib;
};
template <int P, bool kFull>
SKERRY_LANE Bodies2 load_masses(const ContactPass& pass, const LaneInput& input,
                                ContactBlock<W, P, kFull>& block) {
  const float* base = floats(pass.mass);
  F a[8], b[8];
  L::gather(base, 8, block.row_a, a);
  L::gather(base + 4, 8, block.row_a, a + 4);
  L::gather(base, 8, block.row_b, b);
  L::gather(base + 4, 8, block.row_b, b + 4);
  for (int k = 0; k < 6; ++k) {
    if constexpr (kFull) {
      a[1 + k] = L::load(input.inertia_a[k]);
      b[1 + k] = L::load(input.inertia_b[k]);
    }
    store(a[1 + k], block.inertia_a[k]);
    store(b[1 + k], block.inertia_b[k]);
  }
  Bodies2 m;
  m.ia = {a[1], a[2], a[3], a[4], a[5], a[6]};
  m.ib = {b[1], b[2], b[3], b[4], b[5], b[6]};
  if constexpr (kFull) {
    m.ma = {L::load(input.inv_mass_a[0]), L::load(input.inv_mass_a[1]),
            L::load(input.inv_mass_a[2])};
    m.mb = {L::load(input.inv_mass_b[0]), L::load(input.inv_mass_b[1]),
            L::load(input.inv_mass_b[2])};
    store3(m.ma, block.full.inv_mass_a);
    store3(m.mb, block.full.inv_mass_b);
  } else {
    m.ma = {a[0], a[0], a[0]};
    m.mb = {b[0], b[0], b[0]};
    store(a[0], block.full.inv_mass_a);
    store(b[0], block.full.inv_mass_b);
  }
  return m;
}

// Inverse of the symmetric 2x2 (h11 h12 h22); of its diagonal where it is near singular.
SKERRY_LANE void invert2(const F& h11, const F& h12, const F& h22, Lanes<W>* inverse,
                         Lanes<W>& slide_mass) {
  const F none = zero();
  const F diagonal = h11 * h22;
  const F det = diagonal - h12 * h12;
  const M regular = L::less(diagonal * L::set(1e-5f), det);
  const F inv_det = inverse_or_zero(det);
  store(L::select(regular, h22 * inv_det, inverse_or_zero(h11)), inverse[0]);
  store(L::select(regular, none - h12 * inv_det, none), inverse[1]);
  store(L::select(regular, h11 * inv_det, inverse_or_zero(h22)), inverse[2]);
  const F half = L::set(0.5f);
  const F mean = half * (h11 + h22), difference = half * (h11 - h22);
  store(inverse_or_zero(mean + L::sqrt(difference * difference + h12 * h12)), slide_mass);
}

template <int P, bool kFull>
static bool prepare(const ContactPass& pass, const LaneInput& input, void* memory) {
  auto& block = *static_cast<ContactBlock<W, P, kFull>*>(memory);
  for (int i = 0; i < W; ++i) {
    block.row_a[i] = input.row_a[i];
    block.row_b[i] = input.row_b[i];
  }
  const F none = zero();
  F head[4], point[4][4], material[4];
  gather_row(input, kNormalRow, head);
  for (std::uint32_t i = 0; i < P; ++i) gather_row(input, kPointRow + 4 * i, point[i]);
  gather_row(input, kMaterialRow, material);
  Frame<P, kFull> f;
  f.n = {head[0], head[1], head[2]};
  f.t1 = across(f.n);
  f.t2 = cross(f.n, f.t1);
  // The centre: mean of the points.
  const F count = L::integers(head[3]);
  V r[P];
  M there[P];
  for (int i = 0; i < P; ++i) {
    there[i] = L::less(L::set(static_cast<float>(i)), count);
    r[i] = select(there[i], V{point[i][0], point[i][1], point[i][2]}, V{none, none, none});
  }
  f.ca = r[0];
  if constexpr (P > 1) {
    for (int i = 1; i < P; ++i) f.ca = add(f.ca, r[i]);
    f.ca = mul(f.ca, L::set(1.0f) / L::max(count, L::set(1.0f)));
  }
  const V offset = {L::load(input.offset[0]), L::load(input.offset[1]), L::load(input.offset[2])};
  f.cb = sub(f.ca, offset);
  store3(f.n, block.normal);
  store3(f.t1, block.tangent);
  store3(f.ca, block.arm_a);
  store3(f.cb, block.arm_b);
  for (int i = 0; i < P; ++i) {
    if constexpr (P > 1) {
      const V arm = sub(r[i], f.ca);
      const F u = L::select(there[i], dot(arm, f.t1), none);
      const F v = L::select(there[i], dot(arm, f.t2), none);
      store(u, block.points.u[i]);
      store(v, block.points.v[i]);
      store(L::sqrt(u * u + v * v), block.friction.lever[i]);
    }
  }
  store(L::select(L::less(none, count), material[0], none), block.friction.coefficient);
  const F give = count * couple(pass, input, f, count, block);
  return prepare_impulses(pass, input, f, there, point, material, give, block);
}

// What velocity an impulse at each row of the contact gives to every other, with the arms of `f`;
// `count`: of points. Returns it for the normal at the centre, kg^-1.
template <int P, bool kFull>
SKERRY_LANE F couple(const ContactPass& pass, const LaneInput& input, const Frame<P, kFull>& f,
                     const F& count, ContactBlock<W, P, kFull>& block) {
  const F none = zero();
  M there[P];
  for (int i = 0; i < P; ++i) there[i] = L::less(L::set(static_cast<float>(i)), count);
  const Bodies2 m = load_masses(pass, input, block);

  // Angular parts of the rows (n, t1, t2) and their products with the inverse inertia.
  const V ja[3] = {cross(f.ca, f.n), cross(f.ca, f.t1), cross(f.ca, f.t2)};
  const V jb[3] = {cross(f.cb, f.n), cross(f.cb, f.t1), cross(f.cb, f.t2)};
  V wa[3], wb[3];
  for (int k = 0; k < 3; ++k) {
    wa[k] = mul(m.ia, ja[k]);
    wb[k] = mul(m.ib, jb[k]);
  }
  const V both = add(m.ma, m.mb);
  const F g_nn = dot(f.n, mul(both, f.n)) + (dot(ja[0], wa[0]) + dot(jb[0], wb[0]));
  const F h11 = dot(f.t1, mul(both, f.t1)) + (dot(ja[1], wa[1]) + dot(jb[1], wb[1]));
  const F h22 = dot(f.t2, mul(both, f.t2)) + (dot(ja[2], wa[2]) + dot(jb[2], wb[2]));
  F h12 = dot(ja[1], wa[2]) + dot(jb[1], wb[2]);
  F a_1n = dot(ja[1], wa[0]) + dot(jb[1], wb[0]);
  F a_2n = dot(ja[2], wa[0]) + dot(jb[2], wb[0]);
  if constexpr (kFull) {  // the masses of the axes differ: rows are coupled through them too
    h12 = h12 + dot(f.t1, mul(both, f.t2));
    a_1n = a_1n + dot(f.t1, mul(both, f.n));
    a_2n = a_2n + dot(f.t2, mul(both, f.n));
  }
  auto& friction = block.friction;
  invert2(h11, h12, h22, friction.inverse, friction.slide_mass);
  store(a_1n, friction.from_normal[0][0]);
  store(a_2n, friction.from_normal[1][0]);
  const M pushes = L::less(none, count);

  if constexpr (P == 1) {
    store(L::select(there[0], inverse_or_zero(g_nn), none), block.points.mass[0]);
  } else {
    // Angular rows: C couples them with the linear ones, S with each other.
    const V s1 = add(mul(m.ia, f.t1), mul(m.ib, f.t1));
    const V s2 = add(mul(m.ia, f.t2), mul(m.ib, f.t2));
    const V sn = add(mul(m.ia, f.n), mul(m.ib, f.n));
    const V sum[3] = {add(wa[0], wb[0]), add(wa[1], wb[1]), add(wa[2], wb[2])};
    const F g_n1 = dot(sum[0], f.t1), g_n2 = dot(sum[0], f.t2);
    const F g_11 = dot(f.t1, s1), g_12 = dot(f.t1, s2), g_22 = dot(f.t2, s2);
    F u[P], v[P];
    for (int i = 0; i < P; ++i) {
      u[i] = load(block.points.u[i]);
      v[i] = load(block.points.v[i]);
    }
    store_together(g_nn, g_n1, g_n2, g_11, g_12, g_22, u, v, there[P - 1], pushes, block);
    int slot = 0;
    for (int i = 0; i < P; ++i) {
      const F linear1 = g_n1 + g_n1, linear2 = g_n2 + g_n2;
      const F kii =
          (g_nn + (v[i] * linear1 - u[i] * linear2)) +
          ((v[i] * v[i]) * g_11 + ((u[i] * u[i]) * g_22 - ((u[i] * v[i]) + (u[i] * v[i])) * g_12));
      store(L::select(there[i], inverse_or_zero(kii), none), block.points.mass[i]);
      for (int j = i + 1; j < P; ++j) {
        const F kij =
            (g_nn + ((v[i] + v[j]) * g_n1 - (u[i] + u[j]) * g_n2)) +
            ((v[i] * v[j]) * g_11 + ((u[i] * u[j]) * g_22 - (u[i] * v[j] + u[j] * v[i]) * g_12));
        store(kij, block.points.coupling[slot++]);
      }
    }
    for (int k = 0; k < 2; ++k) {
      store(dot(sum[1 + k], f.t1), friction.from_normal[k][1]);
      store(dot(sum[1 + k], f.t2), friction.from_normal[k][2]);
      store(dot(sum[1 + k], f.n), friction.twist_from[3 + k]);
    }
    store(dot(sum[0], f.n), friction.twist_from[0]);
    store(dot(f.n, s1), friction.twist_from[1]);
    store(dot(f.n, s2), friction.twist_from[2]);
    store(inverse_or_zero(dot(f.n, sn)), friction.twist_mass);
    if constexpr (kFull) {
      invert2(g_11, g_12, g_22, block.full.rolling_inverse, block.full.rolling_slide_mass);
    }
  }
  if constexpr (kFull && P == 1) {
    const V s1 = add(mul(m.ia, f.t1), mul(m.ib, f.t1));
    const V s2 = add(mul(m.ia, f.t2), mul(m.ib, f.t2));
    invert2(dot(f.t1, s1), dot(f.t1, s2), dot(f.t2, s2), block.full.rolling_inverse,
            block.full.rolling_slide_mass);
  }
  return g_nn;
}

// (S G S)^-1 with G the inverse mass of (vn, w1, w2) and S the sums over the points of products of
// (1, v, -u): the least impulses that stop four points of a plane.
template <int P, bool kFull>
SKERRY_LANE void store_together(const F& g_nn, const F& g_n1, const F& g_n2, const F& g_11,
                                const F& g_12, const F& g_22, const F* u, const F* v, const M& four,
                                const M& some, ContactBlock<W, P, kFull>& block) {
  const F none = zero();
  F vv = none, uu = none, uv = none;
  for (int i = 0; i < P; ++i) {
    vv = vv + v[i] * v[i];
    uu = uu + u[i] * u[i];
    uv = uv + u[i] * v[i];
  }
  // The points' mean is at the centre: S = [4, 0, 0; 0, vv, -uv; 0, -uv, uu].
  const F count = L::set(static_cast<float>(P));
  const F h00 = (count * count) * g_nn;
  const F h01 = count * (g_n1 * vv - g_n2 * uv), h02 = count * (g_n2 * uu - g_n1 * uv);
  const F r11 = vv * g_11 - uv * g_12, r12 = vv * g_12 - uv * g_22;
  const F r21 = uu * g_12 - uv * g_11, r22 = uu * g_22 - uv * g_12;
  const F h11 = r11 * vv - r12 * uv, h12 = r12 * uu - r11 * uv, h22 = r22 * uu - r21 * uv;
  const F c00 = h11 * h22 - h12 * h12, c01 = h02 * h12 - h01 * h22, c02 = h01 * h12 - h02 * h11;
  const F det = (h00 * c00 + h01 * c01) + h02 * c02;
  const M spread_out = L::both(four, L::both(L::less((uu * vv) * L::set(1e-3f), uu * vv - uv * uv),
                                             L::less((h00 * (h11 * h22)) * L::set(1e-3f), det)));
  // Points micrometres apart leave so small a determinant that its inverse overflows.
  const M regular = L::both(spread_out, L::less(L::set(1e-30f), det));
  const F inv_det = inverse_or_zero(det);
  Lanes<W>* m = block.points.together;
  store(L::select(regular, c00 * inv_det, L::select(some, L::set(-1.0f), none)), m[0]);
  store(c01 * inv_det, m[1]);
  store(c02 * inv_det, m[2]);
  store((h00 * h22 - h02 * h02) * inv_det, m[3]);
  store((h01 * h02 - h00 * h12) * inv_det, m[4]);
  store((h00 * h11 - h01 * h01) * inv_det, m[5]);
}

SKERRY_LANE void gather_row(const LaneInput& input, std::uint32_t row, F* out) {
  const float* address[W];
  for (int k = 0; k < W; ++k) address[k] = input.manifold[k] + row;
  L::gather(address, out);
}

// Whether the two are to bounce alone, at a time that is known.
template <int P>
SKERRY_LANE M is_timed(const ContactBlock<W, P, true>& block) {
  return L::less(L::set(-0.5f), load(block.full.touch));
}

// Velocities before the contact acts: those at the start of the step, or at the time of a bounce.
template <int P, bool kFull>
SKERRY_LANE void velocities_at_touch(const ContactPass& pass,
                                     const ContactBlock<W, P, kFull>& block, Velocity& a,
                                     Velocity& b) {
  a = gather_velocity(pass.start, block.row_a);
  b = gather_velocity(pass.start, block.row_b);
  if constexpr (kFull) {
    const F time = L::max(load(block.full.touch), zero());
    a.linear = add(a.linear, mul(gather_acceleration(pass, block.row_a), time));
    b.linear = add(b.linear, mul(gather_acceleration(pass, block.row_b), time));
    a.angular = load3(block.full.angular_a);
    b.angular = load3(block.full.angular_b);
  }
}
SKERRY_LANE V gather_acceleration(const ContactPass& pass, const std::uint32_t* index) {
  F a[4];
  L::gather(floats(pass.base), 8, index, a);
  return {a[0], a[1], a[2]};
}
// m: how deep the soft contact is pressed in by what it bears for good beyond what it carries. There it
// ought to be: pressed, and the surfaces where they meet.
SKERRY_LANE F standing_depth(const ContactPass& pass, const F& carried, const F& standing,
                             const F& give) {
  const F beyond = L::max(standing - carried, zero());
  return L::min(give * beyond, L::set(pass.soft_load)) * L::set(pass.deflection);
}

// Warm start, separations, and how fast the bodies come together.
// Whether one of the points may bounce.
template <int P, bool kFull>
SKERRY_LANE bool prepare_impulses(const ContactPass& pass, const LaneInput& input,
                                  const Frame<P, kFull>& f, const M* there, const F (*point)[4],
                                  const F* material, const F& give,
                                  ContactBlock<W, P, kFull>& block) {
  const F none = zero();
  F impulse[4], tail[4];
  gather_row(input, kImpulseRow, impulse);
  gather_row(input, kFrictionRow, tail);
  const V old = {tail[0], tail[1], tail[2]};
  auto& friction = block.friction;
  store(dot(f.t1, old), friction.impulse[0]);
  store(dot(f.t2, old), friction.impulse[1]);
  for (auto& sum : friction.normal_sum) store(none, sum);
  for (auto& sum : friction.sum) store(none, sum);
  if constexpr (P > 1) {
    store(tail[3], friction.impulse[2]);
  } else {
    store(none, friction.twist);
  }

  if constexpr (kFull) {
    for (int k = 0; k < 3; ++k) {
      store(L::load(input.angular_a[k]), block.full.angular_a[k]);
      store(L::load(input.angular_b[k]), block.full.angular_b[k]);
    }
    store(L::load(input.touch), block.full.touch);
    for (int i = 0; i < P; ++i) store(L::load(input.gap[i]), block.full.gap[i]);
    store(L::load(input.slowest), block.full.slowest);
    store(material[1], block.full.restitution);
    store(none, block.full.bounced);
  }
  Velocity a, b;
  velocities_at_touch(pass, block, a, b);
  V linear, angular;
  relative_velocity(f, a, b, linear, angular);
  F vn[P];
  point_velocities(block, f, linear, angular, vn);
  F accel_a[4], accel_b[4];
  const float* base = floats(pass.base);
  L::gather(base, 8, block.row_a, accel_a);
  L::gather(base, 8, block.row_b, accel_b);
  const F acceleration =
      dot(f.n, V{accel_b[0] - accel_a[0], accel_b[1] - accel_a[1], accel_b[2] - accel_a[2]});
  F pull = acceleration;  // until they touch
  if constexpr (kFull) pull = L::select(is_timed(block), none, acceleration);
  const F gained = pull * L::set(pass.substep * pass.substeps);
  const F threshold = L::set(pass.restitution_threshold);
  F carry[4];
  gather_row(input, kRoundingRow, carry);
  const F depth = standing_depth(pass, carry[0], carry[3], give);
  F fastest = none, bounce = none;
  for (int i = 0; i < P; ++i) {
    const F s = L::select(there[i], point[i][3], L::set(1e6f));
    store(s - depth, block.points.separation[i]);
    store(L::select(there[i], impulse[i], none), block.points.impulse[i]);
    // Speed at the moment of touch: v^2 = v0^2 - 2 a s on the parabola of free flight.
    const M meets = L::both(there[i], L::less(vn[i] + L::min(gained, none), none));
    const F square =
        L::select(meets, L::max(vn[i] * vn[i] - (pull + pull) * L::max(s, none), none), none);
    fastest = L::max(fastest, square);
    if constexpr (kFull) {
      const F e = material[1];
      const F slowest = load(block.full.slowest);
      const M bounces = L::less(slowest * slowest, square);
      store(L::select(bounces, (e * e) * square, none), block.full.bounce[i]);
      bounce = L::max(bounce, load(block.full.bounce[i]));
      store(none, block.full.max_impulse[i]);
    }
  }
  store(L::sqrt(fastest), block.approach);
  if constexpr (P == 1) {
    const F lever_a = accel_a[3], lever_b = accel_b[3];
    const F smaller = L::select(L::less(none, lever_b), L::min(lever_a, lever_b), lever_a);
    const F lever = L::select(L::less(none, lever_a), smaller, lever_b);
    // Not in an impact: at its end the arms of bodies that tumble are others.
    const M impact = L::less(threshold * threshold, fastest);
    store(L::select(impact, none, load(friction.coefficient) * lever), friction.twist_reach);
  }
  store(carry[0], block.carried);
  store(carry[1], block.rounding_a);
  store(carry[2], block.rounding_b);
  if constexpr (kFull) {
    gather_row(input, kRollingRow, tail);
    const V rolling = {tail[0], tail[1], tail[2]};
    store(dot(f.t1, rolling), block.full.rolling_impulse[0]);
    store(dot(f.t2, rolling), block.full.rolling_impulse[1]);
    store(material[2], block.full.rolling_coefficient);
    store(none, block.full.rolling_sum[0]);
    store(none, block.full.rolling_sum[1]);
    store(acceleration, block.full.acceleration);
  }
  return L::any(L::less(none, bounce));
}

template <int P, bool kFull>
static void store_block(const void* memory, LaneOutput& output) {
  const auto& block = *static_cast<const ContactBlock<W, P, kFull>*>(memory);
  const Frame<P, kFull> f = load_frame(block);
  const auto& friction = block.friction;
  const F none = zero();
  F impulse[4] = {none, none, none, none};
  for (int i = 0; i < P; ++i) impulse[i] = load(block.points.impulse[i]);
  scatter_row(output, kImpulseRow, impulse);
  const V p = add(mul(f.t1, load(friction.impulse[0])), mul(f.t2, load(friction.impulse[1])));
  F total = load(friction.normal_sum[0]);
  for (int i = 1; i < P; ++i) total = total + load(friction.normal_sum[i]);
  const F approach = load(block.approach);
  const V push =
      add(mul(f.n, total), add(mul(f.t1, load(friction.sum[0])), mul(f.t2, load(friction.sum[1]))));
  V torque = cross(f.ca, push), rolling = {none, none, none};
  F twist = none;
  if constexpr (P > 1) {
    twist = load(friction.impulse[2]);
    F torque1 = none, torque2 = none;
    for (int i = 0; i < P; ++i) {
      torque1 = torque1 + load(block.points.v[i]) * load(friction.normal_sum[i]);
      torque2 = torque2 - load(block.points.u[i]) * load(friction.normal_sum[i]);
    }
    torque = add(torque,
                 add(add(mul(f.t1, torque1), mul(f.t2, torque2)), mul(f.n, load(friction.sum[2]))));
  } else {
    torque = add(torque, mul(f.n, load(friction.twist)));
  }
  if constexpr (kFull) {
    rolling = add(mul(f.t1, load(block.full.rolling_impulse[0])),
                  mul(f.t2, load(block.full.rolling_impulse[1])));
    torque = add(torque, add(mul(f.t1, load(block.full.rolling_sum[0])),
                             mul(f.t2, load(block.full.rolling_sum[1]))));
  }
  scatter_row(output, kFrictionRow, {p.x, p.y, p.z, twist});
  scatter_row(output, kRollingRow, {rolling.x, rolling.y, rolling.z, total});
  float* push_row[W];
  float* torque_row[W];
  for (int k = 0; k < W; ++k) {
    push_row[k] = floats(output.push + k);
    torque_row[k] = floats(output.torque + k);
  }
  const F pushes[4] = {push.x, push.y, push.z, total};
  const F torques[4] = {torque.x, torque.y, torque.z, approach};
  L::scatter(pushes, push_row);
  L::scatter(torques, torque_row);
  F bounced = none;
  if constexpr (kFull) bounced = load(block.full.bounced);
  L::store(bounced, output.bounced);
  L::store(load(block.carried), output.struck);
  for (int k = 0; k < W; ++k) output.manifold[k][kMaterialRow + 3] = output.torque[k].s;
}
SKERRY_LANE void scatter_row(const LaneOutput& output, std::uint32_t row, const F (&in)[4]) {
  float* address[W];
  for (int k = 0; k < W; ++k) address[k] = output.manifold[k] + row;
  L::scatter(in, address);
}
