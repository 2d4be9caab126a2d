// Contacts that bounce, and impacts among several bodies. Part of KernelsOf in contact_kernels.inl, which
// says what holds here.

// What a bounce asks of the points. The impulses so far are those of the whole step: where a
// point's blow came from the fall of another that now rebounds, it is taken back.
template <int P>
struct Bounce {
  Wanted<P> wanted;
  F points;  // how many take part
  M any;     // of them bounces
};

// Newton restitution. A contact whose time is known goes from blow to blow of its points; another gives
// all points that pushed in this step their speeds at once, those that do not bounce held.
template <int P>
SKERRY_LANE void restitute_block(const ContactPass& pass, ContactBlock<W, P, true>& block) {
  const F none = zero();
  Marked body_a = gather_marked(pass, block.row_a), body_b = gather_marked(pass, block.row_b);
  const Frame<P, true> f = load_frame(block);
  const M timed = L::both(is_timed(block), any_bounces(block));
  start_anew(block, timed);
  F s[P];
  separations(pass, block, f, s);
  Bounce<P> bounce = bounce_of(block, s);
  if (!L::any(bounce.any)) return;
  const M bounces = bounce.any, flies = L::both(timed, bounces);
  Velocity a, b;
  velocities_at_touch(pass, block, a, b);
  V roll =
      add(mul(f.t1, load(block.full.rolling_sum[0])), mul(f.t2, load(block.full.rolling_sum[1])));
  if constexpr (P == 1) roll = add(roll, mul(f.n, load(block.friction.twist)));
  apply(block, f.ca, f.cb, {none, none, none}, roll, a, b);
  a = select(flies, a, body_a.v);
  b = select(flies, b, body_b.v);
  F rest = L::set(pass.substep * pass.substeps) - load(block.full.touch);
  const F after = L::select(flies, rest, none);
  for (int i = 0; i < kBlows; ++i) {
    next_blow(block, f, flies, a, b, rest, bounce);
    if (!L::any(bounce.any)) break;
    blow(pass, block, f, flies, bounce, a, b);
    bounce.any = L::less(L::set(1.0f), none);  // those whose time is not known have only one
  }
  a.linear = add(a.linear, mul(gather_acceleration(pass, block.row_a), after));
  b.linear = add(b.linear, mul(gather_acceleration(pass, block.row_b), after));
  body_a.v = select(bounces, a, body_a.v);
  body_b.v = select(bounces, b, body_b.v);
  scatter_marked(pass, block.row_a, body_a);
  scatter_marked(pass, block.row_b, body_b);
}

static constexpr int kBlows = 8;          // of a contact in a step; what is left is the next one's
static constexpr float kAlready = 2e-5f;  // m: a point this near touches
static constexpr float kStill = 1e-4f;    // m/s: so slow a point takes no part in a blow

// The blow that follows, in contacts `timed`: of the points that arrive first, if they do so in the rest of
// the step (s), as they go on straight. They depart by their restitution together, and the rest passes.
template <int P>
SKERRY_LANE void next_blow(ContactBlock<W, P, true>& block, const Frame<P, true>& f, const M& timed,
                           const Velocity& a, const Velocity& b, F& rest, Bounce<P>& bounce) {
  const F none = zero(), one = L::set(1.0f), never = L::set(kNoMeeting);
  V linear, angular;
  relative_velocity(f, a, b, linear, angular);
  F vn[P], arrival[P];
  point_velocities(block, f, linear, angular, vn);
  F first = never;
  for (int i = 0; i < P; ++i) {
    const F gap = load(block.full.gap[i]);
    const M comes =
        L::both(L::less(none, load(block.points.mass[i])), L::less(vn[i], L::set(-kStill)));
    const F far = L::select(L::less(L::set(kAlready), gap), gap, none);
    arrival[i] = L::select(comes, far / L::select(comes, none - vn[i], one), never);
    first = L::min(first, arrival[i]);
  }
  const M happens = L::both(timed, L::less(first, rest + L::set(1e-9f)));
  F points = none;
  for (int i = 0; i < P; ++i) {
    const F gap = load(block.full.gap[i]) + vn[i] * L::min(first, rest);
    const M takes_part =
        L::both(happens, L::both(L::less(arrival[i], never), L::less(gap, L::set(kAlready))));
    const M fast = L::less(vn[i], none - load(block.full.slowest));
    const F kept = L::select(fast, load(block.full.restitution), none);
    Wanted<P>& w = bounce.wanted;
    w.bias[i] = L::select(takes_part, vn[i] * kept, L::select(timed, never, w.bias[i]));
    w.old[i] = L::select(timed, none, w.old[i]);
    points = points + L::select(takes_part, one, none);
    store(L::select(happens, gap, load(block.full.gap[i])), block.full.gap[i]);
  }
  bounce.points = L::select(timed, points, bounce.points);
  bounce.any = L::either(happens, L::both(bounce.any, L::less(load(block.full.bounced), one)));
  rest = L::select(happens, rest - first, rest);
}

