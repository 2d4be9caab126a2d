#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

using core::cross;
using core::dot;

namespace {

// The first choice is a deep point, but at rest all are equally deep up to rounding: among those
// within the tolerance a fixed direction decides, so that the choice does not flicker.
constexpr V3f kPreferred{0.6f, 0.2f, 0.77f};
constexpr float kDepthTolerance = 1e-3f;  // of the patch's size

template <class Score>
std::uint32_t best(const ContactPoint* points, std::uint32_t count, Score score) {
  std::uint32_t chosen = 0;
  float best_score = -3e38f;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float s = score(points[i]);
    if (s > best_score) {
      best_score = s;
      chosen = i;
    }
  }
  return chosen;
}

}  // namespace

V3f direction(const V3f& v, const V3f& otherwise) {
  const float squared = dot(v, v);
  if (!(squared > 1e-30f)) return otherwise;
  return v * (1 / std::sqrt(squared));
}

V3f perpendicular(const V3f& unit) {
  const V3f other = std::fabs(unit.y) < 0.7f ? V3f{0, 1, 0} : V3f{1, 0, 0};
  return direction(cross(unit, other), {0, 0, 1});
}

void PointList::add(const V3f& position, float separation, std::uint32_t feature) {
  // Negated, so that NaN is left out.
  if (!(query_.predicted(position, normal_, separation) <= query_.slop)) return;
  if (count_ < kCapacity) points_[count_++] = {position, separation, feature};
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
  ContactPoint rest[PointList::kCapacity];
  std::copy_n(points, count, rest);
  std::uint32_t left = count;
  const auto take = [&](auto score) {
    const std::uint32_t i = best(rest, left, score);
    patch.points[patch.count++] = rest[i];
    --left;
    for (std::uint32_t j = i; j < left; ++j) rest[j] = rest[j + 1];
    return patch.points[patch.count - 1].position;
  };
  patch.count = 0;
  float deepest = 3e38f, squared_size = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const V3f r = points[i].position - points[0].position;
    squared_size = std::max(squared_size, dot(r, r));
    deepest = std::min(deepest, points[i].separation);
  }
  const float limit = deepest + kDepthTolerance * std::sqrt(squared_size);
  const V3f p1 = take([&](const ContactPoint& p) {
    return p.separation > limit ? -1e30f : dot(kPreferred, p.position);
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
