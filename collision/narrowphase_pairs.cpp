#include "collision/narrowphase_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "collision/continuous.h"
#include "collision/polytope_lanes.h"
#include "collision/touch_forecast.h"
#include "core/rounding.h"

namespace skerry::collision {

using core::BodyMotion;
using core::BodyPose;
using core::cross;
using core::dot;
using core::length;
using core::Manifold;
using core::ManifoldPoint;
using core::Q4f;
using core::to_float;

namespace {

bool centered(const Collider& collider) {
  const V3f p = collider.local_position;
  return p.x == 0 && p.y == 0 && p.z == 0;
}

Q4f product(const Q4f& a, const Q4f& b) {
  return {((a.w * b.x + a.x * b.w) + a.y * b.z) - a.z * b.y,
          ((a.w * b.y - a.x * b.z) + a.y * b.w) + a.z * b.x,
          ((a.w * b.z + a.x * b.y) - a.y * b.x) + a.z * b.w,
          ((a.w * b.w - a.x * b.x) - a.y * b.y) - a.z * b.z};
}

V3f difference(const Vec3& a, const Vec3& b) {
  return {core::rounded_to_float(a.x() - b.x()), core::rounded_to_float(a.y() - b.y()),
          core::rounded_to_float(a.z() - b.z())};
}

// Radius about the centre of mass of a sphere that holds the collider; of the whole body where that
// is the cheaper thing to know.
float reach(const Collider& collider, const core::BodyMass& mass) {
  const V3f s = collider.size;
  const float offset = centered(collider) ? 0 : length(collider.local_position);
  switch (collider.type) {
    case ShapeType::sphere:
      return offset + s.x;
    case ShapeType::capsule:
      return offset + s.x + s.y;
    case ShapeType::box:
      return offset + length(s);
    case ShapeType::cylinder:
    case ShapeType::cone:
      return offset + s.x + s.y;
    case ShapeType::ellipsoid:
      return offset + std::fmax(s.x, std::fmax(s.y, s.z));
    case ShapeType::hull:
      return offset + collider.hull->lanes->view.radius;
    case ShapeType::mesh:
    case ShapeType::height_field:
      return core::rounded_to_float(mass.radius);
    case ShapeType::plane:
      break;
  }
  return 1e9f;
}

// Upper bound of the speed at which any two points of the pair can close in on each other.
float closing_bound(const StepContext& step, const core::ContactPair& pair, const V3f& linear) {
  const auto spin = [&](core::BodyIndex body, core::ColliderIndex collider) {
    // The 1-norm spares a root.
    const V3f w = to_float(step.bodies->motion[body].angular);
    const float rate = (std::fabs(w.x) + std::fabs(w.y)) + std::fabs(w.z);
    return rate * step.colliders->rows[collider].turn_radius;
  };
  return length(linear) + (spin(pair.body_a, pair.a) + spin(pair.body_b, pair.b));
}

void fetch(const void* line) { __builtin_prefetch(line); }

}  // namespace

PairApproach pair_approach(const StepContext& step, const core::ContactPair& pair) {
  const core::Bodies& bodies = *step.bodies;
  PairApproach approach = {{0, 0, 0}, {0, 0, 0}, 0};
  approach.between = difference(bodies.pose[pair.body_b].center, bodies.pose[pair.body_a].center);
  if (pair.flags & core::kSensorPair) return approach;
  approach.velocity =
      difference(bodies.motion[pair.body_b].linear, bodies.motion[pair.body_a].linear);
  approach.margin = kSpeculativeDistance +
                    core::rounded_to_float(step.dt) * closing_bound(step, pair, approach.velocity);
  return approach;
}

float fast_touch(const StepContext& step, const core::ContactPair& pair, const V3f& between) {
  const core::Bodies& bodies = *step.bodies;
  int fast = 0;
  for (const core::BodyIndex body : {pair.body_a, pair.body_b}) {
    const std::uint32_t flags = bodies.flags[body];
    if (!(flags & (core::kContinuous | core::kKinematic)) || !(flags & core::kAwake)) continue;
    if (!core::moves_fast(bodies, body, step.dt)) continue;
    if (flags & core::kKinematic) return kNoTouch;  // it will not stop for anybody
    ++fast;
  }
  if (fast == 0) return kNoTouch;
  const core::BodyMass &a = bodies.mass[pair.body_a], &b = bodies.mass[pair.body_b];
  if (fast == 2 &&
      !core::part_fast(a, bodies.motion[pair.body_a], b, bodies.motion[pair.body_b], step.dt))
    return kNoTouch;
  const ShapeType type_a = step.colliders->rows[pair.a].type;
  const ShapeType type_b = step.colliders->rows[pair.b].type;
  const bool plane = type_a == ShapeType::plane || type_b == ShapeType::plane;
  return core::rounded_to_float(2 * core::touch_gap(a, b, plane ? 0 : double(length(between))));
}

bool in_place(const StepContext& step, const core::ContactPair& pair) {
  const Collider& a = step.colliders->rows[pair.a];
  const Collider& b = step.colliders->rows[pair.b];
  return centered(a) && centered(b) && !a.has_local_rotation && !b.has_local_rotation;
}

namespace {

// Where the shapes are, given `frame.between`.
void place_shapes(const Collider& a, const Collider& b, const Quat& orientation_a,
                  const Quat& orientation_b, PairFrame& frame) {
  frame.rotation_a = to_float(orientation_a);
  frame.rotation_b = to_float(orientation_b);
  frame.center_a = {0, 0, 0};
  frame.center_b = frame.between;
  if (!centered(a)) frame.center_a = to_matrix(frame.rotation_a) * a.local_position;
  if (!centered(b)) frame.center_b = frame.between + to_matrix(frame.rotation_b) * b.local_position;
  if (a.has_local_rotation) frame.rotation_a = product(frame.rotation_a, a.local_rotation);
  if (b.has_local_rotation) frame.rotation_b = product(frame.rotation_b, b.local_rotation);
}

}  // namespace

void pair_frame(const StepContext& step, const core::ContactPair& pair,
                const PairApproach& approach, PairFrame& frame) {
  frame.between = approach.between;
  place_shapes(step.colliders->rows[pair.a], step.colliders->rows[pair.b],
               step.bodies->pose[pair.body_a].orientation,
               step.bodies->pose[pair.body_b].orientation, frame);
  frame.linear = frame.angular = {0, 0, 0};
  frame.slop = frame.margin = frame.dt = 0;
  frame.touch = kNoTouch;
  if (pair.flags & core::kSensorPair) return;
  const BodyMotion& motion_a = step.bodies->motion[pair.body_a];
  const BodyMotion& motion_b = step.bodies->motion[pair.body_b];
  frame.dt = core::rounded_to_float(step.dt);
  frame.linear = approach.velocity - cross(to_float(motion_b.angular), frame.between);
  frame.angular = difference(motion_b.angular, motion_a.angular);
  frame.slop = kSpeculativeDistance;
  frame.margin = approach.margin;
  if (frame.margin > kSlowMargin) frame.touch = fast_touch(step, pair, frame.between);
}

void pair_frame(const StepContext& step, const core::ContactPair& pair, const PairAt& at,
                float margin, PairFrame& frame) {
  frame.between = difference(at.b.pose.center, at.a.pose.center);
  place_shapes(step.colliders->rows[pair.a], step.colliders->rows[pair.b], at.a.pose.orientation,
               at.b.pose.orientation, frame);
  frame.dt = core::rounded_to_float(step.dt);
  frame.linear =
      difference(at.b.linear, at.a.linear) - cross(to_float(at.b.angular), frame.between);
  frame.angular = difference(at.b.angular, at.a.angular);
  frame.slop = kSpeculativeDistance;
  frame.margin = margin;
  frame.touch = kNoTouch;
}

void prefetch(const Manifold& manifold) {
  const char* first = reinterpret_cast<const char*>(&manifold);
  for (std::size_t line = 0; line < sizeof manifold; line += 64)
    __builtin_prefetch(first + line, 1);
}

void prefetch_pair(const StepContext& step, const core::ContactPair& pair) {
  // Pairs come in the order of a: only b is somewhere else each time.
  fetch(&step.bodies->pose[pair.body_b]);
  fetch(&step.bodies->motion[pair.body_b].linear);
  fetch(&step.bodies->motion[pair.body_b].angular);
  fetch(&step.colliders->rows[pair.b].type);
  fetch(&step.colliders->rows[pair.b].size);
  if (!(pair.flags & core::kTouching)) return;
  prefetch(step.contacts->manifolds[pair.first_manifold]);
  const std::vector<core::PolytopeMemory>& memories = step.contacts->polytope_memory;
  if (pair.cache == 0 || pair.first_manifold >= memories.size()) return;
  const char* memory = reinterpret_cast<const char*>(&memories[pair.first_manifold]);
  for (std::size_t line = 0; line < sizeof memories[0]; line += 64) fetch(memory + line);
}

float spheres_apart(const StepContext& step, const core::ContactPair& pair,
                    const PairApproach& approach) {
  return length(approach.between) -
         (reach(step.colliders->rows[pair.a], step.bodies->mass[pair.body_a]) +
          reach(step.colliders->rows[pair.b], step.bodies->mass[pair.body_b]));
}

namespace {

using V3d = core::V3<double>;

V3d scalars(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
core::M3<double> matrix(const Quat& q) {
  return to_matrix(core::Q4<double>{q.x(), q.y(), q.z(), q.w()});
}
V3d place(const Collider& collider, const BodyPose& pose) {
  const V3f p = collider.local_position;
  return scalars(pose.center) +
         matrix(pose.orientation) * V3d{double(p.x), double(p.y), double(p.z)};
}

// In double: planes reach far, and rounding their distance would lift what rests on them.
float height_over_plane(const Collider& plane, const BodyPose& plane_pose, const Collider& other,
                        const BodyPose& other_pose) {
  const Q4f& q = plane.local_rotation;
  V3d normal{double(plane.size.x), double(plane.size.y), double(plane.size.z)};
  if (plane.has_local_rotation)
    normal =
        to_matrix(core::Q4<double>{double(q.x), double(q.y), double(q.z), double(q.w)}) * normal;
  normal = matrix(plane_pose.orientation) * normal;
  const double scale = 1 / std::sqrt(dot(normal, normal));
  const V3d offset = place(other, other_pose) - place(plane, plane_pose);
  return core::rounded_to_float(dot(normal, offset) * scale - plane.plane_offset);
}

}  // namespace

namespace {

PlacedPair placed_with(const StepContext& step, const core::ContactPair& pair,
                       const BodyPose& pose_a, const BodyPose& pose_b, const PairFrame& frame) {
  PlacedPair placed;
  placed.a.collider = &step.colliders->rows[pair.a];
  placed.b.collider = &step.colliders->rows[pair.b];
  placed.a.center = frame.center_a;
  placed.b.center = frame.center_b;
  placed.a.axes = to_matrix(frame.rotation_a);
  placed.b.axes = to_matrix(frame.rotation_b);
  if (placed.a.collider->type == ShapeType::plane)
    placed.a.height = height_over_plane(*placed.a.collider, pose_a, *placed.b.collider, pose_b);
  if (placed.b.collider->type == ShapeType::plane)
    placed.b.height = height_over_plane(*placed.b.collider, pose_b, *placed.a.collider, pose_a);
  placed.query.linear = frame.linear;
  placed.query.angular = frame.angular;
  placed.query.dt = frame.dt;
  placed.query.slop = frame.slop;
  placed.query.margin = frame.margin;
  placed.query.touch = frame.touch;
  placed.query.cache = pair.cache;
  return placed;
}

}  // namespace

PlacedPair placed_pair(const StepContext& step, const core::ContactPair& pair,
                       const PairFrame& frame) {
  return placed_with(step, pair, step.bodies->pose[pair.body_a], step.bodies->pose[pair.body_b],
                     frame);
}

PlacedPair placed_pair(const StepContext& step, const core::ContactPair& pair, const PairAt& at,
                       const PairFrame& frame) {
  return placed_with(step, pair, at.a.pose, at.b.pose, frame);
}

PlacedPair swapped(const PlacedPair& pair) {
  PlacedPair other{pair.b, pair.a, pair.query};
  other.query.linear = -pair.query.linear;
  other.query.angular = -pair.query.angular;
  return other;
}

namespace {

// A point may inherit the impulse of another feature this near, as a part of the shapes' size; the
// distance between the points of the manifold stands for the size.
constexpr float kNearby = 0.1f;

const Manifold* predecessor(std::span<const Manifold> old, const V3f& normal) {
  const Manifold* best = nullptr;
  float cosine = kSameNormal;
  for (const Manifold& manifold : old) {
    const float c = dot(manifold.normal, normal);
    if (c <= cosine) continue;
    cosine = c;
    best = &manifold;
  }
  return best;
}

float squared_size(const Manifold& manifold) {
  float largest = 0;
  for (std::uint32_t i = 1; i < manifold.point_count; ++i) {
    const V3f r = manifold.points[i].position - manifold.points[0].position;
    largest = std::max(largest, dot(r, r));
  }
  return largest;
}

// Features change where a face slides over an edge or triangles follow each other; the load stays
// where it was.
void inherit_by_place(const Manifold& old, std::uint32_t used, Manifold& manifold,
                      std::uint32_t matched) {
  const bool single = manifold.point_count == 1 && old.point_count == 1;
  const float limit = kNearby * kNearby * std::max(squared_size(old), squared_size(manifold));
  for (std::uint32_t i = 0; i < manifold.point_count; ++i) {
    if (matched & (1u << i)) continue;
    const ManifoldPoint& point = manifold.points[i];
    std::uint32_t nearest = old.point_count;
    float best = single ? 3e38f : limit;
    for (std::uint32_t j = 0; j < old.point_count; ++j) {
      const V3f r = old.points[j].position - point.position;
      if ((used & (1u << j)) || !(dot(r, r) <= best)) continue;
      best = dot(r, r);
      nearest = j;
    }
    if (nearest == old.point_count) continue;
    used |= 1u << nearest;
    manifold.normal_impulse[i] = old.normal_impulse[nearest];
  }
}

void inherit(const Manifold& old, Manifold& manifold) {
  manifold.friction_impulse = old.friction_impulse;
  manifold.twist_impulse = old.twist_impulse;
  manifold.rolling_impulse = old.rolling_impulse;
  manifold.carried_impulse = old.carried_impulse;
  manifold.standing_impulse = old.standing_impulse;
  manifold.statics_impulse = old.statics_impulse;
  manifold.pressed_time = old.pressed_time;
  manifold.placed = old.placed;
  manifold.begins = old.begins;
  manifold.settled = old.settled;
  std::uint32_t used = 0, matched = 0;
  for (std::uint32_t i = 0; i < manifold.point_count; ++i) {
    for (std::uint32_t j = 0; j < old.point_count; ++j) {
      if (old.feature[j] != manifold.feature[i] || (used & (1u << j))) continue;
      manifold.normal_impulse[i] = old.normal_impulse[j];
      used |= 1u << j;
      matched |= 1u << i;
      break;
    }
  }
  const std::uint32_t all_new = (1u << manifold.point_count) - 1;
  const std::uint32_t all_old = (1u << old.point_count) - 1;
  if (matched != all_new && used != all_old) inherit_by_place(old, used, manifold, matched);
}

// The patch's geometry; impulses of the substeps stay as they were.
void place(const ContactPatch& patch, const V3f& linear, const V3f& angular, Manifold& manifold) {
  manifold.normal = patch.normal;
  manifold.point_count = patch.count;
  manifold.total_impulse = 0;
  manifold.touch_time = 0;
  const float speed = dot(patch.normal, linear);
  const V3f gradient = cross(patch.normal, angular);
  float approach = 0;
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    const ContactPoint& from = patch.points[i];
    manifold.points[i] = {from.position, from.separation};
    manifold.feature[i] = from.feature;
    approach = std::max(approach, -(speed + dot(gradient, from.position)));
  }
  manifold.approach_speed = approach;
}

bool is_zero(const V3f& v) { return v.x == 0 && v.y == 0 && v.z == 0; }

// A manifold without a past, of two bodies with this velocity of the second to the first.
void begin(const V3f& linear, const V3f& angular, Manifold& manifold) {
  std::fill_n(manifold.normal_impulse, 4, 0.0f);
  manifold.friction_impulse = manifold.rolling_impulse = {0, 0, 0};
  manifold.twist_impulse = manifold.carried_impulse = manifold.standing_impulse = 0;
  manifold.statics_impulse = manifold.pressed_time = 0;
  manifold.placed = manifold.begins = is_zero(linear) && is_zero(angular);
  manifold.settled = false;
}

// Four points with the features of before, each in its place, as of most pairs at rest.
bool same_order(const ContactPatch& patch, const Manifold& manifold) {
  if (patch.count != 4 || manifold.point_count != 4) return false;
  bool same = true;
  for (std::uint32_t i = 0; i < 4; ++i) same &= manifold.feature[i] == patch.points[i].feature;
  return same;
}

// Puts the impulses of the manifold's points in the order of the patch's. False, and nothing done,
// if the patch has another feature or another normal.
bool match_all(const ContactPatch& patch, Manifold& manifold) {
  if (dot(manifold.normal, patch.normal) <= kSameNormal) return false;
  if (same_order(patch, manifold)) return true;
  float impulse[4] = {};
  std::uint32_t used = 0;
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    std::uint32_t j = 0;
    while (j < manifold.point_count &&
           (manifold.feature[j] != patch.points[i].feature || (used & (1u << j))))
      ++j;
    if (j == manifold.point_count) return false;
    used |= 1u << j;
    impulse[i] = manifold.normal_impulse[j];
  }
  std::copy_n(impulse, 4, manifold.normal_impulse);
  return true;
}

// Returns how many manifolds there are now.
std::uint32_t write(const PatchSet& patches, const V3f& linear, const V3f& angular,
                    const core::ContactPair& pair, Manifold* manifolds) {
  std::array<Manifold, core::kMeshManifolds> old;
  std::copy_n(manifolds, pair.manifold_count, old.begin());
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < patches.count && count < pair.manifold_capacity; ++i) {
    if (patches.patch[i].count == 0) continue;
    Manifold& manifold = manifolds[count++];
    place(patches.patch[i], linear, angular, manifold);
    begin(linear, angular, manifold);
    const Manifold* before = predecessor({old.data(), pair.manifold_count}, manifold.normal);
    if (before != nullptr) inherit(*before, manifold);
  }
  return count;
}

