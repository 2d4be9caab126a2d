#include "collision/continuous.h"

#include <algorithm>
#include <cmath>

#include "collision/broadphase.h"
#include "collision/mesh_tree.h"
#include "collision/time_of_impact.h"
#include "core/rounding.h"
#include "core/trig.h"

namespace skerry::collision {

using core::Bodies;
using core::BodyIndex;
using core::Collider;
using core::ColliderIndex;
using core::ContactPair;
using core::dot;
using core::FastBodies;
using core::FastPair;
using core::FastStart;
using core::ShapeType;

namespace {

// A meeting of two fast bodies, or of a fast one (body_a) with a slow one, in the order in which
// meetings are taken.
struct Meeting {
  double time;
  std::uint32_t pair;     // row of FastBodies::pairs
  std::uint32_t version;  // of that pair: an old one no longer counts
  bool operator<(const Meeting& other) const {
    if (time != other.time) return time < other.time;
    return pair != other.pair ? pair < other.pair : version < other.version;
  }
};

// A collider that has left its fat box, with where it has been.
struct ThrownBox {
  Aabb box;
  ColliderIndex collider;
};

struct alignas(64) WorkerScratch {
  std::vector<std::uint32_t> triangles;
};

// m: far above touch_gap() of bodies that collide.
constexpr double kTouchReach = 1e-3;

// Where a body may have been during a step, wherever it was stopped.
struct Reach {
  Vec3 low, high;  // m
};

}  // namespace

class ContinuousScratch {
 public:
  explicit ContinuousScratch(std::uint32_t worker_count) : workers(worker_count) {}

