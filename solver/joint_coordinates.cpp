#include "solver/joint_coordinates.h"

#include <algorithm>
#include <numbers>

#include "core/trig.h"

namespace skerry::solver {
namespace {

constexpr double kPi = std::numbers::pi;

void find_angles(const Q4d& frame_a, const Q4d& frame_b, JointGeometry& g) {
  Q4d q = conjugate(frame_a) * frame_b;
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  // twist = (0, 0, tz, tw), swing = q conj(twist) = (sx, sy, 0, cosine)
  const double cosine = std::sqrt(q.z * q.z + q.w * q.w);
  const bool turned_over = cosine < 1e-12;  // half a turn of swing: any twist will do
  const double tz = turned_over ? 0 : q.z / cosine, tw = turned_over ? 1 : q.w / cosine;
  const double sx = q.x * tw - q.y * tz, sy = q.y * tw + q.x * tz;
  const double sine = std::sqrt(sx * sx + sy * sy);
  const bool straight = sine < 1e-12;
  g.twist = 2 * core::trig::atan2(q.z, q.w);
  g.swing_angle = 2 * core::trig::atan2(sine, cosine);
  const double stretch = straight ? 2 : g.swing_angle / sine;
  g.swing[0] = sx * stretch;
  g.swing[1] = sy * stretch;
  g.swing_axis = straight ? g.axis[0] : (g.axis[0] * sx + g.axis[1] * sy) * (1 / sine);
  const Q4d half = frame_a * normalised(Q4d{sx, sy, 0, cosine + 1});
  g.half_x = rotate(half, {1, 0, 0});
  g.half_y = rotate(half, {0, 1, 0});
  const V3d z_b = rotate(frame_b, {0, 0, 1});
  g.twist_axis = (g.axis[2] + z_b) * (1 / std::max(1 + dot(g.axis[2], z_b), 1e-6));
}

JointRow translation(const JointGeometry& g, const V3d& along) {
  return {along, cross(g.arm_a, along), cross(g.arm_b, along)};
}
JointRow rotation(const V3d& about) { return {{0, 0, 0}, about, about}; }

}  // namespace

JointGeometry joint_geometry(const JointMounts& mounts, const JointPose& a, const JointPose& b,
                             bool with_angles) {
  JointGeometry g;
  const V3d to_anchor_a = rotate(a.orientation, mounts.anchor_a);
  g.arm_b = rotate(b.orientation, mounts.anchor_b);
  g.arm_a = (b.center - a.center) + g.arm_b;
  g.offset = g.arm_a - to_anchor_a;
  const Q4d frame_a = a.orientation * mounts.frame_a;
  const M3d axes = core::to_matrix(frame_a);
  g.axis[0] = axes.c0;
  g.axis[1] = axes.c1;
  g.axis[2] = axes.c2;
  if (with_angles) find_angles(frame_a, b.orientation * mounts.frame_b, g);
  return g;
}

double value_of(const JointGeometry& g, JointCoordinate coordinate) {
  switch (coordinate) {
    case JointCoordinate::swing_x:
      return g.swing[0];
    case JointCoordinate::swing_y:
      return g.swing[1];
    case JointCoordinate::twist:
      return g.twist;
    case JointCoordinate::swing:
      return g.swing_angle;
    case JointCoordinate::distance:
      return length(g.offset);
    default:
      return dot(g.axis[static_cast<int>(coordinate)], g.offset);
  }
}

JointRow row_of(const JointGeometry& g, JointCoordinate coordinate) {
  switch (coordinate) {
    case JointCoordinate::swing_x:
      return rotation(g.half_x);
    case JointCoordinate::swing_y:
      return rotation(g.half_y);
    case JointCoordinate::twist:
      return rotation(g.twist_axis);
    case JointCoordinate::swing:
      return rotation(g.swing_axis);
    case JointCoordinate::distance: {
      const double distance = length(g.offset);
      return translation(g, distance > 1e-12 ? g.offset * (1 / distance) : g.axis[2]);
    }
    default:
      return translation(g, g.axis[static_cast<int>(coordinate)]);
  }
}

double within_turn(double angle, double middle) {
  if (angle > middle + kPi) angle -= 2 * kPi;
  if (angle < middle - kPi) angle += 2 * kPi;
  return angle;
}

double joint_position(const core::Joint& joint, const core::Bodies& bodies,
                      JointCoordinate coordinate) {
  const auto pose = [&](core::BodyIndex body) {
    if (body == core::kNone) return JointPose{{0, 0, 0}, {0, 0, 0, 1}};
    return JointPose{scalars(bodies.pose[body].center), scalars(bodies.pose[body].orientation)};
  };
  const JointMounts mounts = {scalars(joint.anchor_a), scalars(joint.anchor_b),
                              scalars(joint.frame_a), scalars(joint.frame_b)};
  return value_of(joint_geometry(mounts, pose(joint.a), pose(joint.b), is_angular(coordinate)),
                  coordinate);
}

}  // namespace skerry::solver
