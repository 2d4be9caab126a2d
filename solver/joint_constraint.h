// A joint with everything the substeps need, and the passes over one of them.
#pragma once

#include <cstdint>
#include <span>

#include "solver/joint_bodies.h"

namespace skerry::solver {

// Soft constraint of a substep in impulse form: what is kept of the accumulated impulse, how much of
// the velocity is removed, and the speed asked for.
struct JointLawState {
  double keep = 1, mass_scale = 1;
  double push = 0;        // m/s or rad/s
  double lo = 0, hi = 0;  // N s or N m s
  double impulse = 0;     // of the present substep
  bool active = false;
};

// One axis: its row, cleared of what the locks of its joint answer at once, so that its effective
// mass is that of the bodies as the joint leaves them free.
struct JointAxisState {
  JointRow row;
  double mass = 0;         // kg or kg m^2; 0: nothing can move
  double value = 0;        // m or rad
  double rate_before = 0;  // m/s or rad/s, before the present kick
  double drift = 0;        // m/s or rad/s: half a substep of the rate's own change
  JointLawState law[core::kJointLaws];
};

struct JointConstraint {
  std::uint32_t joint = 0;  // row of core::Joints
  std::uint32_t row_a = 0, row_b = 0;
  std::uint32_t first_lock = 0, first_axis = 0;
  std::uint8_t lock_count = 0, axis_count = 0;
  bool with_angles = false;
  bool in_tree = false;
  JointMounts mounts;
  V3d arm_b;                       // m, at the present poses
  double error[kMaxLocks] = {};    // m or rad, at the present poses
  double drift[kMaxLocks] = {};    // m/s or rad/s, as of an axis
  double impulse[kMaxLocks] = {};  // of the present substep
  BlockFactor factor;
  V3d force = {0, 0, 0};   // N s on b, summed over the step
  V3d torque = {0, 0, 0};  // N m s on b about its anchor, likewise
};

// Which part of a substep a pass is, and its numbers.
struct JointPass {
  double h = 0, inv_h = 0;  // s, 1/s: of the drift
  double kick = 1;          // fraction of a substep that forces act for
  bool use_bias = true;     // pull errors in; else relax
  // Softness of locks and hard limits that are solved one joint at a time.
  double bias_rate = 0, mass_scale = 1, keep = 1;
};

// The arrays that constraints share: rows of their locks, their axes, and the bodies.
struct JointArrays {
  std::span<JointRow> locks;
  std::span<JointAxisState> axes;
  JointBodies& bodies;
};

// Rows, errors and effective masses at the present poses. In a pass with bias the laws of the axes
// start anew; in a relax pass springs and motors go on with what they were given.
void refresh(const core::Joint& joint, const JointPass& pass, const JointArrays& arrays,
             JointConstraint& c);
// Errors at the poses to which the present velocities would bring the bodies.
void look_ahead(const core::Joint& joint, const JointPass& pass, JointBodies& bodies,
                JointConstraint& c);
// Springs, motors and friction start anew with this pass's kick, at the values last refreshed.
void restart_drives(const core::Joint& joint, const JointPass& pass, const JointArrays& arrays,
                    JointConstraint& c);
// Applies the impulses of the last substep; those of the locks too unless a tree solves them.
void warm_start(const JointArrays& arrays, JointConstraint& c, double scale);
// Axes, then locks unless a tree solves them.
void solve(const JointPass& pass, const JointArrays& arrays, JointConstraint& c);

bool is_active(const core::DrivenAxis& axis, core::JointLaw law);

// Books an impulse along a row.
inline void book(JointConstraint& c, const JointRow& row, double impulse) {
  c.force = c.force + row.linear * impulse;
  c.torque = c.torque + (row.angular_b - cross(c.arm_b, row.linear)) * impulse;
}

}  // namespace skerry::solver