  std::vector<WorkerScratch> workers;
  std::vector<ColliderIndex> found;
  std::vector<ThrownBox> thrown;
  std::vector<Reach> reach;                                  // [body rows]; of awake bodies
  std::vector<Meeting> meetings;                             // a heap, earliest first
  std::vector<std::uint32_t> version;                        // [pairs]
  std::vector<std::pair<BodyIndex, std::uint32_t>> of_body;  // (fast body, pair of two fast ones)
};

ContinuousScratchPtr make_continuous_scratch(std::uint32_t workers) {
  return ContinuousScratchPtr(new ContinuousScratch(workers));
}
void ContinuousScratchDeleter::operator()(ContinuousScratch* scratch) const { delete scratch; }

namespace {

bool is_fast(const Bodies& bodies, BodyIndex body) { return bodies.is(body, core::kFast); }

// Faster kinematic bodies are foreseen by contacts alone: they cannot stop.
bool is_fast_kinematic(const StepContext& step, BodyIndex body) {
  return step.bodies->is(body, core::kKinematic | core::kAwake) &&
         core::moves_fast(*step.bodies, body, step.dt);
}

// -- How bodies moved.

Quat after_turn(const Quat& from, const Vec3& turn) {
  const double angle = turn.norm();
  if (angle == 0) return from;
  const auto [sine, cosine] = core::trig::sin_cos(0.5 * angle);
  const Vec3 v = turn * (sine / angle);
  return Quat(cosine, v.x(), v.y(), v.z()) * from;
}

// The way of a body's centre.
Sweep path_of(const StepContext& step, BodyIndex body, const Vec3& origin) {
  const Bodies& bodies = *step.bodies;
  const core::BodyPose& pose = bodies.pose[body];
  const core::BodyMotion& motion = bodies.motion[body];
  Sweep sweep;
  sweep.turn_radius = double(bodies.mass[body].turn_radius);
  if (is_fast(bodies, body)) {
    const FastStart& start = step.fast->start[body];
    sweep.center = wide(Vec3(start.pose.center - origin));
    sweep.way = wide(Vec3(pose.center - start.pose.center));
    if (start.flight == core::FastFlight::free)
      sweep.bend = wide(Vec3(0.5 * step.dt * (motion.linear - start.motion.linear)));
    sweep.end = step.fast->part[body];
    return sweep;
  }
  sweep.center = wide(Vec3(pose.center - origin));
  if (!bodies.is(body, core::kAwake)) return sweep;
  // A slow body came to where it is by about its present velocity.
  sweep.way = wide(Vec3(motion.linear * step.dt));
  sweep.center = sweep.center - sweep.way;
  return sweep;
}

// How it turned.
void add_turning(const StepContext& step, BodyIndex body, Sweep& sweep) {
  const Bodies& bodies = *step.bodies;
  const Quat& end = bodies.pose[body].orientation;
  const bool round = sweep.turn_radius == 0;
  if (round || !is_fast(bodies, body)) {
    const bool moves = !round && bodies.is(body, core::kAwake);
    const Vec3& angular = bodies.motion[body].angular;
    sweep.set_stretch(0, moves ? after_turn(end, -step.dt * angular) : end, end);
    return;
  }
  const FastStart& start = step.fast->start[body];
  sweep.stretches = static_cast<int>(start.knots.size()) + 1;
  for (int i = 0; i < sweep.stretches; ++i) {
    const auto k = static_cast<std::size_t>(i);
    sweep.set_stretch(i, i == 0 ? start.pose.orientation : start.knots[k - 1],
                      i + 1 == sweep.stretches ? end : start.knots[k]);
  }
}

// -- One pair of shapes.

// When shape a, of which `collider` is the collider, first touches b on its way into it. One that is
// in touch or inside at the start may come again, having been apart; else it is for the contacts to
// stop, and what they let through goes no farther than to the next of a few depths.
template <class Other>
double impact_of(const Collider& collider, SweptShape a, Other b, double touch, double last) {
  const double radius = inner_radius(collider);
  const double graze = std::min(2 * double(kSpeculativeDistance), 0.25 * radius);
  double above = 0;
  for (const double depth : {graze, 0.5 * radius, 0.9 * radius}) {
    SweptShape inner = a;
    inner.erode(collider, depth);
    const double within = first_near(inner, b, 0.25 * (depth - above), 0, last);
    above = depth;
    if (within == kNever) return kNever;
    if (within == 0) continue;  // is that deep already
    double from = 0;
    if (first_near(a, b, touch, 0, 0) == 0) from = first_apart(a, b, 2 * touch, within);
    if (from == kNever) return within;
    return std::min(within, first_near(a, b, touch, from, within));
  }
  return kNever;
}

struct Box {
  V3d low, high;
};

// Bounds, in the frame that turns and moves with a mesh, of a ball of this radius about a body's
// centre during [t0, t1], grown by what the two do between.
Box swept_ball(const Sweep& ball, double radius, const Sweep& mesh, double t0, double t1) {
  constexpr int kCuts = 4;
  Box box{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  V3d before{0, 0, 0};
  double longest = 0;
  for (int i = 0; i <= kCuts; ++i) {
    const double t = t0 + (t1 - t0) * i / kCuts;
    const V3d p = transposed_times(mesh.axes_at(t), ball.center_at(t) - mesh.center_at(t));
    if (i > 0) longest = std::max(longest, length(p - before));
    before = p;
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
  }
  double angle = 0;
  for (int i = 0; i < mesh.stretches; ++i)
    angle = std::max(angle, mesh.stretch[i].angle * mesh.stretches * (t1 - t0) / kCuts);
  const double bulge = angle > 0 ? 0.5 * longest * std::min(1.0, angle) : 0;
  const double bent = 0.25 * length(ball.bend) * (t1 - t0) * (t1 - t0);
  const double slack = radius * (1 + 1e-6) + bulge + bent + 1e-6 * length(before);
  box.low = box.low - V3d{slack, slack, slack};
  box.high = box.high + V3d{slack, slack, slack};
  return box;
}

// A convex shape against the triangles that lie in its way, stretch by stretch: when it first meets
// one, as when(shape, triangle, last) has it.
template <class When>
double first_with_mesh(const Collider& convex, const Sweep& sweep, double radius,
                       const Collider& mesh_collider, const Sweep& mesh_sweep, bool front_only,
                       std::vector<std::uint32_t>& triangles, const When& when) {
  const core::MeshGeometry& mesh = *mesh_collider.mesh;
  const V3d local = wide(mesh_collider.local_position);
  const M3d axes = mesh_collider.has_local_rotation ? matrix_of(mesh_collider.local_rotation)
                                                    : M3d{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const SweptShape shape = swept_shape(convex, sweep);
  const double way = length(sweep.way - mesh_sweep.way);
  const int stretches = static_cast<int>(std::clamp(std::ceil(way / (8 * radius)), 1.0, 256.0));
  SweptShape at_start = shape;
  at_start.place(0);
  const V3d middle = at_start.core.center;
  double earliest = kNever;
  for (int i = 0; i < stretches && earliest == kNever; ++i) {
    const double t0 = double(i) / stretches, t1 = double(i + 1) / stretches;
    const Box box = swept_ball(sweep, radius, mesh_sweep, t0, t1);
    // From the body's frame to the mesh's own.
    const V3d centre = transposed_times(axes, (box.low + box.high) * 0.5 - local);
    const V3d half = (box.high - box.low) * 0.5;
    float low[3], high[3];
    const double c[3] = {centre.x, centre.y, centre.z};
    const V3d column[3] = {axes.c0, axes.c1, axes.c2};
    for (int k = 0; k < 3; ++k) {
      const double h = std::fabs(column[k].x) * half.x + std::fabs(column[k].y) * half.y +
                       std::fabs(column[k].z) * half.z;
      low[k] = core::rounded_to_float(c[k] - h * (1 + 1e-6) - 1e-6 * std::fabs(c[k]));
      high[k] = core::rounded_to_float(c[k] + h * (1 + 1e-6) + 1e-6 * std::fabs(c[k]));
    }
    triangles.clear();
    mesh.tree->query(low, high, triangles);
    for (const std::uint32_t triangle : triangles) {
      V3d corner[3];
      for (unsigned k = 0; k < 3; ++k)
        corner[k] = local + axes * wide(mesh.vertices[mesh.triangles[triangle][k]]);
      // A surface has a front: what starts behind it goes through.
      const V3d normal =
          mesh_sweep.axes_at(0) * cross(corner[1] - corner[0], corner[2] - corner[0]);
      const V3d from = mesh_sweep.center_at(0) + mesh_sweep.axes_at(0) * corner[0];
      if (front_only && dot(normal, middle - from) < 0) continue;
      const double time = when(shape, swept_triangle(corner, mesh_sweep), std::min(earliest, t1));
      earliest = std::min(earliest, time);
    }
  }
  return earliest;
}

SweptPlane swept_plane(const Collider& plane, const Sweep& sweep) {
  SweptPlane swept;
  swept.sweep = &sweep;
  const M3d axes = plane.has_local_rotation ? matrix_of(plane.local_rotation)
                                            : M3d{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const V3d normal = axes * wide(plane.size);
  swept.normal = normal * (1 / length(normal));
  swept.offset = plane.plane_offset + dot(swept.normal, wide(plane.local_position));
  return swept;
}

// -- A pair of bodies' shapes.

// Whether a ball of this radius about a moving centre stays away from the box of a collider.
bool far_from_box(const StepContext& step, const Sweep& ball, double radius, const Collider& other,
                  const Sweep& sweep, const Vec3& origin) {
  const Aabb box = tight_bounds(other, step.bodies->pose[other.body]);
  const V3d last = ball.center_at(1), bend = ball.bend * 0.25;
  const double turning = sweep.stretches * sweep.stretch[0].angle > 0 ? 2 * sweep.turn_radius : 0;
  const auto axis = [](const V3d& v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; };
  for (int i = 0; i < 3; ++i) {
    const double slack = radius + turning + std::fabs(axis(bend, i)) +
                         std::fabs(axis(sweep.way, i)) + std::fabs(axis(sweep.bend, i));
    const double from = axis(ball.center, i) + origin[i], to = axis(last, i) + origin[i];
    if (std::max(from, to) + slack < double(box.min[i]) ||
        std::min(from, to) - slack > double(box.max[i]))
      return true;
  }
  return false;
}

// When shape a first touches a sensor, or as one. Seen from `touch` away it would be too early: the
// shape is that much smaller.
template <class Other>
double crossing_of(const Collider& collider, SweptShape a, Other b, double touch, double last) {
  a.erode(collider, std::min(touch, 0.5 * inner_radius(collider)));
  return first_near(a, b, touch, 0, last);
}

// Squared, how near two points come that move steadily between the times.
double squared_approach(const V3d& from, const V3d& to) {
  const V3d way = to - from;
  const double squared = dot(way, way);
  const double t = squared > 0 ? std::clamp(-dot(from, way) / squared, 0.0, 1.0) : 0.0;
  const V3d nearest = from + way * t;
  return dot(nearest, nearest);
}

// Whether balls about the two moving centres stay apart.
bool balls_pass(const Sweep& a, const Sweep& b, double radii) {
  const double slack = 0.25 * (length(a.bend) + length(b.bend));
  const double least = (radii + slack) * (radii + slack);
  const auto between = [&](double t) {
    return (b.center + b.way * std::min(t, b.end)) - (a.center + a.way * std::min(t, a.end));
  };
  V3d from = between(0);
  double before = 0;
  for (const double t : {std::min(a.end, b.end), std::max(a.end, b.end)}) {
    if (t == before) continue;
    const V3d to = between(t);
    if (squared_approach(from, to) <= least) return false;
    from = to;
    before = t;
  }
  return dot(from, from) > least;
}

// Whether both are fast, but not past each other, neither at the start of the step nor over it: the
// contacts of its start do for such a pair (fast_touch) unless one of them stops.
bool side_by_side(const StepContext& step, const FastPair& pair, const Sweep& a, const Sweep& b) {
  const Bodies& bodies = *step.bodies;
  if (!is_fast(bodies, pair.body_a) || !is_fast(bodies, pair.body_b)) return false;
  const FastStart& start_a = step.fast->start[pair.body_a];
  const FastStart& start_b = step.fast->start[pair.body_b];
  const core::BodyMass &ma = bodies.mass[pair.body_a], &mb = bodies.mass[pair.body_b];
  if (core::part_fast(ma, start_a.motion, mb, start_b.motion, step.dt)) return false;
  const double turning =
      start_a.angle * double(ma.turn_radius) + start_b.angle * double(mb.turn_radius);
  return length(a.way - b.way) + turning <= std::min(core::safe_motion(ma), core::safe_motion(mb));
}

// Whether the pair has contacts, and what came nearer along their normals is what a body may do on
// the word of contacts.
bool held_by_contacts(const StepContext& step, const FastPair& pair, const Sweep& a,
                      const Sweep& b) {
  if (pair.row == core::kNone) return false;
  const ContactPair& row = step.contacts->pairs[pair.row];
  if (row.manifold_count == 0) return false;
  const Bodies& bodies = *step.bodies;
  const V3d way = b.way * b.end - a.way * a.end;
  double safe = 1e300, turning = 0;
  for (const BodyIndex body : {pair.body_a, pair.body_b}) {
    if (!is_fast(bodies, body)) continue;
    const core::BodyMass& mass = bodies.mass[body];
    safe = std::min(safe, core::safe_motion(mass));
    turning += step.fast->start[body].angle * double(mass.turn_radius);
  }
  for (std::uint32_t i = 0; i < row.manifold_count; ++i) {
    const V3d normal = wide(step.contacts->manifolds[row.first_manifold + i].normal);
    if (turning - dot(normal, way) > safe) return false;
  }
  return true;
}

double impact_of_pair(const StepContext& step, const FastPair& pair,
                      std::vector<std::uint32_t>& triangles) {
  const Bodies& bodies = *step.bodies;
  // First the one that is eroded: a fast one, unless it is a mesh.
  ColliderIndex ia = pair.a, ib = pair.b;
  const auto kind = [&](ColliderIndex i) { return step.colliders->rows[i].type; };
  const auto is_convex = [&](ColliderIndex i) { return kind(i) < ShapeType::plane; };
  const bool second_first = !is_convex(ia) || (is_convex(ib) && !is_fast(bodies, pair.body_a));
  if (second_first) std::swap(ia, ib);
  const Collider &a = step.colliders->rows[ia], &b = step.colliders->rows[ib];
  if (a.type >= ShapeType::plane) return kNever;         // no contact exists between these either
  if (b.type == ShapeType::height_field) return kNever;  // contacts foresee these (fast_touch)
  const Vec3 origin = bodies.pose[a.body].center;
  Sweep sa = path_of(step, a.body, origin), sb = path_of(step, b.body, origin);
  const core::BodyMass &ma = bodies.mass[a.body], &mb = bodies.mass[b.body];
  if (pair.sensor) {  // which the solid shapes' radius leaves out
    sa.turn_radius = std::max(sa.turn_radius, ma.radius);
    sb.turn_radius = std::max(sb.turn_radius, mb.radius);
  }

  const double apart = length(sb.center - sa.center);
  const bool both_go = sa.end == 1 && sb.end == 1;
  if (!pair.sensor) {
    if (both_go && side_by_side(step, pair, sa, sb)) return kNever;
    const bool swapped = a.body != pair.body_a;
    if (held_by_contacts(step, pair, swapped ? sb : sa, swapped ? sa : sb)) return kNever;
  }
  // A plane's or mesh's body may be all over the place: its radius says nothing, or everything.
  if (b.type != ShapeType::plane && balls_pass(sa, sb, ma.radius + mb.radius + kTouchReach))
    return kNever;
  add_turning(step, a.body, sa);
  add_turning(step, b.body, sb);
  if (b.type != ShapeType::plane && far_from_box(step, sa, ma.radius, b, sb, origin)) return kNever;
  const double touch = core::touch_gap(ma, mb, b.type == ShapeType::plane ? 0 : apart);
  const auto when = [&](const SweptShape& shape, const auto& other, double last) {
    return pair.sensor ? crossing_of(a, shape, other, touch, last)
                       : impact_of(a, shape, other, touch, last);
  };
  if (b.type == ShapeType::plane) return when(swept_shape(a, sa), swept_plane(b, sb), 1);
  if (b.type == ShapeType::mesh)
    return first_with_mesh(a, sa, ma.radius, b, sb, !pair.sensor, triangles, when);
  return when(swept_shape(a, sa), swept_shape(b, sb), 1);
}

// -- Which pairs.

bool may_meet(const StepContext& step, BodyIndex a, BodyIndex b) {
  return !is_fast_kinematic(step, a) && !is_fast_kinematic(step, b);
}

bool kinematic_may_cross(const StepContext& step, BodyIndex body) {
  return step.settings->continuous && is_fast_kinematic(step, body);
}

// The box of the ball about a body that holds its shapes.
Reach reach_of(const StepContext& step, BodyIndex body) {
  const Bodies& bodies = *step.bodies;
  const Vec3& center = bodies.pose[body].center;
  const double radius = bodies.mass[body].radius * (1 + 1e-6);
  if (!bodies.is(body, core::kAwake))
    return {center - Vec3::Constant(radius), center + Vec3::Constant(radius)};
  const Vec3& velocity = bodies.motion[body].linear;
  const bool fast = is_fast(bodies, body);
  const FastStart* const start = fast ? &step.fast->start[body] : nullptr;
  const Vec3 from = fast ? start->pose.center : Vec3(center - velocity * step.dt);
  // A parabola leaves the line between its ends by an eighth of what its speed changes.
  const double bent = fast ? 0.125 * step.dt * (velocity - start->motion.linear).norm() : 0;
  const Vec3 slack = Vec3::Constant(radius + bent);
  return {from.cwiseMin(center) - slack, from.cwiseMax(center) + slack};
}

void reach_of_awake(const StepContext& step, std::vector<Reach>& reach) {
  if (reach.size() < step.bodies->rows()) reach.resize(step.bodies->rows());
  for (const BodyIndex body : step.bodies->awake) reach[body] = reach_of(step, body);
}

bool may_reach(const StepContext& step, const std::vector<Reach>& reach, const ContactPair& pair) {
  for (const ColliderIndex collider : {pair.a, pair.b})
    if (step.colliders->rows[collider].type == ShapeType::plane) return true;
  const auto of = [&](BodyIndex body) {
    return step.bodies->is(body, core::kAwake) ? reach[body] : reach_of(step, body);
  };
  const Reach a = of(pair.body_a), b = of(pair.body_b);
  const double touch = kTouchReach;
  return ((a.low.array() <= b.high.array() + touch) && (b.low.array() <= a.high.array() + touch))
      .all();
}

void add_active_pairs(const StepContext& step) {
  const Bodies& bodies = *step.bodies;
  std::vector<Reach>& reach = step.continuous->reach;
  reach_of_awake(step, reach);
  for (const std::uint32_t row : step.contacts->active) {
    const ContactPair& pair = step.contacts->pairs[row];
    const bool sensor = pair.flags & core::kSensorPair;
    const bool fast = (bodies.flags[pair.body_a] | bodies.flags[pair.body_b]) & core::kFast;
    if (sensor) {
      if (pair.flags & core::kBegun) continue;  // its overlap at one pose a step says enough
      if (!fast && !kinematic_may_cross(step, pair.body_a) &&
          !kinematic_may_cross(step, pair.body_b))
        continue;
    } else if (!fast || !may_meet(step, pair.body_a, pair.body_b)) {
      continue;
    }
    if (!may_reach(step, reach, pair)) continue;
    step.fast->pairs.push_back({pair.a, pair.b, pair.body_a, pair.body_b, kNever, sensor, row});
  }
}

Aabb box_over_step(const StepContext& step, ColliderIndex collider, BodyIndex body) {
  const Collider& row = step.colliders->rows[collider];
  const Aabb from = tight_bounds(row, step.fast->start[body].pose);
  Aabb box = tight_bounds(row, step.bodies->pose[body]);
  const double turn = step.fast->start[body].angle;
  const double reach = double(step.bodies->mass[body].turn_radius);
  // Between its ends an arc leaves the box of the two by less than its height.
  const auto bulge = core::rounded_to_float(reach * std::min(2.0, 0.125 * turn * turn));
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::min(box.min[axis], from.min[axis]) - bulge;
    box.max[axis] = std::max(box.max[axis], from.max[axis]) + bulge;
  }
  return box;
}

bool is_inside(const Aabb& inner, const Aabb& outer) {
  bool in = true;
  for (int axis = 0; axis < 3; ++axis)
    in = in && inner.min[axis] >= outer.min[axis] && inner.max[axis] <= outer.max[axis];
  return in;
}

template <class Visit>
void for_colliders(const StepContext& step, BodyIndex body, const Visit& visit) {
  for (ColliderIndex c = step.bodies->first_collider[body]; c != core::kNone;
       c = step.colliders->rows[c].next_in_body)
    visit(c);
}

bool joined(const StepContext& step, BodyIndex a, BodyIndex b) {
  const auto& keys = step.joints->no_collide;
  const std::uint64_t low = std::min(a, b), high = std::max(a, b);
  return !keys.empty() && std::binary_search(keys.begin(), keys.end(), (low << 32) | high);
}

// A pair that the broadphase did not foresee.
void add_pair(const StepContext& step, ColliderIndex a, ColliderIndex b) {
  if (a > b) std::swap(a, b);
  const Collider &ca = step.colliders->rows[a], &cb = step.colliders->rows[b];
  if (ca.body == cb.body || !core::filters_meet(ca.filter, cb.filter)) return;
  const bool sensor = ca.sensor || cb.sensor;
  const std::uint32_t flags = step.bodies->flags[ca.body] | step.bodies->flags[cb.body];
  if ((flags & core::kQuarantined) || joined(step, ca.body, cb.body)) return;
  if (!sensor && !may_meet(step, ca.body, cb.body)) return;
  const std::uint64_t key = (std::uint64_t{a} << 32) | b;
  const auto& pairs = step.contacts->pairs;
  const auto at = std::lower_bound(
      pairs.begin(), pairs.end(), key,
      [](const ContactPair& pair, std::uint64_t wanted) { return pair.key() < wanted; });
  if (at != pairs.end() && at->key() == key) return;  // it is an active pair
  step.fast->pairs.push_back({a, b, ca.body, cb.body, kNever, sensor});
}

// Fat boxes foresee flights that forces bend by no more than a contact's reach.
bool was_foreseen(const StepContext& step, BodyIndex body) {
  const FastStart& start = step.fast->start[body];
  const core::BodyMotion& motion = step.bodies->motion[body];
  const double turn_radius = double(step.bodies->mass[body].turn_radius);
  const double change =
      (motion.linear - start.motion.linear).norm() +
      turn_radius * std::max(0.0, motion.angular.norm() - start.motion.angular.norm());
  return start.flight == core::FastFlight::free && change * step.dt <= double(kSpeculativeDistance);
}

// Bodies that impacts have thrown out of their fat boxes: against whatever the tree knows near them,
// and against each other, whose boxes it knows no more.
void add_thrown(const StepContext& step, ContinuousScratch& scratch) {
  std::vector<ThrownBox>& thrown = scratch.thrown;
  thrown.clear();
  for (const BodyIndex body : step.fast->bodies) {
    if (was_foreseen(step, body)) continue;
    for_colliders(step, body, [&](ColliderIndex c) {
      const Aabb box = box_over_step(step, c, body);
      if (!is_inside(box, step.broadphase->fat_bounds(c))) thrown.push_back({box, c});
    });
  }
  for (const ThrownBox& self : thrown) {
    scratch.found.clear();
    step.broadphase->collect(self.box, scratch.found);
    for (const ColliderIndex other : scratch.found) add_pair(step, self.collider, other);
  }
  std::sort(thrown.begin(), thrown.end(), [](const ThrownBox& a, const ThrownBox& b) {
    return a.box.min[0] != b.box.min[0] ? a.box.min[0] < b.box.min[0] : a.collider < b.collider;
  });
  for (std::size_t i = 0; i < thrown.size(); ++i)
    for (std::size_t k = i + 1; k < thrown.size() && thrown[k].box.min[0] <= thrown[i].box.max[0];
         ++k)
      if (overlap(thrown[i].box, thrown[k].box))
        add_pair(step, thrown[i].collider, thrown[k].collider);
}

bool by_colliders(const FastPair& a, const FastPair& b) {
  return a.a != b.a ? a.a < b.a : a.b < b.b;
}
bool same_colliders(const FastPair& a, const FastPair& b) { return a.a == b.a && a.b == b.b; }

}  // namespace

void find_fast(const StepContext& step, IndexRange, Task&) {
  FastBodies& fast = *step.fast;
  const Bodies& bodies = *step.bodies;
  fast.bodies.clear();
  fast.pairs.clear();
  fast.stopped.clear();
  fast.crossed.clear();
  bool kinematic = false;
  for (const BodyIndex body : bodies.awake) {
    if (is_fast(bodies, body)) {
      fast.bodies.push_back(body);
      fast.part[body] = 1;
    }
    kinematic = kinematic || kinematic_may_cross(step, body);
  }
  if (fast.bodies.empty() && !kinematic) return;
  add_active_pairs(step);
  add_thrown(step, *step.continuous);
  std::sort(fast.pairs.begin(), fast.pairs.end(), by_colliders);
  fast.pairs.erase(std::unique(fast.pairs.begin(), fast.pairs.end(), same_colliders),
                   fast.pairs.end());
}

void sweep_fast(const StepContext& step, IndexRange pairs, Task& task) {
  WorkerScratch& scratch = step.continuous->workers[task.worker()];
  for (std::uint32_t i = pairs.begin; i < pairs.end; ++i) {
    FastPair& pair = step.fast->pairs[i];
    pair.touch = impact_of_pair(step, pair, scratch.triangles);
  }
}

namespace {

// Takes meetings in order of time.
class Impacts {
 public:
  explicit Impacts(const StepContext& step)
      : step_(step), fast_(*step.fast), scratch_(*step.continuous) {}

  void run() {
    collect();
    while (!scratch_.meetings.empty()) take(next());
    std::sort(fast_.stopped.begin(), fast_.stopped.end());
  }

 private:
  static bool later(const Meeting& a, const Meeting& b) { return b < a; }

  void collect() {
    scratch_.meetings.clear();
    scratch_.version.assign(fast_.pairs.size(), 0);
    scratch_.of_body.clear();
    for (std::uint32_t i = 0; i < fast_.pairs.size(); ++i) {
      const FastPair& pair = fast_.pairs[i];
      if (pair.sensor) continue;
      if (pair.touch <= 1) push(i);
      if (!is_fast(pair.body_a) || !is_fast(pair.body_b)) continue;
      scratch_.of_body.emplace_back(pair.body_a, i);
      scratch_.of_body.emplace_back(pair.body_b, i);
    }
    if (!scratch_.meetings.empty()) std::sort(scratch_.of_body.begin(), scratch_.of_body.end());
  }

  void push(std::uint32_t pair) {
    scratch_.meetings.push_back({fast_.pairs[pair].touch, pair, scratch_.version[pair]});
    std::push_heap(scratch_.meetings.begin(), scratch_.meetings.end(), later);
  }
  Meeting next() {
    std::pop_heap(scratch_.meetings.begin(), scratch_.meetings.end(), later);
    const Meeting meeting = scratch_.meetings.back();
    scratch_.meetings.pop_back();
    return meeting;
  }

  void take(const Meeting& meeting) {
    if (meeting.version != scratch_.version[meeting.pair]) return;
    const FastPair& pair = fast_.pairs[meeting.pair];
    for (const BodyIndex body : {pair.body_a, pair.body_b})
      if (is_fast(body) && fast_.part[body] > meeting.time) stop(body, meeting);
  }

  // The pairs of a body that has stopped meet elsewhere, earlier or later, or not at all. Those of
  // `at` itself are done.
  void stop(BodyIndex body, const Meeting& at) {
    fast_.part[body] = at.time;
    fast_.stopped.push_back(body);
    auto& of_body = scratch_.of_body;
    for (auto it = std::lower_bound(of_body.begin(), of_body.end(), std::pair(body, 0u));
         it != of_body.end() && it->first == body; ++it) {
      const std::uint32_t row = it->second;
      if (row == at.pair) continue;
      FastPair& pair = fast_.pairs[row];
      ++scratch_.version[row];
      const double time = impact_of_pair(step_, pair, scratch_.workers[0].triangles);
      pair.touch = std::max(time, at.time);
      if (pair.touch <= 1) push(row);
    }
  }

  bool is_fast(BodyIndex body) const { return collision::is_fast(*step_.bodies, body); }

  const StepContext& step_;
  FastBodies& fast_;
  ContinuousScratch& scratch_;
};

}  // namespace

void order_impacts(const StepContext& step) {
  FastBodies& fast = *step.fast;
  if (fast.pairs.empty()) return;
  Impacts(step).run();
  const auto stopped_before = [&](BodyIndex body, double time) {
    return is_fast(*step.bodies, body) && fast.part[body] < time;
  };
  for (FastPair& pair : fast.pairs) {
    if (!pair.sensor) continue;
    if (stopped_before(pair.body_a, pair.touch) || stopped_before(pair.body_b, pair.touch))
      pair.touch = impact_of_pair(step, pair, step.continuous->workers[0].triangles);
    if (pair.touch <= 1) fast.crossed.push_back(pair);
  }
}

}  // namespace skerry::collision
