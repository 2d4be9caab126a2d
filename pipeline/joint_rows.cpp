#include "pipeline/joint_rows.h"

#include <cmath>
#include <numbers>

#include "pipeline/body_edits.h"
#include "pipeline/edge_checks.h"
#include "pipeline/world_data.h"

namespace skerry::pipeline {
namespace {

using core::DrivenAxis;
using core::Joint;
using enum JointCoordinate;

constexpr double kPi = std::numbers::pi;

// May be infinite, not NaN, not negative.
void check_most(const std::string& field, double value) {
  if (value >= 0) return;
  throw InputError(field, field + ": must not be negative, got " + std::to_string(value));
}

void check_bounds(const std::string& lower_name, const std::string& upper_name,
                  const std::optional<double>& lower, const std::optional<double>& upper) {
  if (lower) check_finite(lower_name, *lower);
  if (upper) check_finite(upper_name, *upper);
  if (lower && upper && *lower > *upper) {
    throw InputError(lower_name, lower_name + ": must not be above " + upper_name + ", got " +
                                     std::to_string(*lower) + " above " + std::to_string(*upper));
  }
}

void check_within(const std::string& field, const std::optional<double>& value, double lowest,
                  double highest) {
  if (!value || (*value >= lowest && *value <= highest)) return;
  throw InputError(field, field + ": must be between " + std::to_string(lowest) + " and " +
                              std::to_string(highest) + ", got " + std::to_string(*value));
}

class JointMaker {
 public:
  explicit JointMaker(const WorldData& world) : world_(world) {}
  Joint row;

  void operator()(const BallJoint& joint) {
    common(joint, joint.anchor);
    lock({x, y, z});
    check_most("friction_torque", joint.friction_torque);
    if (joint.friction_torque == 0) return;
    for (const JointCoordinate c : {swing_x, swing_y, twist}) {
      axis(c, {}, {.friction = joint.friction_torque});
    }
  }
  void operator()(const HingeJoint& joint) {
    common(joint, joint.anchor);
    frame(about(joint.axis));
    lock({x, y, z, swing_x, swing_y});
    check_bounds("lower_angle", "upper_angle", joint.lower_angle, joint.upper_angle);
    check_within("lower_angle", joint.lower_angle, -2 * kPi, 2 * kPi);
    check_within("upper_angle", joint.upper_angle, -2 * kPi, 2 * kPi);
    check_frequency("limit_frequency", joint.limit_frequency);
    check_coefficient("limit_damping_ratio", joint.limit_damping_ratio);
    check_drive("drive", joint.drive);
    axis(twist,
         {joint.lower_angle, joint.upper_angle, joint.limit_frequency, joint.limit_damping_ratio},
         joint.drive);
  }
  void operator()(const SliderJoint& joint) {
    common(joint, joint.anchor);
    frame(about(joint.axis));
    lock({x, y, swing_x, swing_y, twist});
    check_limits("limits", z, joint.limits);
    check_drive("drive", joint.drive);
    axis(z, joint.limits, joint.drive);
  }
  void operator()(const FixedJoint& joint) {
    common(joint, joint.anchor);
    frame(Quat::Identity());
    lock({x, y, z, swing_x, swing_y, twist});
  }
  void operator()(const DistanceJoint& joint) {
    check_position("anchor_a", joint.anchor_a);
    check_position("anchor_b", joint.anchor_b);
    common(joint, joint.anchor_a);
    row.anchor_b = point_in(row.b, joint.anchor_b);
    check_limits("limits", distance, joint.limits);
    check_drive("drive", joint.drive);
    const JointLimits& limits = joint.limits;
    if (limits.lower && limits.lower == limits.upper && limits.frequency == 0 &&
        *limits.lower > 0) {
      lock({distance});
      row.length = *limits.lower;
    } else {
      axis(distance, limits, joint.drive);
    }
  }
  void operator()(const ConeTwistJoint& joint) {
    common(joint, joint.anchor);
    frame(about(joint.axis));
    lock({x, y, z});
    check_within("swing_limit", joint.swing_limit, 0, kPi);
    check_bounds("lower_twist", "upper_twist", joint.lower_twist, joint.upper_twist);
    check_within("lower_twist", joint.lower_twist, -2 * kPi, 2 * kPi);
    check_within("upper_twist", joint.upper_twist, -2 * kPi, 2 * kPi);
    check_frequency("limit_frequency", joint.limit_frequency);
    check_coefficient("limit_damping_ratio", joint.limit_damping_ratio);
    check_drive("swing", joint.swing);
    check_drive("twist", joint.twist);
    axis(swing_x, {}, joint.swing);
    axis(swing_y, {}, joint.swing);
    axis(twist,
         {joint.lower_twist, joint.upper_twist, joint.limit_frequency, joint.limit_damping_ratio},
         joint.twist);
    axis(swing, {std::nullopt, joint.swing_limit, joint.limit_frequency, joint.limit_damping_ratio},
         {});
  }
  void operator()(const SixDofJoint& joint) {
    common(joint, joint.anchor);
    check_rotation("frame", joint.frame);
    frame(joint.frame.normalized());
    for (std::size_t i = 0; i < joint.axes.size(); ++i) {
      const auto c = static_cast<JointCoordinate>(i);
      const JointAxis& given = joint.axes[i];
      const std::string field = "axes[" + std::to_string(i) + "]";
      check_limits(field + ".limits", c, given.limits);
      check_drive(field + ".drive", given.drive);
      if (given.mode == JointAxisMode::locked) {
        lock({c});
      } else {
        axis(c, given.mode == JointAxisMode::limited ? given.limits : JointLimits{}, given.drive);
      }
    }
  }