// No point is first, or what lands flat would rebound spinning. Friction within what the normals will be,
// then the normals: in this order neither can gain energy from the other.
template <int P>
SKERRY_LANE void blow(const ContactPass& pass, ContactBlock<W, P, true>& block,
                      const Frame<P, true>& f, const M& timed, const Bounce<P>& bounce, Velocity& a,
                      Velocity& b) {
  constexpr int kRows = P > 1 ? 3 : 2;
  const F none = zero();
  V linear, angular, push = {none, none, none}, torque = push;
  F vn[P], impulse[P], drag[kRows];
  relative_velocity(f, a, b, linear, angular);
  point_velocities(block, f, linear, angular, vn);
  solve_bounce(block, bounce, vn, impulse);
  for (int i = 0; i < P; ++i) impulse[i] = L::max(impulse[i] - bounce.wanted.old[i], none);
  for (int k = 0; k < kRows; ++k) drag[k] = none;
  solve_friction(block, f, linear, angular, {none, none, none}, impulse, drag, push, torque);
  Velocity next_a = a, next_b = b;
  apply(block, f.ca, f.cb, push, torque, next_a, next_b);

  relative_velocity(f, next_a, next_b, linear, angular);
  point_velocities(block, f, linear, angular, vn);
  solve_bounce(block, bounce, vn, impulse);
  for (int i = 0; i < P; ++i) impulse[i] = impulse[i] - bounce.wanted.old[i];
  if constexpr (P > 1) rescale(block, timed, bounce.wanted, vn, impulse);
  bound_energy(pass, block, timed, vn, impulse);
  for (int i = 0; i < P; ++i) {
    accumulate(block.friction.normal_sum[i], impulse[i], bounce.any);
    // What bounces off is no load for the next step to start from.
    const M bounces = L::less(bounce.wanted.bias[i], none);
    store(L::select(bounces, none, load(block.points.impulse[i])), block.points.impulse[i]);
  }
  for (int k = 0; k < kRows; ++k) accumulate(block.friction.sum[k], drag[k], bounce.any);
  const NormalSum sum = sum_of(block, impulse);
  torque = {none, none, none};
  if constexpr (P > 1) torque = add(mul(f.t1, sum.torque1), mul(f.t2, sum.torque2));
  apply(block, f.ca, f.cb, mul(f.n, sum.push), torque, next_a, next_b);
  a = select(bounce.any, next_a, a);
  b = select(bounce.any, next_b, b);
}

template <int P>
SKERRY_LANE M any_bounces(const ContactBlock<W, P, true>& block) {
  F most = zero();
  for (int i = 0; i < P; ++i)
    most = L::max(most, L::min(load(block.full.bounce[i]), load(block.full.max_impulse[i])));
  return L::less(zero(), most);
}

// A bounce at its own time is solved from the velocities of then: what the substeps gave, to stop the
// two, is forgotten, but for what resists rolling and spinning on the spot.
template <int P>
SKERRY_LANE void start_anew(ContactBlock<W, P, true>& block, const M& timed) {
  const F none = zero();
  for (auto& sum : block.friction.normal_sum) store(L::select(timed, none, load(sum)), sum);
  for (auto& sum : block.friction.sum) store(L::select(timed, none, load(sum)), sum);
  for (auto& last : block.points.impulse) store(L::select(timed, none, load(last)), last);
  store(L::select(timed, L::set(1.0f), none), block.full.bounced);
}