void mark(core::ContactPair& pair, bool touching) {
  pair.flags = (pair.flags & ~std::uint32_t{core::kTouching}) | (touching ? core::kTouching : 0u);
}

bool overlaps(const PatchSet& patches) {
  for (std::uint32_t i = 0; i < patches.count; ++i)
    for (std::uint32_t k = 0; k < patches.patch[i].count; ++k)
      if (patches.patch[i].points[k].separation <= 0) return true;
  return false;
}

}  // namespace

void clear_contact(core::ContactPair& pair) {
  // Most pairs never touch: what is not written need not go back to memory.
  if (!(pair.flags & core::kTouching) && pair.manifold_count == 0) return;
  mark(pair, false);
  pair.manifold_count = 0;
}

namespace {

// Whether contacts are to foresee where the two meet, and they will. Either joints hold one of them, or
// in this step they come past each other by no more than kForeseen times what a body may move on the
// word of contacts.
bool foresees(const StepContext& step, const core::ContactPair& pair,
              std::vector<std::uint32_t>& triangles) {
  constexpr double kForeseen = 4;
  const core::Bodies& bodies = *step.bodies;
  const Vec3 between = bodies.motion[pair.body_b].linear - bodies.motion[pair.body_a].linear;
  double way = between.norm() * step.dt, safe = 1e300;
  bool joined = false;
  for (const core::BodyIndex body : {pair.body_a, pair.body_b}) {
    const core::BodyMass& mass = bodies.mass[body];
    way += bodies.motion[body].angular.norm() * step.dt * double(mass.turn_radius);
    if (bodies.is(body, core::kDynamic)) safe = std::min(safe, core::safe_motion(mass));
    joined = joined || bodies.lock_joints[body] > 0;
  }
  return (joined || way <= kForeseen * safe) && will_meet(step, pair, triangles);
}

}  // namespace

