#include "collision/continuous.h"

#include <algorithm>
#include <cmath>

#include "collision/broadphase.h"
#include "collision/continuous_scratch.h"
#include "collision/height_field.h"
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

ContinuousScratchPtr make_continuous_scratch(std::uint32_t workers) {
  return ContinuousScratchPtr(new ContinuousScratch(workers));
}
void ContinuousScratchDeleter::operator()(ContinuousScratch* scratch) const { delete scratch; }

namespace {

// -- How bodies moved.

Quat after_turn(const Quat& from, const Vec3& turn) {
  const double angle = turn.norm();
  if (angle == 0) return from;
  const auto [sine, cosine] = core::trig::sin_cos(0.5 * angle);
  const Vec3 v = turn * (sine / angle);
  return Quat(cosine, v.x(), v.y(), v.z()) * from;
}

// The way of a body's centre.
Sweep path_of(const StepContext& step, BodyIndex body, const Vec3& origin, double end) {
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
    sweep.end = end;
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

// Bounds, in the frame that turns and moves with a surface, of a ball of this radius about a body's
// centre during [t0, t1], grown by what the two do between.
Box swept_ball(const Sweep& ball, double radius, const Sweep& surface, double t0, double t1) {
  constexpr int kCuts = 4;
  Box box{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  V3d before{0, 0, 0};
  double longest = 0;
  for (int i = 0; i <= kCuts; ++i) {
    const double t = t0 + (t1 - t0) * i / kCuts;
    const V3d p = transposed_times(surface.axes_at(t), ball.center_at(t) - surface.center_at(t));
    if (i > 0) longest = std::max(longest, length(p - before));
    before = p;
    box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
    box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
  }
  double angle = 0;
  for (int i = 0; i < surface.stretches; ++i)
    angle = std::max(angle, surface.stretch[i].angle * surface.stretches * (t1 - t0) / kCuts);
  const double bulge = angle > 0 ? 0.5 * longest * std::min(1.0, angle) : 0;
  const double bent = 0.25 * length(ball.bend) * (t1 - t0) * (t1 - t0);
  const double slack = radius * (1 + 1e-6) + bulge + bent + 1e-6 * length(before);
  box.low = box.low - V3d{slack, slack, slack};
  box.high = box.high + V3d{slack, slack, slack};
  return box;
}

// Of a mesh or a height field, in its shape frame.
void find_triangles(const Collider& surface, const float low[3], const float high[3],
                    std::vector<std::uint32_t>& triangles) {
  triangles.clear();
  if (surface.type == ShapeType::mesh)
    surface.mesh->tree->query(low, high, triangles);
  else
    find_field_triangles(*surface.field, low, high, triangles);
}
V3d corner_of(const Collider& surface, std::uint32_t triangle, unsigned i) {
  if (surface.type == ShapeType::height_field)
    return wide(field_corner(*surface.field, triangle, i));
  return wide(surface.mesh->vertices[surface.mesh->triangles[triangle][i]]);
}

// A convex shape against the triangles that lie in its way, stretch by stretch: when it first meets
// one, as when(shape, triangle, last) has it.
template <class When>
double first_with_surface(const Collider& convex, const Sweep& sweep, double radius,
                          const Collider& surface, const Sweep& surface_sweep, bool front_only,
                          std::vector<std::uint32_t>& triangles, const When& when) {
  const V3d local = wide(surface.local_position);
  const M3d axes = surface.has_local_rotation ? matrix_of(surface.local_rotation)
                                              : M3d{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const SweptShape shape = swept_shape(convex, sweep);
  const double way = length(sweep.way - surface_sweep.way);
  const int stretches = static_cast<int>(std::clamp(std::ceil(way / (8 * radius)), 1.0, 256.0));
  SweptShape at_start = shape;
  at_start.place(0);
  const V3d middle = at_start.core.center;
  double earliest = kNever;
  for (int i = 0; i < stretches && earliest == kNever; ++i) {
    const double t0 = double(i) / stretches, t1 = double(i + 1) / stretches;
    const Box box = swept_ball(sweep, radius, surface_sweep, t0, t1);
    // From the body's frame to the surface's own.
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
    find_triangles(surface, low, high, triangles);
    for (const std::uint32_t triangle : triangles) {
      V3d corner[3];
      for (unsigned k = 0; k < 3; ++k) corner[k] = local + axes * corner_of(surface, triangle, k);
      // A surface has a front: what starts behind it goes through.
      const V3d normal =
          surface_sweep.axes_at(0) * cross(corner[1] - corner[0], corner[2] - corner[0]);
      const V3d from = surface_sweep.center_at(0) + surface_sweep.axes_at(0) * corner[0];
      if (front_only && dot(normal, middle - from) < 0) continue;
      const double time =
          when(shape, swept_triangle(corner, surface_sweep), std::min(earliest, t1));
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
bool far_from_box(const StepContext& step, const Sweep& ball, double radius, ColliderIndex other,
                  const Sweep& sweep, const Vec3& origin) {
  const Collider& row = step.colliders->rows[other];
  // The fat box of what has not moved holds it, without a look at all vertices of a mesh.
  const Aabb box = step.bodies->is(row.body, core::kAwake)
                       ? tight_bounds(row, step.bodies->pose[row.body])
                       : step.broadphase->fat_bounds(other);
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

// When a, which is convex, first meets b on these ways. `apart`: m, of the bodies' centres at first.
double first_meeting(const StepContext& step, const Collider& a, const Sweep& sa, const Collider& b,
                     const Sweep& sb, double apart, bool sensor,
                     std::vector<std::uint32_t>& triangles) {
  const core::BodyMass &ma = step.bodies->mass[a.body], &mb = step.bodies->mass[b.body];
  const double touch = core::touch_gap(ma, mb, b.type == ShapeType::plane ? 0 : apart);
  const auto when = [&](const SweptShape& shape, const auto& other, double last) {
    return sensor ? crossing_of(a, shape, other, touch, last)
                  : impact_of(a, shape, other, touch, last);
  };
  if (b.type == ShapeType::plane) return when(swept_shape(a, sa), swept_plane(b, sb), 1);
  if (core::is_surface(b.type))
    return first_with_surface(a, sa, ma.radius, b, sb, !sensor, triangles, when);
  return when(swept_shape(a, sa), swept_shape(b, sb), 1);
}

// The way of a body that moves on as it now does, turning included.
Sweep path_ahead(const StepContext& step, BodyIndex body, const Vec3& origin) {
  const Bodies& bodies = *step.bodies;
  const core::BodyPose& pose = bodies.pose[body];
  const core::BodyMotion& motion = bodies.motion[body];
  const bool moves = bodies.is(body, core::kAwake);
  Sweep sweep;
  sweep.turn_radius = double(bodies.mass[body].turn_radius);
  sweep.center = wide(Vec3(pose.center - origin));
  if (moves) sweep.way = wide(Vec3(motion.linear * step.dt));
  const bool turns = moves && sweep.turn_radius > 0;
  const Vec3 turn = turns ? Vec3(motion.angular * step.dt) : Vec3(Vec3::Zero());
  constexpr double kStretch = 0.4;  // rad
  sweep.stretches =
      static_cast<int>(std::clamp(turn.norm() / kStretch + 1, 1.0, double(Sweep::kMostStretches)));
  Quat from = pose.orientation;
  for (int i = 0; i < sweep.stretches; ++i) {
    const Quat to = turns ? after_turn(from, turn / sweep.stretches) : from;
    sweep.set_stretch(i, from, to);
    from = to;
  }
  return sweep;
}

}  // namespace

bool will_meet(const StepContext& step, const core::ContactPair& pair,
               std::vector<std::uint32_t>& triangles) {
  const Bodies& bodies = *step.bodies;
  const Collider *a = &step.colliders->rows[pair.a], *b = &step.colliders->rows[pair.b];
  if (a->type >= ShapeType::plane ||
      (b->type < ShapeType::plane && !core::moves_fast(bodies, a->body, step.dt)))
    std::swap(a, b);
  if (a->type >= ShapeType::plane) return false;
  const Vec3 origin = bodies.pose[a->body].center;
  const Sweep sa = path_ahead(step, a->body, origin), sb = path_ahead(step, b->body, origin);
  return first_meeting(step, *a, sa, *b, sb, length(sb.center - sa.center), false, triangles) <= 1;
}

double impact_of_pair(const StepContext& step, const FastPair& pair, const Ends& ends,
                      std::vector<std::uint32_t>& triangles) {
  const Bodies& bodies = *step.bodies;
  // First the one that is eroded: a fast one, unless it is a surface.
  ColliderIndex ia = pair.a, ib = pair.b;
  const auto kind = [&](ColliderIndex i) { return step.colliders->rows[i].type; };
  const auto is_convex = [&](ColliderIndex i) { return kind(i) < ShapeType::plane; };
  const bool second_first = !is_convex(ia) || (is_convex(ib) && !is_fast(bodies, pair.body_a));
  if (second_first) std::swap(ia, ib);
  const Collider &a = step.colliders->rows[ia], &b = step.colliders->rows[ib];
  if (a.type >= ShapeType::plane) return kNever;  // no contact exists between these either
  const Vec3 origin = bodies.pose[a.body].center;
  Sweep sa = path_of(step, a.body, origin, second_first ? ends.b : ends.a);
  Sweep sb = path_of(step, b.body, origin, second_first ? ends.a : ends.b);
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
    // Contacts with a surface say nothing of what rises ahead.
    if (!core::is_surface(b.type) &&
        held_by_contacts(step, pair, swapped ? sb : sa, swapped ? sa : sb))
      return kNever;
  }
  // A plane's or surface's body may be all over the place: its radius says nothing, or everything.
  if (b.type != ShapeType::plane && balls_pass(sa, sb, ma.radius + mb.radius + kTouchReach))
    return kNever;
  add_turning(step, a.body, sa);
  add_turning(step, b.body, sb);
  if (b.type != ShapeType::plane && far_from_box(step, sa, ma.radius, ib, sb, origin))
    return kNever;
  return first_meeting(step, a, sa, b, sb, apart, pair.sensor, triangles);
}

void sweep_fast(const StepContext& step, IndexRange pairs, Task& task) {
  FastScratch& scratch = step.continuous->workers[task.worker()];
  for (std::uint32_t i = pairs.begin; i < pairs.end; ++i) {
    FastPair& pair = step.fast->pairs[i];
    pair.touch = impact_of_pair(step, pair, {}, scratch.triangles);
  }
}

}  // namespace skerry::collision
