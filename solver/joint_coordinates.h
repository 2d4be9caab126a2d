// The coordinates of a joint at given poses, and the velocity rows that change them.
//
//   Maths    q = conj(a's frame) b's frame = swing twist, the swing about an axis in the xy plane, the
//            twist about z (Dobrowolski 2015, "Swing-twist decomposition in Clifford algebra"). The
//            coordinates hold up to half a turn of swing; a ball's rows know no angle at all.
//   Rows     A force along a translation acts on both bodies at b's anchor, so equal and opposite
//            impulses keep momentum and angular momentum to rounding. The rates of `twist`, `swing`
//            and of all translations are exact; swing_x and swing_y to second order in the swing.
#pragma once

#include "core/joints_data.h"
#include "solver/joint_maths.h"

namespace skerry::solver {

// A body as a joint sees it.
struct JointPose {
  V3d center;  // m
  Q4d orientation;
};

// Where a joint holds its bodies: anchors and frames in their axes, from their centres of mass.
struct JointMounts {
  V3d anchor_a, anchor_b;
  Q4d frame_a, frame_b;
};

// The rate of a coordinate: linear . (vb - va) + angular_b . wb - angular_a . wa.
struct JointRow {
  V3d linear, angular_a, angular_b;
};

struct JointGeometry {
  V3d arm_a, arm_b;  // m, b's anchor from each centre
  V3d offset;        // m, b's anchor from a's
  V3d axis[3];       // a's frame
  // Only with angles:
  V3d half_x, half_y;    // axes of a's frame turned by half the swing
  V3d twist_axis;        // per rad/s of turning about it
  V3d swing_axis;        // unit
  double swing[2] = {};  // rad
  double swing_angle = 0, twist = 0;
};

JointGeometry joint_geometry(const JointMounts& mounts, const JointPose& a, const JointPose& b,
                             bool with_angles);
double value_of(const JointGeometry& geometry, JointCoordinate coordinate);
JointRow row_of(const JointGeometry& geometry, JointCoordinate coordinate);

inline bool is_angular(JointCoordinate coordinate) {
  return coordinate == JointCoordinate::swing_x || coordinate == JointCoordinate::swing_y ||
         coordinate == JointCoordinate::twist || coordinate == JointCoordinate::swing;
}
// The angle less whole turns, in [middle - pi, middle + pi].
double within_turn(double angle, double middle);

// A coordinate at the present poses of the bodies: m, or rad in (-pi, pi].
double joint_position(const core::Joint& joint, const core::Bodies& bodies,
                      JointCoordinate coordinate);

}  // namespace skerry::solver
