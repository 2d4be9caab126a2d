// The choice of a patch's points, written once for any lane type. Included once per instruction set,
// after axis_lanes-inl.h, so no include guard.

template <class L>
Vec<L> load_positions(const MeshPoints::Block& block, std::uint32_t k) {
  return {L::load(block.position[0] + k), L::load(block.position[1] + k),
          L::load(block.position[2] + k)};
}
inline core::V3f position_of(const std::vector<MeshPoints::Block>& blocks, std::uint32_t i) {
  const MeshPoints::Block& block = blocks[i / MeshPoints::Block::kSize];
  const std::uint32_t lane = i % MeshPoints::Block::kSize;
  return {block.position[0][lane], block.position[1][lane], block.position[2][lane]};
}

// Chooses the point of the highest score, the first among equals, if one is left.
template <class L, class Score>
void choose_best(const std::vector<MeshPoints::Block>& blocks, const Score& score,
                 PointChoice& choice) {
  constexpr std::uint32_t kSize = MeshPoints::Block::kSize;
  Best<L> best = none_yet<L>();
  for (std::uint32_t b = 0; b < blocks.size(); ++b)
    for (std::uint32_t k = 0; k < kSize; k += L::kLanes) {
      const typename L::Mask free = L::load(blocks[b].patch + k) == L(choice.patch);
      const L behind = L::load(blocks[b].separation + k) - L(choice.deep);
      best.consider(free, score(load_positions<L>(blocks[b], k), behind),
                    L::counting(static_cast<float>(kSize * b + k)));
    }
  const float top = best.top();
  if (top > -3e38f) choice.index[choice.count++] = best.top_index(top);
}

// A length or area counts less for points that will touch later, down to a tenth.
template <class L>
L weighed(L score, L behind) {
  const L zero = L(0.0f);
  const L late = min(max(behind * L(1 / kSpeculativeDistance), zero), L(1.0f));
  return select(score > zero, score * (L(1.0f) - L(0.9f) * late), score);
}

// Takes what is near a point out of its patch.
template <class L>
void drop_near(const core::V3f& chosen, const PointChoice& choice,
               std::vector<MeshPoints::Block>& blocks) {
  const Vec<L> at = spread<L>(chosen);
  const L most = L(choice.near * choice.near);
  for (MeshPoints::Block& block : blocks)
    for (std::uint32_t k = 0; k < MeshPoints::Block::kSize; k += L::kLanes) {
      const Vec<L> r = load_positions<L>(block, k) - at;
      const L patch = L::load(block.patch + k);
      const typename L::Mask same = (patch == L(choice.patch)) & !(dot(r, r) > most);
      select(same, L(MeshPoints::kNoPatch), patch).store(block.patch + k);
    }
}

template <class L>
void choose_spread_lanes(std::vector<MeshPoints::Block>& blocks, PointChoice& choice) {
  choice.count = 0;
  core::V3f p[3];
  choose_best<L>(
      blocks,
      [](const Vec<L>& at, L behind) SKERRY_LANES {
        const L along = dot(spread<L>(kPreferred), at);
        return select(behind > L(0.0f), L(-1e30f), along);
      },
      choice);
  if (choice.count != 1) return;
  p[0] = position_of(blocks, choice.index[0]);
  drop_near<L>(p[0], choice, blocks);
  choose_best<L>(
      blocks,
      [&](const Vec<L>& at, L behind) SKERRY_LANES {
        const Vec<L> r = at - spread<L>(p[0]);
        return weighed(dot(r, r), behind);
      },
      choice);
  if (choice.count != 2) return;
  p[1] = position_of(blocks, choice.index[1]);
  drop_near<L>(p[1], choice, blocks);
  const core::V3f across = cross(choice.normal, p[1] - p[0]);
  choose_best<L>(
      blocks,
      [&](const Vec<L>& at, L behind) SKERRY_LANES {
        return weighed(abs(dot(spread<L>(across), at - spread<L>(p[0]))), behind);
      },
      choice);
  if (choice.count != 3) return;
  p[2] = position_of(blocks, choice.index[2]);
  drop_near<L>(p[2], choice, blocks);
  const float turn = core::dot(across, p[2] - p[0]) > 0 ? -1.0f : 1.0f;
  const core::V3f out[3] = {across * turn, core::cross(choice.normal, p[2] - p[1]) * turn,
                            core::cross(choice.normal, p[0] - p[2]) * turn};
  choose_best<L>(
      blocks,
      [&](const Vec<L>& at, L behind) SKERRY_LANES {
        const L area = max(dot(spread<L>(out[0]), at - spread<L>(p[0])),
                           max(dot(spread<L>(out[1]), at - spread<L>(p[1])),
                               dot(spread<L>(out[2]), at - spread<L>(p[2]))));
        return weighed(area, behind);
      },
      choice);
}