// Impulses of few rounds give the points their speeds nearly. All of a blow are lessened or raised together
// to what lets the points depart, weighed by their impulses, as they are to.
template <int P, bool kFull>
SKERRY_LANE void rescale(const ContactBlock<W, P, kFull>& block, const M& where,
                         const Wanted<P>& wanted, const F* vn, F* change) {
  const F none = zero(), one = L::set(1.0f);
  F asked = none, given = none;
  for (int i = 0; i < P; ++i) {
    F by = inverse_or_zero(load(block.points.mass[i])) * change[i];
    for (int j = 0; j < P; ++j)
      if (j != i) by = by + load(block.points.coupling[slot_of(i, j)]) * change[j];
    given = given + change[i] * by;
    asked = asked - change[i] * (vn[i] + wanted.bias[i]);
  }
  const M some = L::both(where, L::both(L::less(none, asked), L::less(none, given)));
  const F part = L::select(some, asked / L::select(some, given, one), one);
  for (int i = 0; i < P; ++i) change[i] = change[i] * part;
}

// A point that moved off at first and was pressed by the turn that another gave the body would be stopped
// at a gain of energy; so would be what friction has slowed, if it rebounds as it came. The pushes p of the
// whole step are lessened together to what gives none, which is sum p (v + K p / 2) <= 0 with the velocities
// v without them and the couplings K. Those of a bounce whose time is not known may have been changed
// by forces since.
template <int P>
SKERRY_LANE void bound_energy(const ContactPass& pass, const ContactBlock<W, P, true>& block,
                              const M& timed, const F* vn, F* change) {
  const F none = zero(), one = L::set(1.0f);
  const F pull = load(block.full.acceleration);
  const F gained = L::max(pull, none - pull) * L::set(pass.substep * pass.substeps);
  const F pulled = L::select(timed, none, gained);
  F given[P], total[P];
  for (int i = 0; i < P; ++i) {
    given[i] = L::select(timed, none, load(block.friction.normal_sum[i]));
    total[i] = given[i] + change[i];
  }
  F taken = none, back = none;
  for (int i = 0; i < P; ++i) {
    const F own = inverse_or_zero(load(block.points.mass[i]));
    F by_given = own * given[i], by_total = own * total[i];
    if constexpr (P > 1) {
      for (int j = 0; j < P; ++j) {
        if (j == i) continue;
        const F coupling = load(block.points.coupling[slot_of(i, j)]);
        by_given = by_given + coupling * given[j];
        by_total = by_total + coupling * total[j];
      }
    }
    taken = taken - total[i] * ((vn[i] - by_given) - pulled);
    back = back + total[i] * by_total;
  }
  const M gains = L::less(taken + taken, back);
  const F part = L::max(taken + taken, none) / L::select(gains, back, one);
  for (int i = 0; i < P; ++i) change[i] = L::select(gains, total[i] * part - given[i], change[i]);
}

// The speed wanted is that of the free flight at touch, carried to where the point is now along the
// parabola; not below the surface, where a body that rests under a great load would be thrown up in
// every step.
template <int P>
SKERRY_LANE Bounce<P> bounce_of(const ContactBlock<W, P, true>& block, const F* s) {
  const F none = zero(), one = L::set(1.0f);
  const F pull = L::select(is_timed(block), none, load(block.full.acceleration));
  const F twice = pull + pull;
  Bounce<P> bounce;
  F bouncing = none;
  bounce.points = none;
  for (int i = 0; i < P; ++i) {
    const F square = load(block.full.bounce[i]);
    const M pressed = L::less(none, load(block.full.max_impulse[i]));
    const M bounces = L::both(L::less(none, square), pressed);
    const F speed = L::sqrt(L::max(square + twice * L::max(s[i], none), none));
    bouncing = bouncing + L::select(bounces, one, none);
    bounce.points = bounce.points + L::select(pressed, one, none);
    Wanted<P>& w = bounce.wanted;
    w.bias[i] = L::select(bounces, none - speed, L::select(pressed, none, L::set(kNoMeeting)));
    w.old[i] = L::select(bounces, load(block.friction.normal_sum[i]), none);
    w.scale[i] = one;
    w.leak[i] = none;
  }
  bounce.any = L::less(none, bouncing);
  return bounce;
}