void drop_foreseen(const StepContext& step, const core::ContactPair& pair, float touch,
                   const V3f& linear, const V3f& angular, std::vector<std::uint32_t>& triangles,
                   PatchSet& patches) {
  if (touch == kNoTouch) return;
  const float dt = core::rounded_to_float(step.dt);
  const auto foreseen = [&](const ContactPatch& patch, const ContactPoint& point) {
    const float vn = dot(patch.normal, linear + cross(angular, point.position));
    return !(point.separation <= touch || -vn * dt <= kSpeculativeDistance);
  };
  bool any = false;
  for (std::uint32_t i = 0; i < patches.count && !any; ++i)
    for (std::uint32_t k = 0; k < patches.patch[i].count && !any; ++k)
      any = foreseen(patches.patch[i], patches.patch[i].points[k]);
  if (!any || foresees(step, pair, triangles)) return;
  for (std::uint32_t i = 0; i < patches.count; ++i) {
    ContactPatch& patch = patches.patch[i];
    std::uint32_t kept = 0;
    for (std::uint32_t k = 0; k < patch.count; ++k) {
      const ContactPoint& point = patch.points[k];
      if (!foreseen(patch, point)) patch.points[kept++] = point;
    }
    patch.count = kept;
  }
}

namespace {

// A cylinder touches with its side if its axis is this near to a right angle with the normal (cosine).
constexpr float kOnItsSide = 0.02f;

}  // namespace

