// Separating axes in lanes: the best of many, and pairs of edges. Included once per instruction set,
// after lane_vectors-inl.h, so no include guard.

// The same vector in all lanes, or one per lane from rows.
template <class L>
Vec<L> spread(const core::V3f& v) {
  return {L(v.x), L(v.y), L(v.z)};
}
template <class L>
Vec<L> load3(const float* rows, std::uint32_t stride, std::uint32_t i) {
  return {L::load(rows + i), L::load(rows + stride + i), L::load(rows + 2 * stride + i)};
}
// Components of v along the axes of a frame.
template <class L>
Vec<L> into(const core::M3f& frame, const Vec<L>& v) {
  return {dot(spread<L>(frame.c0), v), dot(spread<L>(frame.c1), v), dot(spread<L>(frame.c2), v)};
}

// The best of many lanes: highest value, lowest index among equals. (gcc forgets the instruction set
// of constructors that it writes itself.)
template <class L>
struct Best {
  L value, index;

  void consider(L candidate, L candidate_index) {
    const typename L::Mask better = candidate > value;
    value = select(better, candidate, value);
    index = select(better, candidate_index, index);
  }
  template <class Mask>
  void consider(Mask which, L candidate, L candidate_index) {
    const typename L::Mask better = which & (candidate > value);
    value = select(better, candidate, value);
    index = select(better, candidate_index, index);
  }
  float top() const { return highest(value); }
  std::uint32_t top_index(float top) const {
    return static_cast<std::uint32_t>(lowest(select(value == L(top), index, L(3e38f))));
  }
};

template <class L>
Best<L> none_yet() {
  return {L(-3e38f), L(0.0f)};
}

// The pair of edges (ea, lanes of eb), both in b's frame: its separation where they cross on the
// Gauss map, that is, where they make a face of the Minkowski difference.
template <class L>
struct EdgeLanes {
  Vec<L> tail, along, left, right;
};
template <class L>
[[gnu::always_inline]] inline void cross_edges(const EdgeLanes<L>& a, const EdgeLanes<L>& b,
                                               L index, Best<L>& best) {
  const L zero = L(0.0f);
  const L cba = dot(b.left, a.along), dba = dot(b.right, a.along);
  const L adc = dot(a.left, b.along), bdc = dot(a.right, b.along);
  typename L::Mask good = (cba * dba < zero) & (adc * bdc < zero) & (cba * bdc < zero);
  const Vec<L> product = cross(a.along, b.along);
  const L squared = dot(product, product);
  good = good & (squared > L(1e-6f) * dot(a.along, a.along) * dot(b.along, b.along));
  const L outward = select(dot(product, a.left + a.right) < zero, L(-1.0f), L(1.0f));
  const L scale = outward / square_root(select(good, squared, L(1.0f)));
  best.consider(good, dot(product * scale, b.tail - a.tail), index);
}