template <int P, bool kFull>
SKERRY_LANE void solve_bounce(const ContactBlock<W, P, kFull>& block, const Bounce<P>& bounce,
                              const F* vn, F* impulse) {
  const Wanted<P>& w = bounce.wanted;
  if constexpr (P == 1) {
    impulse[0] = L::max(w.old[0] - load(block.points.mass[0]) * (vn[0] + w.bias[0]), zero());
  } else {
    const M fails = L::either(solve_together(block, w, vn, impulse),
                              L::less(bounce.points, L::set(static_cast<float>(P))));
    if (!L::any(L::both(fails, bounce.any))) return;
    F other[P];
    solve_side_by_side<kBounceRounds>(block, w, vn, other);
    for (int i = 0; i < P; ++i) impulse[i] = L::select(fails, other[i], impulse[i]);
  }
}

// ---- Impacts among several bodies (docs/decisions/0024).

// Whether the contact pushed in this step.
template <int P, bool kFull>
SKERRY_LANE M pushed(const ContactBlock<W, P, kFull>& block) {
  F sum = load(block.friction.normal_sum[0]);
  for (int i = 1; i < P; ++i) sum = sum + load(block.friction.normal_sum[i]);
  return L::less(zero(), sum);
}

// How many contacts push a body.
template <int P, bool kFull>
SKERRY_LANE void count_block(const ContactPass& pass, const ContactBlock<W, P, kFull>& block) {
  Marked a = gather_marked(pass, block.row_a), b = gather_marked(pass, block.row_b);
  const F one = L::select(pushed(block), L::set(1.0f), zero());
  a.pushes = a.pushes + one;
  b.pushes = b.pushes + one;
  scatter_marked(pass, block.row_a, a);
  scatter_marked(pass, block.row_b, b);
}

// Bodies of an impact are struck if one of them has other contacts too, and so are those that they
// push.
template <int P, bool kFull>
SKERRY_LANE void strike_block(const ContactPass& pass, const ContactBlock<W, P, kFull>& block) {
  Marked a = gather_marked(pass, block.row_a), b = gather_marked(pass, block.row_b);
  const F none = zero(), one = L::set(1.0f);
  M strikes = L::less(none, L::max(a.struck, b.struck));
  if constexpr (kFull) {
    const M several = L::less(one, L::max(a.pushes, b.pushes));
    strikes = L::either(strikes, L::both(any_bounces(block), several));
  }
  strikes = L::both(strikes, pushed(block));
  a.struck = L::select(strikes, one, a.struck);
  b.struck = L::select(strikes, one, b.struck);
  scatter_marked(pass, block.row_a, a);
  scatter_marked(pass, block.row_b, b);
}