float rounding(const StepContext& step, core::ColliderIndex index, const Quat& orientation,
               const V3f& normal) {
  const Collider& collider = step.colliders->rows[index];
  const V3f& size = collider.size;
  switch (collider.type) {
    case ShapeType::sphere:
    case ShapeType::capsule:
      return size.x;
    case ShapeType::ellipsoid:
      return size.x == size.y && size.y == size.z ? size.x : 0;
    case ShapeType::cylinder: {
      Q4f turn = to_float(orientation);
      if (collider.has_local_rotation) turn = product(turn, collider.local_rotation);
      return std::fabs(dot(normal, to_matrix(turn).c1)) < kOnItsSide ? size.x : 0;
    }
    default:
      return 0;
  }
}

void store_patches(const StepContext& step, core::ContactPair& pair, const PatchSet& patches,
                   const V3f& linear, const V3f& angular) {
  if (pair.flags & core::kSensorPair) {
    mark(pair, overlaps(patches));
    pair.manifold_count = 0;
    return;
  }
  core::ContactTable& contacts = *step.contacts;
  Manifold* manifolds = &contacts.manifolds[pair.first_manifold];
  std::uint32_t count = 1;
  const bool one = pair.manifold_count == 1 && patches.count == 1 && patches.patch[0].count > 0;
  if (one && match_all(patches.patch[0], manifolds[0]))
    place(patches.patch[0], linear, angular, manifolds[0]);
  else
    count = write(patches, linear, angular, pair, manifolds);
  for (std::uint32_t i = 0; i < count; ++i) {
    const V3f& normal = manifolds[i].normal;
    manifolds[i].rounding_a =
        rounding(step, pair.a, step.bodies->pose[pair.body_a].orientation, normal);
    manifolds[i].rounding_b =
        rounding(step, pair.b, step.bodies->pose[pair.body_b].orientation, normal);
  }
  mark(pair, count > 0);
  if (pair.manifold_count == 0 && count > 0)
    core::set_materials(contacts, pair, step.colliders->rows[pair.a], step.colliders->rows[pair.b]);
  pair.manifold_count = static_cast<std::uint16_t>(count);
}