 private:
  template <class Desc>
  void common(const Desc& joint, const Vec3& anchor) {
    check_bodies(joint.a, joint.b);
    check_position("anchor", anchor);
    check_most("breaks.force", joint.breaks.force);
    check_most("breaks.torque", joint.breaks.torque);
    row.a = joint.a == BodyId{} ? core::kNone : joint.a.index;
    row.b = joint.b == BodyId{} ? core::kNone : joint.b.index;
    row.collide = joint.collide;
    row.breaks = joint.breaks;
    row.anchor_a = point_in(row.a, anchor);
    row.anchor_b = point_in(row.b, anchor);
  }

  void check_bodies(BodyId a, BodyId b) const {
    if (a != BodyId{}) require(world_, a);
    if (b != BodyId{}) require(world_, b);
    if (a == b) {
      throw InputError("b", "b: a joint needs two different bodies, got the same one twice");
    }
    const auto can_move = [&](BodyId body) {
      return body != BodyId{} && world_.bodies.is(body.index, core::kDynamic);
    };
    if (!can_move(a) && !can_move(b)) {
      throw InputError("a", "a: a joint needs at least one dynamic body");
    }
  }

  // A point in the axes of a body, from its centre of mass.
  Vec3 point_in(core::BodyIndex body, const Vec3& point) const {
    if (body == core::kNone) return point;
    const core::BodyPose& pose = world_.bodies.pose[body];
    return pose.orientation.conjugate() * (point - pose.center);
  }
  // The same joint frame (world) in both bodies.
  void frame(const Quat& frame) {
    const auto in = [&](core::BodyIndex body) -> Quat {
      if (body == core::kNone) return frame;
      return (world_.bodies.pose[body].orientation.conjugate() * frame).normalized();
    };
    row.frame_a = in(row.a);
    row.frame_b = in(row.b);
  }
  // The rotation that turns +z to the axis.
  static Quat about(const Vec3& axis) {
    check_unit("axis", axis);
    return Quat::FromTwoVectors(Vec3::UnitZ(), axis.normalized());
  }

  void lock(std::initializer_list<JointCoordinate> coordinates) {
    for (const JointCoordinate c : coordinates) row.locks[row.lock_count++] = c;
  }
  void axis(JointCoordinate coordinate, const JointLimits& limits, const JointDrive& drive) {
    DrivenAxis axis;
    axis.coordinate = coordinate;
    axis.limits = limits;
    axis.drive = drive;
    row.axes.push_back(axis);
  }

  const WorldData& world_;
};

}  // namespace

Joint make_joint(const WorldData& world, const JointDesc& desc) {
  JointMaker maker(world);
  std::visit(maker, desc);
  return std::move(maker.row);
}

void check_limits(const std::string& field, JointCoordinate coordinate, const JointLimits& limits) {
  check_bounds(field + ".lower", field + ".upper", limits.lower, limits.upper);
  check_frequency(field + ".frequency", limits.frequency);
  check_coefficient(field + ".damping_ratio", limits.damping_ratio);
  const bool turns = coordinate == twist;
  const bool swings = coordinate == swing_x || coordinate == swing_y;
  const bool positive = coordinate == distance || coordinate == swing;
  if (turns || swings || coordinate == swing) {
    const double most = turns ? 2 * kPi : kPi;
    check_within(field + ".lower", limits.lower, positive ? 0 : -most, most);
    check_within(field + ".upper", limits.upper, positive ? 0 : -most, most);
  } else if (positive) {
    if (limits.lower) check_not_negative(field + ".lower", *limits.lower);
    if (limits.upper) check_not_negative(field + ".upper", *limits.upper);
  }
}

void check_drive(const std::string& field, const JointDrive& drive) {
  check_frequency(field + ".spring.frequency", drive.spring.frequency);
  check_coefficient(field + ".spring.damping_ratio", drive.spring.damping_ratio);
  check_finite(field + ".spring.rest", drive.spring.rest);
  check_finite(field + ".motor.target", drive.motor.target);
  check_most(field + ".motor.max_force", drive.motor.max_force);
  check_frequency(field + ".motor.frequency", drive.motor.frequency);
  check_coefficient(field + ".motor.damping_ratio", drive.motor.damping_ratio);
  check_most(field + ".friction", drive.friction);
}

}  // namespace skerry::pipeline