// Takes back what a contact between struck bodies gave, but for the load that it carried before
// where that holds one of them.
// What it is from now on: `carried` is 1 + restitution, 0 for contacts between others.
template <int P, bool kFull>
static void take_back(const ContactPass& pass, const LaneInput& input, void* memory) {
  auto& block = *static_cast<ContactBlock<W, P, kFull>*>(memory);
  Marked a = gather_marked(pass, block.row_a), b = gather_marked(pass, block.row_b);
  const Frame<P, kFull> f = load_frame(block);
  const F none = zero(), one = L::set(1.0f), substeps = L::set(pass.substeps);
  const M struck = L::both(L::less(none, L::max(a.struck, b.struck)), pushed(block));
  const M held = L::less(none, L::load(input.held));
  F old[4], material[4];
  gather_row(input, kImpulseRow, old);
  gather_row(input, kMaterialRow, material);
  NormalSum sum = {none, none, none};
  F rests = none, all = none;
  for (int i = 0; i < P; ++i) {
    const F given = load(block.friction.normal_sum[i]);
    all = all + given;
    const F load_before = L::select(L::both(held, L::less(none, load(block.points.mass[i]))),
                                    L::max(L::min(old[i] * substeps, given), none), none);
    const F d = L::select(struck, load_before - given, none);
    sum.push = sum.push + d;
    if constexpr (P > 1) {
      sum.torque1 = sum.torque1 + load(block.points.v[i]) * d;
      sum.torque2 = sum.torque2 - load(block.points.u[i]) * d;
    }
    accumulate(block.friction.normal_sum[i], d);
    store(L::select(struck, L::max(old[i], none), load(block.points.impulse[i])),
          block.points.impulse[i]);
    rests = rests + load_before;
    if constexpr (kFull)
      store(L::select(struck, none, load(block.full.bounce[i])), block.full.bounce[i]);
  }
  const M bears = L::less(none, rests);
  a.pushes = L::select(bears, L::set(kBearing), a.pushes);
  b.pushes = L::select(bears, L::set(kBearing), b.pushes);
  const F kept = L::select(struck, rests / L::select(struck, all, one), one);
  const auto lessen = [&](Lanes<W>& given) {
    const F before = load(given), after = before * kept;
    store(after, given);
    return after - before;
  };
  auto& friction = block.friction;
  V push = mul(f.n, sum.push), torque = {none, none, none};
  push = add(push, add(mul(f.t1, lessen(friction.sum[0])), mul(f.t2, lessen(friction.sum[1]))));
  lessen(friction.impulse[0]);
  lessen(friction.impulse[1]);
  if constexpr (P > 1) {
    torque =
        add(add(mul(f.t1, sum.torque1), mul(f.t2, sum.torque2)), mul(f.n, lessen(friction.sum[2])));
    lessen(friction.impulse[2]);
  }
  if constexpr (kFull) {
    auto& full = block.full;
    torque = add(torque, add(mul(f.t1, lessen(full.rolling_sum[0])),
                             mul(f.t2, lessen(full.rolling_sum[1]))));
    lessen(full.rolling_impulse[0]);
    lessen(full.rolling_impulse[1]);
  }
  apply(block, f.ca, f.cb, push, torque, a.v, b.v);
  move_to_impact(pass, input, f, struck, block);
  store(L::select(struck, kFull ? one + material[1] : one, none), block.carried);
  scatter_marked(pass, block.row_a, a);
  scatter_marked(pass, block.row_b, b);
}

// The arms of a struck contact refer to where its bodies are when the impacts happen.
template <int P, bool kFull>
SKERRY_LANE void move_to_impact(const ContactPass& pass, const LaneInput& input, Frame<P, kFull> f,
                                const M& struck, ContactBlock<W, P, kFull>& block) {
  const F none = zero(), half = L::select(struck, L::set(0.5f), none);
  const V shift =
      mul({L::load(input.shift[0]), L::load(input.shift[1]), L::load(input.shift[2])}, half);
  f.ca = add(f.ca, shift);
  f.cb = sub(f.cb, shift);
  store3(f.ca, block.arm_a);
  store3(f.cb, block.arm_b);
  F head[4];
  gather_row(input, kNormalRow, head);
  couple(pass, input, f, L::integers(head[3]), block);
}

// An impact of two, as if they were alone: the points that approach at once, then friction at the centre.
template <int P, bool kFull>
SKERRY_LANE void reflect_block(const ContactPass& pass, ContactBlock<W, P, kFull>& block) {
  Marked a = gather_marked(pass, block.row_a), b = gather_marked(pass, block.row_b);
  const Frame<P, kFull> f = load_frame(block);
  V linear, angular;
  relative_velocity(f, a.v, b.v, linear, angular);
  F vn[P], impulse[P];
  point_velocities(block, f, linear, angular, vn);
  const F none = zero(), one = L::set(1.0f);
  F threshold = none;
  if constexpr (kFull) threshold = none - load(block.full.slowest);
  const F factor = load(block.carried);
  Bounce<P> bounce;
  bounce.points = none;
  for (int i = 0; i < P; ++i) {
    const M meets = L::both(L::less(none, factor), L::less(vn[i], none));
    const F part = L::select(L::less(vn[i], threshold), factor, L::min(factor, one));
    Wanted<P>& w = bounce.wanted;
    w.bias[i] = L::select(meets, vn[i] * (part - one), L::set(kNoMeeting));
    w.scale[i] = one;
    w.old[i] = w.leak[i] = none;
    bounce.points = bounce.points + L::select(meets, one, none);
  }
  bounce.any = L::less(none, bounce.points);
  if (!L::any(bounce.any)) return;
  solve_bounce(block, bounce, vn, impulse);
  if constexpr (P > 1) rescale(block, bounce.any, bounce.wanted, vn, impulse);
  for (int i = 0; i < P; ++i) accumulate(block.friction.normal_sum[i], impulse[i], bounce.any);
  const NormalSum sum = sum_of(block, impulse);
  auto& friction = block.friction;
  F slip[2] = {dot(f.t1, linear), dot(f.t2, linear)};
  slip_after(block, sum, slip);
  F p1 = none, p2 = none;
  solve_disc(friction.inverse, load(friction.slide_mass), load(friction.coefficient) * sum.push,
             slip[0], slip[1], p1, p2);
  accumulate(friction.sum[0], p1, bounce.any);
  accumulate(friction.sum[1], p2, bounce.any);
  V torque = {none, none, none};
  if constexpr (P > 1) torque = add(mul(f.t1, sum.torque1), mul(f.t2, sum.torque2));
  const V push = add(mul(f.n, sum.push), add(mul(f.t1, p1), mul(f.t2, p2)));
  const Velocity before_a = a.v, before_b = b.v;
  apply(block, f.ca, f.cb, push, torque, a.v, b.v);
  a.v = select(bounce.any, a.v, before_a);
  b.v = select(bounce.any, b.v, before_b);
  scatter_marked(pass, block.row_a, a);
  scatter_marked(pass, block.row_b, b);
}