namespace {

// store_patches of one point, at less cost where the point was there before.
void store_point(const StepContext& step, core::ContactPair& pair, const V3f& normal,
                 const ContactPoint& point, const V3f& linear) {
  Manifold& manifold = step.contacts->manifolds[pair.first_manifold];
  const bool same = pair.manifold_count == 1 && manifold.point_count == 1 &&
                    manifold.feature[0] == point.feature &&
                    dot(manifold.normal, normal) > kSameNormal;
  if (!same) {
    PatchSet patches;
    patches.count = 1;
    patches.patch[0].normal = normal;
    patches.patch[0].count = 1;
    patches.patch[0].points[0] = point;
    return store_patches(step, pair, patches, linear, {0, 0, 0});
  }
  manifold.normal = normal;
  manifold.points[0] = {point.position, point.separation};
  manifold.total_impulse = 0;
  manifold.touch_time = 0;
  manifold.approach_speed = std::max(0.0f, -dot(normal, linear));
}

// Spheres that will bounce in this step: writes their contact of then; false if they do not.
template <class PointAt>
bool store_bounce(const StepContext& step, core::ContactPair& pair, const V3f& normal,
                  float separation, const V3f& velocity, const PointAt& point_at) {
  PatchSet patches;
  const auto put = [&](const V3f& n, float gap, PatchSet& to) {
    to.count = 1;
    to.patch[0].normal = n;
    to.patch[0].count = 1;
    to.patch[0].points[0] = point_at(n, gap);
  };
  put(normal, separation, patches);
  TouchForecast forecast(step, pair, velocity, {0, 0, 0});
  if (!forecast.expects(patches)) return false;
  const float radii = step.colliders->rows[pair.a].size.x + step.colliders->rows[pair.b].size.x;
  const float time = forecast.find(
      [&](const PairAt& at, PatchSet& then) {
        const V3f there = difference(at.b.pose.center, at.a.pose.center);
        const V3f n = direction(there, {0, 1, 0});
        put(n, dot(there, n) - radii, then);
      },
      patches, step.contacts->touch_gaps[pair.first_manifold]);
  store_patches(step, pair, patches, velocity, {0, 0, 0});
  step.contacts->manifolds[pair.first_manifold].touch_time = time;
  return true;
}

}  // namespace

