// The contact kernels, written once over a lane type L (see reference_lanes.h). Included inside a
// namespace, once per instruction set; no function here may come from outside it. SKERRY_LANE is what
// the functions are declared with. Maths and names: docs/solver.md. Every choice is made per lane;
// whole-block shortcuts only where all lanes would keep their value anyway.

template <class L>
struct KernelsOf {
  using F = typename L::F;
  using M = typename L::M;
  static constexpr int W = L::kWidth;

  struct V {
    F x, y, z;
  };
  struct Velocity {
    V linear, angular;
  };
  struct Sym {
    F xx, xy, xz, yy, yz, zz;
  };

  SKERRY_LANE V add(const V& a, const V& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  SKERRY_LANE V sub(const V& a, const V& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  SKERRY_LANE V mul(const V& a, const F& s) { return {a.x * s, a.y * s, a.z * s}; }
  SKERRY_LANE V mul(const V& a, const V& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  SKERRY_LANE F dot(const V& a, const V& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
  SKERRY_LANE V cross(const V& a, const V& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
  SKERRY_LANE V mul(const Sym& m, const V& v) {
    return {(m.xx * v.x + m.xy * v.y) + m.xz * v.z, (m.xy * v.x + m.yy * v.y) + m.yz * v.z,
            (m.xz * v.x + m.yz * v.y) + m.zz * v.z};
  }
  SKERRY_LANE V select(const M& m, const V& yes, const V& no) {
    return {L::select(m, yes.x, no.x), L::select(m, yes.y, no.y), L::select(m, yes.z, no.z)};
  }
  SKERRY_LANE Velocity select(const M& m, const Velocity& yes, const Velocity& no) {
    return {select(m, yes.linear, no.linear), select(m, yes.angular, no.angular)};
  }
  SKERRY_LANE F zero() { return L::set(0.0f); }
  // 1 / x, or 0 where x is not positive.
  SKERRY_LANE F inverse_or_zero(const F& x) {
    return L::select(L::less(zero(), x), L::set(1.0f) / x, zero());
  }

  SKERRY_LANE F load(const Lanes<W>& a) { return L::load(a.v); }
  SKERRY_LANE void store(const F& a, Lanes<W>& to) { L::store(a, to.v); }
  SKERRY_LANE V load3(const Lanes<W>* a) { return {load(a[0]), load(a[1]), load(a[2])}; }
  SKERRY_LANE void store3(const V& a, Lanes<W>* to) {
    store(a.x, to[0]);
    store(a.y, to[1]);
    store(a.z, to[2]);
  }
  SKERRY_LANE Sym load_sym(const Lanes<W>* a) {
    return {load(a[0]), load(a[1]), load(a[2]), load(a[3]), load(a[4]), load(a[5])};
  }

  // Rows as plain floats: 8 each, 16 for SpinRow.
  template <class Row>
  SKERRY_LANE auto* floats(Row* rows) {
    if constexpr (std::is_const_v<Row>) {
      return reinterpret_cast<const float*>(rows);
    } else {
      return reinterpret_cast<float*>(rows);
    }
  }
  SKERRY_LANE Velocity gather_velocity(const VelocityRow* rows, const std::uint32_t* index) {
    const float* base = floats(rows);
    F a[4], b[4];
    L::gather(base, 8, index, a);
    L::gather(base + 4, 8, index, b);
    return {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}};
  }
  // Rows of bodies that are not solved go to a sink.
  SKERRY_LANE void scatter_velocity(const ContactPass& pass, const std::uint32_t* index,
                                    const Velocity& v) {
    scatter_marked(pass, index, {v, zero(), zero()});
  }
  // A velocity, and what passes over impacts mark its body with (VelocityRow).
  struct Marked {
    Velocity v;
    F pushes, struck;
  };
  SKERRY_LANE Marked gather_marked(const ContactPass& pass, const std::uint32_t* index) {
    const float* base = floats(pass.velocity);
    F a[4], b[4];
    L::gather(base, 8, index, a);
    L::gather(base + 4, 8, index, b);
    return {{{a[0], a[1], a[2]}, {b[0], b[1], b[2]}}, a[3], b[3]};
  }
  SKERRY_LANE void scatter_marked(const ContactPass& pass, const std::uint32_t* index,
                                  const Marked& body) {
    alignas(32) float sink[8];
    float* base = floats(pass.velocity);
    const std::uint32_t solved = pass.dynamic_end - 1;
    float* low[W];
    float* high[W];
    for (int i = 0; i < W; ++i) {
      float* row = base + std::size_t{index[i]} * 8;
      low[i] = index[i] - 1 < solved ? row : sink;
      high[i] = low[i] + 4;
    }
    const Velocity& v = body.v;
    const F a[4] = {v.linear.x, v.linear.y, v.linear.z, body.pushes};
    const F b[4] = {v.angular.x, v.angular.y, v.angular.z, body.struck};
    L::scatter(a, low);
    L::scatter(b, high);
  }

  // ---- What a block is made of, in registers.
  template <int P, bool kFull>
  struct Frame {
    V n, t1, t2, ca, cb;
  };
  template <int P, bool kFull>
  SKERRY_LANE Frame<P, kFull> load_frame(const ContactBlock<W, P, kFull>& block) {
    Frame<P, kFull> f;
    f.n = load3(block.normal);
    f.t1 = load3(block.tangent);
    f.t2 = cross(f.n, f.t1);
    f.ca = load3(block.arm_a);
    f.cb = load3(block.arm_b);
    return f;
  }

  template <int P, bool kFull>
  SKERRY_LANE void inverse_masses(const ContactBlock<W, P, kFull>& block, V& a, V& b) {
    if constexpr (kFull) {
      a = load3(block.full.inv_mass_a);
      b = load3(block.full.inv_mass_b);
    } else {
      const F ma = load(block.full.inv_mass_a), mb = load(block.full.inv_mass_b);
      a = {ma, ma, ma};
      b = {mb, mb, mb};
    }
  }

  // Applies a push at the contact centre and a torque, both on b.
  template <int P, bool kFull>
  SKERRY_LANE void apply(const ContactBlock<W, P, kFull>& block, const V& ca, const V& cb,
                         const V& push, const V& torque, Velocity& a, Velocity& b) {
    V ma, mb;
    inverse_masses(block, ma, mb);
    a.linear = sub(a.linear, mul(push, ma));
    b.linear = add(b.linear, mul(push, mb));
    a.angular = sub(a.angular, mul(load_sym(block.inertia_a), add(cross(ca, push), torque)));
    b.angular = add(b.angular, mul(load_sym(block.inertia_b), add(cross(cb, push), torque)));
  }

  // R^T n - n of a small rotation.
  SKERRY_LANE V turned_back(const F* q, const V& n) {
    const V axis = {q[0], q[1], q[2]};
    const V c = cross(axis, n);
    const V e = sub(cross(axis, c), mul(c, q[3]));
    return add(e, e);
  }

  // How far a body has come since the start of the step (DeltaRow).
  struct Way {
    F translation[4], rotation[4];
  };
  SKERRY_LANE Way gather_way(const DeltaRow* rows, const std::uint32_t* index) {
    Way way;
    L::gather(floats(rows), 8, index, way.translation);
    L::gather(floats(rows) + 4, 8, index, way.rotation);
    return way;
  }

  // Separation of each point now.
  template <int P, bool kFull>
  SKERRY_LANE void separations(const ContactPass& pass, const ContactBlock<W, P, kFull>& block,
                               const Frame<P, kFull>& f, F* s) {
    const DeltaRow* rows = pass.delta;
    separations(gather_way(rows, block.row_a), gather_way(rows, block.row_b), block, f, s);
  }
  template <int P, bool kFull>
  SKERRY_LANE void separations(const Way& a, const Way& b, const ContactBlock<W, P, kFull>& block,
                               const Frame<P, kFull>& f, F* s) {
    const F *da = a.translation, *db = b.translation;
    const V ea = turned_back(a.rotation, f.n), eb = turned_back(b.rotation, f.n);
    const V d = {db[0] - da[0], db[1] - da[1], db[2] - da[2]};
    // A rounded surface turns about the centre of its rounding.
    const F rounds = load(block.rounding_a) * dot(ea, f.n) + load(block.rounding_b) * dot(eb, f.n);
    const F center = dot(f.n, d) + ((dot(eb, f.cb) - dot(ea, f.ca)) + rounds);
    if constexpr (P == 1) {
      s[0] = load(block.points.separation[0]) + center;
    } else {
      const V e = sub(eb, ea);
      const F e1 = dot(e, f.t1), e2 = dot(e, f.t2);
      for (int i = 0; i < P; ++i) {
        s[i] = load(block.points.separation[i]) +
               (center + (load(block.points.u[i]) * e1 + load(block.points.v[i]) * e2));
      }
    }
  }

  template <int P, bool kFull>
  SKERRY_LANE void relative_velocity(const Frame<P, kFull>& f, const Velocity& a, const Velocity& b,
                                     V& linear, V& angular) {
    linear = sub(add(b.linear, cross(b.angular, f.cb)), add(a.linear, cross(a.angular, f.ca)));
    angular = sub(b.angular, a.angular);
  }

  template <int P, bool kFull>
  SKERRY_LANE void point_velocities(const ContactBlock<W, P, kFull>& block,
                                    const Frame<P, kFull>& f, const V& linear, const V& angular,
                                    F* vn) {
    const F center = dot(f.n, linear);
    if constexpr (P == 1) {
      vn[0] = center;
    } else {
      const F w1 = dot(f.t1, angular), w2 = dot(f.t2, angular);
      for (int i = 0; i < P; ++i) {
        vn[i] = center + (load(block.points.v[i]) * w1 - load(block.points.u[i]) * w2);
      }
    }
  }

  // Impulse change so far, conjugate to the velocities (normal, about t1, about t2).
  struct NormalSum {
    F push, torque1, torque2;
  };
  template <int P, bool kFull>
  SKERRY_LANE NormalSum sum_of(const ContactBlock<W, P, kFull>& block, const F* change) {
    if constexpr (P == 1) {
      return {change[0], zero(), zero()};
    } else {
      NormalSum sum = {zero(), zero(), zero()};
      for (int i = 0; i < P; ++i) {
        sum.push = sum.push + change[i];
        sum.torque1 = sum.torque1 + load(block.points.v[i]) * change[i];
        sum.torque2 = sum.torque2 - load(block.points.u[i]) * change[i];
      }
      return sum;
    }
  }

  // ---- Passes.

  // m: a smaller gap counts as none where bodies may bounce. After an impact all points lie within
  // rounding of the surface, on either side of it, and must be treated alike.
  template <bool kFull>
  static constexpr float kTouching = kFull ? 1e-5f : 0.0f;

  static constexpr float kNoMeeting = 1e6f;  // m/s: a bias that no approach reaches

  // What a pass asks of the points: velocities -bias, by `scale` of the effective mass, while `leak`
  // of the impulse goes. Only of what is beyond the carried load: nothing pushes a point that bears less.
  template <int P>
  struct Wanted {
    F bias[P], scale[P], leak[P], old[P];
  };
  template <int P, bool kFull>
  SKERRY_LANE Wanted<P> wanted(const ContactPass& pass, const ContactBlock<W, P, kFull>& block,
                               const F* s, bool soft) {
    const F none = zero(), one = L::set(1.0f), inv_h = L::set(pass.inv_substep);
    const F carried = load(block.carried);
    Wanted<P> w;
    for (int i = 0; i < P; ++i) {
      const M apart = L::less(L::set(kTouching<kFull>), s[i]);
      w.old[i] = load(block.points.impulse[i]);
      F push = none;
      w.scale[i] = one;
      w.leak[i] = none;
      if (soft) {
        push = L::max(s[i] * L::set(pass.soft.bias_rate), L::set(-pass.max_push));
        w.scale[i] = L::select(apart, one, L::set(pass.soft.mass_scale));
        const F scale = L::select(apart, none, L::set(pass.soft.impulse_scale));
        const F most = load(block.points.mass[i]) * L::set(pass.soft_load);
        w.leak[i] = scale * L::max(L::min(w.old[i] - carried, most), none);
      }
      w.bias[i] = L::select(apart, s[i] * inv_h, push);
      if constexpr (kFull) {
        // What would bounce, but not before the next step, is left to that.
        if (!soft && pass.last) {
          const M waits = L::both(L::both(apart, L::less(none, load(block.full.bounce[i]))),
                                  L::less(w.old[i], L::set(1e-30f)));
          w.bias[i] = L::select(waits, L::set(kNoMeeting), w.bias[i]);
        }
      }
    }
    return w;
  }

  template <int P, bool kFull>
  SKERRY_LANE NormalSum solve_normals(const ContactPass& pass, ContactBlock<W, P, kFull>& block,
                                      const F* s, F* vn, bool soft, F* impulse) {
    const Wanted<P> w = wanted(pass, block, s, soft);
    if constexpr (P == 1) {
      const F mass = load(block.points.mass[0]) * w.scale[0];
      impulse[0] = L::max(w.old[0] - (mass * (vn[0] + w.bias[0]) + w.leak[0]), zero());
      store(impulse[0], block.points.impulse[0]);
      return {impulse[0] - w.old[0], zero(), zero()};
    } else {
      F nearest = s[0], farthest = s[0];
      for (int i = 1; i < P; ++i) {
        nearest = L::min(nearest, s[i]);
        farthest = L::max(farthest, s[i]);
      }
      const M mixed = L::both(L::less(L::set(kTouching<kFull>), farthest),
                              L::less(nearest, L::set(kTouching<kFull> + 1e-30f)));
      const M fails = L::either(mixed, solve_together(block, w, vn, impulse));
      if (L::any(fails)) {
        F other[P];
        solve_side_by_side<kPassRounds>(block, w, vn, other);
        for (int i = 0; i < P; ++i) impulse[i] = L::select(fails, other[i], impulse[i]);
      }
      F change[P];
      for (int i = 0; i < P; ++i) {
        change[i] = impulse[i] - w.old[i];
        store(impulse[i], block.points.impulse[i]);
      }
      return sum_of(block, change);
    }
  }

  // Four points that all press or all are still apart, by one exact solve that knows no order of the
  // points (docs/decisions/0007). Returns where it fails: there its impulses mean nothing.
  template <int P, bool kFull>
  SKERRY_LANE M solve_together(const ContactBlock<W, P, kFull>& block, const Wanted<P>& w,
                               const F* vn, F* impulse) {
    const F none = zero();
    F error[3] = {none, none, none};
    F u[P], v[P];
    for (int i = 0; i < P; ++i) {
      u[i] = load(block.points.u[i]);
      v[i] = load(block.points.v[i]);
      const F e = vn[i] + w.bias[i];
      error[0] = error[0] + e;
      error[1] = error[1] + v[i] * e;
      error[2] = error[2] - u[i] * e;
    }
    F m[6];
    for (int k = 0; k < 6; ++k) m[k] = load(block.points.together[k]);
    const F p0 = ((m[0] * error[0] + m[1] * error[1]) + m[2] * error[2]) * w.scale[0];
    const F p1 = ((m[1] * error[0] + m[3] * error[1]) + m[4] * error[2]) * w.scale[0];
    const F p2 = ((m[2] * error[0] + m[4] * error[1]) + m[5] * error[2]) * w.scale[0];
    F least = none;
    for (int i = 0; i < P; ++i) {
      impulse[i] = w.old[i] - ((p0 + (v[i] * p1 - u[i] * p2)) + w.leak[i]);
      least = L::min(least, impulse[i]);
    }
    return L::either(L::less(m[0], none), L::less(least, none));
  }

  static constexpr int kPassRounds = 2;     // the next pass goes on from there
  static constexpr int kBounceRounds = 32;  // there is no next; two ends of a rod: (2/3)^32
  // Points of which some press: rounds in which each of these stops as if those beside it moved alike.
  // The sum of couplings bounds their matrix, so that a round never overshoots, and no point is first.
  // What gives way under an unusual load are the points' velocities together, by the same matrix as the
  // loads act by: as in solve_together, which a manifold must be able to go over to without a jerk.
  template <int kRounds, int P, bool kFull>
  SKERRY_LANE void solve_side_by_side(const ContactBlock<W, P, kFull>& block, const Wanted<P>& w,
                                      const F* vn, F* impulse) {
    const F none = zero(), one = L::set(1.0f);
    F own[P], coupling[6], bound[6], error[P];
    for (int i = 0; i < P; ++i) {
      impulse[i] = w.old[i];
      own[i] = inverse_or_zero(load(block.points.mass[i]));
    }
    for (int k = 0; k < 6; ++k) {
      coupling[k] = load(block.points.coupling[k]);
      bound[k] = L::max(coupling[k], none - coupling[k]);
    }
    for (int i = 0; i < P; ++i) {
      F gives = w.leak[i] * own[i];
      for (int j = 0; j < P; ++j) {
        if (j != i) gives = gives + coupling[slot_of(i, j)] * w.leak[j];
      }
      error[i] =
          (vn[i] + w.bias[i]) * w.scale[i] + L::select(L::less(w.scale[i], one), gives, none);
    }
    for (int round = 0; round < kRounds; ++round) {
      F presses[P], change[P];
      for (int i = 0; i < P; ++i) {
        const M acts = L::either(L::less(none, impulse[i]), L::less(error[i], none));
        presses[i] = L::select(L::both(acts, L::less(none, own[i])), one, none);
      }
      for (int i = 0; i < P; ++i) {
        F beside = own[i];
        for (int j = 0; j < P; ++j) {
          if (j != i) beside = beside + bound[slot_of(i, j)] * presses[j];
        }
        const F d = error[i] * inverse_or_zero(beside);
        change[i] = L::max(impulse[i] - d * presses[i], none) - impulse[i];
      }
      for (int i = 0; i < P; ++i) {
        impulse[i] = impulse[i] + change[i];
        if (round + 1 == kRounds) continue;
        F dv = change[i] * own[i];
        for (int j = 0; j < P; ++j) {
          if (j != i) dv = dv + coupling[slot_of(i, j)] * change[j];
        }
        error[i] = error[i] + dv;
      }
    }
  }
  static constexpr int slot_of(int i, int j) {
    constexpr int first[4] = {0, 3, 5, 6};  // coupling of i with i + 1
    return i < j ? first[i] + (j - i - 1) : first[j] + (i - j - 1);
  }

  // New value of a two-component impulse inside a circle. Sticking uses the full 2x2 inverse; a
  // sliding impulse steps along the velocity, so that its fixed point opposes the slip exactly.
  SKERRY_LANE void solve_disc(const Lanes<W>* inverse, const F& slide_mass, const F& limit,
                              const F& v1, const F& v2, F& p1, F& p2) {
    const F i11 = load(inverse[0]), i12 = load(inverse[1]), i22 = load(inverse[2]);
    const F stick1 = p1 - (i11 * v1 + i12 * v2), stick2 = p2 - (i12 * v1 + i22 * v2);
    const F limit2 = limit * limit;
    const M slides = L::less(limit2, stick1 * stick1 + stick2 * stick2);
    p1 = L::select(slides, p1 - slide_mass * v1, stick1);
    p2 = L::select(slides, p2 - slide_mass * v2, stick2);
    const F length2 = p1 * p1 + p2 * p2;
    const M outside = L::less(limit2, length2);
    const F scale = L::select(outside, limit / L::sqrt(L::select(outside, length2, L::set(1.0f))),
                              L::set(1.0f));
    p1 = p1 * scale;
    p2 = p2 * scale;
  }

  SKERRY_LANE void accumulate(Lanes<W>& sum, const F& x) { store(load(sum) + x, sum); }
  SKERRY_LANE void accumulate(Lanes<W>& sum, const F& x, const M& where) {
    store(L::select(where, load(sum) + x, load(sum)), sum);
  }

  template <int P, bool kFull, bool kRelax>
  SKERRY_LANE void pass_block(const ContactPass& pass, ContactBlock<W, P, kFull>& block) {
    Velocity a = gather_velocity(pass.velocity, block.row_a);
    Velocity b = gather_velocity(pass.velocity, block.row_b);
    const Frame<P, kFull> f = load_frame(block);
    F s[P], vn[P], impulse[P];
    separations(pass, block, f, s);
    V linear, angular;
    relative_velocity(f, a, b, linear, angular);
    point_velocities(block, f, linear, angular, vn);
    const NormalSum sum = solve_normals(pass, block, s, vn, !kRelax, impulse);
    V push = mul(f.n, sum.push);
    V torque;
    if constexpr (P > 1) {
      torque = add(mul(f.t1, sum.torque1), mul(f.t2, sum.torque2));
    } else {
      torque = {zero(), zero(), zero()};
    }
    if constexpr (kRelax) {
      add_friction(pass, block, f, linear, angular, sum, impulse, push, torque);
    }
    apply(block, f.ca, f.cb, push, torque, a, b);
    if constexpr (kRelax && kFull) roll(pass, block, f, a, b, impulse);
    if constexpr (kRelax && P == 1) {
      if (pass.last) twist_on_spot(block, f, a, b);
    }
    scatter_velocity(pass, block.row_a, a);
    scatter_velocity(pass, block.row_b, b);
  }

  // The velocities `v` along the tangents after normal impulses.
  template <int P, bool kFull>
  SKERRY_LANE void slip_after(const ContactBlock<W, P, kFull>& block, const NormalSum& sum, F* v) {
    for (int k = 0; k < 2; ++k) {
      const auto& from = block.friction.from_normal[k];
      v[k] = v[k] + load(from[0]) * sum.push;
      if constexpr (P > 1) {
        v[k] = v[k] + (load(from[1]) * sum.torque1 + load(from[2]) * sum.torque2);
      }
    }
  }

  template <int P, bool kFull>
  SKERRY_LANE void add_friction(const ContactPass& pass, ContactBlock<W, P, kFull>& block,
                                const Frame<P, kFull>& f, const V& linear, const V& angular,
                                const NormalSum& sum, const F* impulse, V& push, V& torque) {
    constexpr int kRows = P > 1 ? 3 : 2;
    auto& friction = block.friction;
    F drag[kRows];
    for (int k = 0; k < kRows; ++k) drag[k] = load(friction.impulse[k]);
    solve_friction(block, f, linear, angular, sum, impulse, drag, push, torque);
    for (int k = 0; k < kRows; ++k) store(drag[k], friction.impulse[k]);
    if (pass.books) {
      for (int i = 0; i < P; ++i) accumulate(friction.normal_sum[i], impulse[i]);
      for (int k = 0; k < kRows; ++k) accumulate(friction.sum[k], drag[k]);
      if constexpr (kFull) {
        for (int i = 0; i < P; ++i) {
          store(L::max(load(block.full.max_impulse[i]), impulse[i]), block.full.max_impulse[i]);
        }
      }
    }
  }

  // Friction and twist within what normal impulses allow; `sum` has changed the velocities since
  // `linear` and `angular` were taken. `drag`: the impulses so far, and then.
  template <int P, bool kFull>
  SKERRY_LANE void solve_friction(const ContactBlock<W, P, kFull>& block, const Frame<P, kFull>& f,
                                  const V& linear, const V& angular, const NormalSum& sum,
                                  const F* impulse, F* drag, V& push, V& torque) {
    const auto& friction = block.friction;
    F total = impulse[0];
    for (int i = 1; i < P; ++i) total = total + impulse[i];
    const F coefficient = load(friction.coefficient);
    F v[2] = {dot(f.t1, linear), dot(f.t2, linear)};
    slip_after(block, sum, v);
    const F old1 = drag[0], old2 = drag[1];
    solve_disc(friction.inverse, load(friction.slide_mass), coefficient * total, v[0], v[1],
               drag[0], drag[1]);
    const F d1 = drag[0] - old1, d2 = drag[1] - old2;
    push = add(push, add(mul(f.t1, d1), mul(f.t2, d2)));
    if constexpr (P > 1) {
      F moment = zero();
      for (int i = 0; i < P; ++i) moment = moment + load(friction.lever[i]) * impulse[i];
      const F limit = coefficient * moment;
      const F spin = dot(f.n, angular) +
                     ((load(friction.twist_from[0]) * sum.push +
                       (load(friction.twist_from[1]) * sum.torque1 +
                        load(friction.twist_from[2]) * sum.torque2)) +
                      (load(friction.twist_from[3]) * d1 + load(friction.twist_from[4]) * d2));
      const F old = drag[2];
      drag[2] = L::max(L::min(old - load(friction.twist_mass) * spin, limit), zero() - limit);
      torque = add(torque, mul(f.n, drag[2] - old));
    }
  }

  // Two bodies touch at a point by a small patch, which rubs where one spins on the other: once per
  // step, up to what the pushes of all its substeps allow (docs/decisions/0026).
  template <bool kFull>
  SKERRY_LANE void twist_on_spot(ContactBlock<W, 1, kFull>& block, const Frame<1, kFull>& f,
                                 Velocity& a, Velocity& b) {
    auto& friction = block.friction;
    const V turn_a = mul(load_sym(block.inertia_a), f.n),
            turn_b = mul(load_sym(block.inertia_b), f.n);
    const F gives = dot(f.n, add(turn_a, turn_b));
    const F stop = (zero() - dot(f.n, sub(b.angular, a.angular))) / gives;
    const F limit = load(friction.twist_reach) * load(friction.normal_sum[0]);
    const F twist =
        L::select(L::less(zero(), gives), L::max(L::min(stop, limit), zero() - limit), zero());
    store(twist, friction.twist);
    a.angular = sub(a.angular, mul(turn_a, twist));
    b.angular = add(b.angular, mul(turn_b, twist));
  }

  // Rolling resistance: a torque about the tangents, up to coefficient (m) times the push.
  template <int P>
  SKERRY_LANE void roll(const ContactPass& pass, ContactBlock<W, P, true>& block,
                        const Frame<P, true>& f, Velocity& a, Velocity& b, const F* impulse) {
    auto& full = block.full;
    F total = impulse[0];
    for (int i = 1; i < P; ++i) total = total + impulse[i];
    const V angular = sub(b.angular, a.angular);
    const F old1 = load(full.rolling_impulse[0]), old2 = load(full.rolling_impulse[1]);
    F p1 = old1, p2 = old2;
    solve_disc(full.rolling_inverse, load(full.rolling_slide_mass),
               load(full.rolling_coefficient) * total, dot(f.t1, angular), dot(f.t2, angular), p1,
               p2);
    store(p1, full.rolling_impulse[0]);
    store(p2, full.rolling_impulse[1]);
    if (pass.books) {
      accumulate(full.rolling_sum[0], p1);
      accumulate(full.rolling_sum[1], p2);
    }
    const V torque = add(mul(f.t1, p1 - old1), mul(f.t2, p2 - old2));
    a.angular = sub(a.angular, mul(load_sym(block.inertia_a), torque));
    b.angular = add(b.angular, mul(load_sym(block.inertia_b), torque));
  }

  template <int P, bool kFull>
  SKERRY_LANE void warm_start_block(const ContactPass& pass, ContactBlock<W, P, kFull>& block) {
    Velocity a = gather_velocity(pass.velocity, block.row_a);
    Velocity b = gather_velocity(pass.velocity, block.row_b);
    const Frame<P, kFull> f = load_frame(block);
    const auto& friction = block.friction;
    F total = load(block.points.impulse[0]);
    for (int i = 1; i < P; ++i) total = total + load(block.points.impulse[i]);
    const V push = add(mul(f.n, total), add(mul(f.t1, load(friction.impulse[0])),
                                            mul(f.t2, load(friction.impulse[1]))));
    V torque = {zero(), zero(), zero()};
    if constexpr (P > 1) {
      F torque1 = zero(), torque2 = zero();
      for (int i = 0; i < P; ++i) {
        torque1 = torque1 + load(block.points.v[i]) * load(block.points.impulse[i]);
        torque2 = torque2 - load(block.points.u[i]) * load(block.points.impulse[i]);
      }
      torque =
          add(add(mul(f.t1, torque1), mul(f.t2, torque2)), mul(f.n, load(friction.impulse[2])));
    }
    if constexpr (kFull) {
      torque = add(torque, add(mul(f.t1, load(block.full.rolling_impulse[0])),
                               mul(f.t2, load(block.full.rolling_impulse[1]))));
    }
    apply(block, f.ca, f.cb, push, torque, a, b);
    scatter_velocity(pass, block.row_a, a);
    scatter_velocity(pass, block.row_b, b);
  }

#include "solver/contact_impacts.inl"

#include "solver/contact_rows.inl"

  template <int P, bool kFull>
  static void warm_start(const ContactPass& pass, void* memory, std::uint32_t count) {
    auto* blocks = static_cast<ContactBlock<W, P, kFull>*>(memory);
    for (std::uint32_t i = 0; i < count; ++i) warm_start_block(pass, blocks[i]);
  }
  template <int P, bool kFull, bool kRelax>
  static void run_pass(const ContactPass& pass, void* memory, std::uint32_t count) {
    auto* blocks = static_cast<ContactBlock<W, P, kFull>*>(memory);
    for (std::uint32_t i = 0; i < count; ++i) pass_block<P, kFull, kRelax>(pass, blocks[i]);
  }
  template <int P, bool kFull>
  static void restitute(const ContactPass& pass, void* memory, std::uint32_t count) {
    if constexpr (kFull) {
      auto* blocks = static_cast<ContactBlock<W, P, kFull>*>(memory);
      for (std::uint32_t i = 0; i < count; ++i) restitute_block(pass, blocks[i]);
    }
  }

  template <int P, bool kFull>
  static void count_pushes(const ContactPass& pass, void* memory, std::uint32_t count) {
    auto* blocks = static_cast<ContactBlock<W, P, kFull>*>(memory);
    for (std::uint32_t i = 0; i < count; ++i) count_block(pass, blocks[i]);
  }
  template <int P, bool kFull>
  static void strike(const ContactPass& pass, void* memory, std::uint32_t count) {
    auto* blocks = static_cast<ContactBlock<W, P, kFull>*>(memory);
    for (std::uint32_t i = 0; i < count; ++i) strike_block(pass, blocks[i]);
  }
  template <int P, bool kFull>
  static void reflect(const ContactPass& pass, void* memory, std::uint32_t count) {
    auto* blocks = static_cast<ContactBlock<W, P, kFull>*>(memory);
    for (std::uint32_t i = 0; i < count; ++i) reflect_block(pass, blocks[i]);
  }

  template <int P, bool kFull>
  static void part(const ContactPass& pass, void* memory, std::uint32_t count) {
    auto* blocks = static_cast<ContactBlock<W, P, kFull>*>(memory);
    for (std::uint32_t i = 0; i < count; ++i) part_block(pass, blocks[i]);
  }
  // ---- Bodies: W consecutive rows.
  SKERRY_LANE void consecutive(std::uint32_t first, std::uint32_t* index) {
    for (int i = 0; i < W; ++i) index[i] = first + static_cast<std::uint32_t>(i);
  }
  SKERRY_LANE void scatter_rows(float* base, const std::uint32_t* index, const F* in) {
    float* address[W];
    for (int i = 0; i < W; ++i) address[i] = base + std::size_t{index[i]} * 8;
    L::scatter(in, address);
  }

  // omega x (I omega) over a substep by the explicit midpoint rule, cut back where it would gain
  // energy.
  SKERRY_LANE V gyrate(const V& w, const Sym& inertia, const Sym& inverse, const F& h) {
    const V l = mul(inertia, w);
    const V half = mul(mul(inverse, cross(w, l)), h * L::set(0.5f));
    const V mid = sub(w, half);
    const V change = mul(mul(inverse, cross(mid, mul(inertia, mid))), h);
    const V turned = sub(w, change);
    const F before = dot(w, l), after = dot(turned, mul(inertia, turned));
    const M gains = L::less(before, after);
    const F scale =
        L::select(gains, L::sqrt(before / L::select(gains, after, L::set(1.0f))), L::set(1.0f));
    return mul(turned, scale);
  }

  template <bool kRepeat>
  static void integrate_velocities(const ContactPass& pass, std::uint32_t begin,
                                   std::uint32_t end) {
    const F h = L::set(pass.substep);
    std::uint32_t index[W];
    for (std::uint32_t row = begin; row < end; row += W) {
      consecutive(row, index);
      Velocity v = gather_velocity(pass.velocity, index), change;
      if constexpr (kRepeat) {
        const Velocity forced = gather_velocity(pass.forced, index);
        change = {sub(v.linear, forced.linear), sub(v.angular, forced.angular)};
      }
      F a[4], spin[4], rest[4], inertia[4];
      L::gather(floats(pass.base), 8, index, a);
      const float* base = floats(pass.spin);
      L::gather(base, 16, index, spin);
      L::gather(base + 4, 16, index, inertia);
      L::gather(base + 8, 16, index, rest);  // yz zz angular_factor gyroscopic
      v.linear = mul(add(v.linear, mul(V{a[0], a[1], a[2]}, h)), spin[3]);
      v.angular = add(v.angular, mul(V{spin[0], spin[1], spin[2]}, h));
      const M gyroscopic = L::less(zero(), rest[3]);
      if (L::any(gyroscopic)) {
        F m[8];
        L::gather(floats(pass.mass), 8, index, m);
        L::gather(floats(pass.mass) + 4, 8, index, m + 4);
        const Sym inverse = {m[1], m[2], m[3], m[4], m[5], m[6]};
        const Sym direct = {inertia[0], inertia[1], inertia[2], inertia[3], rest[0], rest[1]};
        v.angular = select(gyroscopic, gyrate(v.angular, direct, inverse, h), v.angular);
      }
      v.angular = mul(v.angular, rest[2]);
      scatter_velocity_rows(pass.forced, index, v);
      if constexpr (kRepeat) {
        v = {add(v.linear, change.linear), add(v.angular, change.angular)};
      }
      scatter_velocity_rows(pass.velocity, index, v);
    }
  }
  SKERRY_LANE void scatter_velocity_rows(VelocityRow* rows, const std::uint32_t* index,
                                         const Velocity& v) {
    const F linear[4] = {v.linear.x, v.linear.y, v.linear.z, zero()};
    const F angular[4] = {v.angular.x, v.angular.y, v.angular.z, zero()};
    scatter_rows(floats(rows), index, linear);
    scatter_rows(floats(rows) + 4, index, angular);
  }

  static void integrate_positions(const ContactPass& pass, std::uint32_t begin, std::uint32_t end) {
    const F h = L::set(pass.substep), half = L::set(0.5f * pass.substep);
    std::uint32_t index[W];
    for (std::uint32_t row = begin; row < end; row += W) {
      consecutive(row, index);
      const Velocity v = gather_velocity(pass.velocity, index);
      F d[4], q[4];
      L::gather(floats(pass.delta), 8, index, d);
      L::gather(floats(pass.delta) + 4, 8, index, q);
      d[0] = d[0] + v.linear.x * h;
      d[1] = d[1] + v.linear.y * h;
      d[2] = d[2] + v.linear.z * h;
      d[3] = zero();
      // q += (half angle axis) q, the half angle lengthened to its tangent (to third order), so
      // that normalising gives the right angle.
      V t = mul(v.angular, half);
      const F square = dot(t, t);
      t = mul(t, L::set(1.0f) + square * L::set(1.0f / 3.0f));
      const V axis = {q[0], q[1], q[2]};
      const V turned = add(axis, add(mul(t, q[3]), cross(t, axis)));
      const F w = q[3] - dot(t, axis);
      const F scale = L::set(1.0f) / L::sqrt(dot(turned, turned) + w * w);
      const F rotation[4] = {turned.x * scale, turned.y * scale, turned.z * scale, w * scale};
      scatter_rows(floats(pass.delta), index, d);
      scatter_rows(floats(pass.delta) + 4, index, rotation);
    }
  }

  template <int P, bool kFull>
  static constexpr ContactKernels::OfKind of_kind() {
    return {sizeof(ContactBlock<W, P, kFull>),
            &prepare<P, kFull>,
            &warm_start<P, kFull>,
            &run_pass<P, kFull, false>,
            &run_pass<P, kFull, true>,
            &count_pushes<P, kFull>,
            &strike<P, kFull>,
            &take_back<P, kFull>,
            &reflect<P, kFull>,
            &restitute<P, kFull>,
            &part<P, kFull>,
            &store_block<P, kFull>};
  }
  static ContactKernels make(const char* name) {
    return {name,
            static_cast<std::uint32_t>(W),
            {of_kind<4, false>(), of_kind<1, false>(), of_kind<4, true>(), of_kind<1, true>()},
            &integrate_velocities<false>,
            &integrate_velocities<true>,
            &integrate_positions};
  }
};
