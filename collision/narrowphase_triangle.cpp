// What a triangle of a mesh answers for.
#include <algorithm>
#include <cmath>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

using core::cross;
using core::dot;

bool leans_too_far(const Triangle& triangle, const V3f& out) {
  const float up = dot(out, triangle.normal);
  if (up < 0) return true;
  if (up > 0.9999f) return false;
  for (int i = 0; i < 3; ++i) {
    const V3f edge = triangle.corner[(i + 1) % 3] - triangle.corner[i];
    const V3f away = direction(cross(edge, triangle.normal), {0, 0, 0});
    const float lean = dot(out, away);
    if (lean <= 1e-3f) continue;
    if (!triangle.touchable[i]) return true;
    const float most = dot(triangle.beyond[i], away),
                most_up = dot(triangle.beyond[i], triangle.normal);
    if (lean * most_up > most * up + 1e-3f) return true;
  }
  return false;
}

bool over_face(const Triangle& t, const V3f& p) {
  for (int i = 0; i < 3; ++i) {
    const V3f edge = t.corner[(i + 1) % 3] - t.corner[i];
    if (dot(cross(t.normal, edge), p - t.corner[i]) < 0) return false;
  }
  return true;
}

V3f cap_normal(const PlacedShape& shape, std::uint32_t index) {
  return index == 0 ? -shape.axes.c1 : shape.axes.c1;
}

}  // namespace skerry::collision