// Two that would fly into each other, since impulses of few passes do not part all of them, are moved apart
// straight and with their common centre of mass at rest: that gives no momentum, and little moment of it.
template <int P, bool kFull>
SKERRY_LANE void part_block(const ContactPass& pass, const ContactBlock<W, P, kFull>& block) {
  const F none = zero();
  const F depth = flown_depth(pass, block);
  if (!L::any(L::less(none, depth))) return;
  V mass_a, mass_b;
  inverse_masses(block, mass_a, mass_b);
  const V n = load3(block.normal);
  const F heavy = inverse_or_zero(dot(n, add(along(n, mass_a), along(n, mass_b))));
  const F part = L::min(depth, L::set(pass.max_push * pass.substep)) * heavy;
  const F one = L::set(1.0f);
  const F fixed_a = L::select(L::less(none, dot(n, along(n, mass_a))), none, one);
  const F fixed_b = L::select(L::less(none, dot(n, along(n, mass_b))), none, one);
  shift_flown(pass, block.row_a, mul(along(n, mass_a), none - part), fixed_b);
  shift_flown(pass, block.row_b, mul(along(n, mass_b), part), fixed_a);
}
SKERRY_LANE V along(const V& direction, const V& mass) {
  return {direction.x * mass.x, direction.y * mass.y, direction.z * mass.z};
}

// m: by how much they overlap after the step, beyond what the substeps leave; 0: not at all.
template <int P, bool kFull>
SKERRY_LANE F flown_depth(const ContactPass& pass, const ContactBlock<W, P, kFull>& block) {
  const Frame<P, kFull> f = load_frame(block);
  const F none = zero();
  F flown[P], moved[P];
  separations(gather_way(pass.flown, block.row_a), gather_way(pass.flown, block.row_b), block, f,
              flown);
  separations(pass, block, f, moved);
  F deepest = none;
  for (int i = 0; i < P; ++i) {
    const F depth = L::min(moved[i], none) - flown[i];
    const M there = L::less(none, load(block.points.mass[i]));
    deepest = L::max(deepest, L::select(there, depth, none));
  }
  return deepest;
}
// `from_fixed`: 1 if the other body does not give way, else 0.
SKERRY_LANE void shift_flown(const ContactPass& pass, const std::uint32_t* index, const V& by,
                             const F& from_fixed) {
  alignas(32) float sink[8];
  float* address[W];
  float* base = floats(pass.flown);
  for (int i = 0; i < W; ++i)
    address[i] = index[i] - 1 < pass.dynamic_end - 1 ? base + std::size_t{index[i]} * 8 : sink;
  F t[4];
  L::gather(base, 8, index, t);
  const F fallen = t[3] + from_fixed * dot(gather_acceleration(pass, index), by);
  const F moved[4] = {t[0] + by.x, t[1] + by.y, t[2] + by.z, fallen};
  L::scatter(moved, address);
}