bool collide_centered_spheres(const StepContext& step, const ApartPairs& known,
                              core::ContactPair& pair) {
  const Collider& a = step.colliders->rows[pair.a];
  const Collider& b = step.colliders->rows[pair.b];
  if (a.type != ShapeType::sphere || b.type != ShapeType::sphere) return false;
  if ((pair.flags & core::kSensorPair) || !centered(a) || !centered(b)) return false;
  const core::Bodies& bodies = *step.bodies;
  const float radii = a.size.x + b.size.x, dt = core::rounded_to_float(step.dt);
  const V3f between = difference(bodies.pose[pair.body_b].center, bodies.pose[pair.body_a].center);
  const V3f velocity =
      difference(bodies.motion[pair.body_b].linear, bodies.motion[pair.body_a].linear);
  const float squared = dot(between, between), near = radii + kSpeculativeDistance;
  const auto part = [&](float separation) {
    clear_contact(pair);
    known.note(pair, separation);
    return true;
  };
  if (squared > near * near && dot(between, velocity) >= 0) return part(std::sqrt(squared) - radii);

  const V3f normal = direction(between, {0, 1, 0});
  const float separation = dot(between, normal) - radii, vn = dot(normal, velocity);
  // Negated, so that NaN is left out.
  if (!(separation + dt * std::min(vn, 0.0f) <= kSpeculativeDistance)) return part(separation);
  const float way = -vn * dt;
  std::vector<std::uint32_t> no_triangles;
  if (separation > 0 && way > kSpeculativeDistance &&
      separation > fast_touch(step, pair, between) && !foresees(step, pair, no_triangles))
    return clear_contact(pair), true;
  const auto point_at = [&](const V3f& n, float gap) {
    return ContactPoint{n * (a.size.x + 0.5f * gap), gap, 0};
  };
  if (separation > 0 && may_bounce(step, pair) &&
      store_bounce(step, pair, normal, separation, velocity, point_at))
    return true;
  store_point(step, pair, normal, point_at(normal, separation), velocity);
  return true;
}

}  // namespace skerry::collision
