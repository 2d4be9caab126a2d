#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

using core::cross;
using core::dot;

namespace {

// Parts of the patch's size: points are as deep as the deepest; of points as far out the one that lies
// along kPreferred is chosen, so that it is the same one in every step.
constexpr float kDepthTolerance = 1e-3f, kPreference = 0.05f;

// Indices chosen so far, and the next by highest score.
class Choice {
 public:
  Choice(const ContactPoint* points, std::uint32_t count) : points_(points), count_(count) {}

  template <class Score>
  V3f take(Score score, ContactPatch& patch) {
    std::uint32_t best = kNobody;
    float best_score = -3e38f;
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (i == taken_[0] || i == taken_[1] || i == taken_[2]) continue;
      const float s = score(points_[i]);
      if (s <= best_score && best != kNobody) continue;
      best_score = s;
      best = i;
    }
    if (patch.count < 3) taken_[patch.count] = best;
    patch.points[patch.count++] = points_[best];
    return points_[best].position;
  }

 private:
  static constexpr std::uint32_t kNobody = 0xffffffffu;
  const ContactPoint* points_;
  std::uint32_t count_;
  std::uint32_t taken_[3] = {kNobody, kNobody, kNobody};
};

}  // namespace

V3f perpendicular(const V3f& unit) {
  const V3f other = std::fabs(unit.y) < 0.7f ? V3f{0, 1, 0} : V3f{1, 0, 0};
  return direction(cross(unit, other), {0, 0, 1});
}

void single_point(const Query& query, const V3f& normal, const V3f& position, float separation,
                  std::uint32_t feature, ContactPatch& patch) {
  patch.normal = normal;
  patch.count = query.predicted(position, normal, separation) <= query.slop ? 1 : 0;
  patch.points[0] = {position, separation, feature};
}

void PointList::choose(ContactPatch& patch) const {
  choose_points(points_, count_, normal_, patch);
}

void choose_points(const ContactPoint* points, std::uint32_t count, const V3f& normal,
                   ContactPatch& patch) {
  patch.normal = normal;
  if (count <= ContactPatch::kMaxPoints) {
    patch.count = count;
    for (std::uint32_t i = 0; i < count; ++i) patch.points[i] = points[i];
    return;
  }
  float deepest = 3e38f, squared_size = 0;
  V3f sum{0, 0, 0};
  for (std::uint32_t i = 0; i < count; ++i) {
    const V3f r = points[i].position - points[0].position;
    squared_size = std::max(squared_size, dot(r, r));
    deepest = std::min(deepest, points[i].separation);
    sum = sum + r;
  }
  const float size = std::sqrt(squared_size), limit = deepest + kDepthTolerance * size;
  const V3f middle = points[0].position + sum * (1 / static_cast<float>(count));
  Choice choice(points, count);
  const auto take = [&](auto score) { return choice.take(score, patch); };
  patch.count = 0;
  // Far out, not only deep: a corner, never a point in the middle of a side.
  const V3f p1 = take([&](const ContactPoint& p) {
    const V3f r = p.position - middle;
    return p.separation > limit ? -1e30f : dot(r, r) + (kPreference * size) * dot(kPreferred, r);
  });
  const V3f p2 = take([&](const ContactPoint& p) {
    const V3f r = p.position - p1;
    return dot(r, r);
  });
  const V3f across = cross(normal, p2 - p1);
  const V3f p3 =
      take([&](const ContactPoint& p) { return std::fabs(dot(across, p.position - p1)); });
  const float turn = dot(across, p3 - p1) > 0 ? -1.0f : 1.0f;
  const V3f out12 = across * turn;
  const V3f out23 = cross(normal, p3 - p2) * turn;
  const V3f out31 = cross(normal, p1 - p3) * turn;
  take([&](const ContactPoint& p) {
    return std::fmax(dot(out12, p.position - p1),
                     std::fmax(dot(out23, p.position - p2), dot(out31, p.position - p3)));
  });
}

}  // namespace skerry::collision
