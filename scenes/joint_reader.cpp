#include "scenes/joint_reader.h"

#include "scenes/json_values.h"
#include "scenes/rigid_maths.h"
#include "scenes/scene_format.h"

namespace skerry::scenes {
namespace {

double degrees_within(const JsonNode& node, double low, double high) {
  return read_within(node, low, high) * kRadiansPerDegree;
}

void set_not_negative(const JsonNode& node, std::string_view field, double& value) {
  if_given(node, field, [&](const JsonNode& n) { value = read_not_negative(n); });
}

// -- What happens along a coordinate ----------------------------------------------------------------

// How a coordinate is written: its fields, specs and units.
struct Unit {
  std::string_view limits, rest, target, most, friction, spring_spec, motor_spec;
  bool angular;
};
constexpr Unit kLinear = {"limits",         "rest",          "target",       "max_force",
                          "friction_force", "linear_spring", "linear_motor", false};
constexpr Unit kAngular = {"limits_degrees",  "rest_degrees",   "target_degrees", "max_torque",
                           "friction_torque", "angular_spring", "angular_motor",  true};

double read_place(const JsonNode& node, const Unit& unit) {
  return unit.angular ? degrees_within(node, -360, 360) : read_number(node);
}

// A pair of bounds, null where there is none; `read` gives the number in m or rad.
template <class Read>
void read_bounds(const JsonNode& node, std::optional<double>& lower, std::optional<double>& upper,
                 Read&& read) {
  if (node.kind != JsonKind::array || node.children.size() != 2) {
    node.refuse("a list of two numbers (null: no bound)");
  }
  const JsonNode &low = *node.children[0], &high = *node.children[1];
  if (low.kind != JsonKind::null) lower = read(low);
  if (high.kind != JsonKind::null) upper = read(high);
  if (lower && upper && *lower > *upper) {
    node.fail("the lower limit " + low.shown() + " is above the upper " + high.shown());
  }
}

void read_softness(const JsonNode& node, double& frequency, double& damping_ratio) {
  set_not_negative(node, "limit_frequency", frequency);
  set_not_negative(node, "limit_damping_ratio", damping_ratio);
}

// Limits of a length: no lower than `least`.
JointLimits read_linear_limits(const JsonNode& node, bool signed_length) {
  JointLimits limits;
  if_given(node, kLinear.limits, [&](const JsonNode& n) {
    read_bounds(n, limits.lower, limits.upper, signed_length ? read_number : read_not_negative);
  });
  read_softness(node, limits.frequency, limits.damping_ratio);
  return limits;
}

JointLimits read_angular_limits(const JsonNode& node, std::string_view field, double most) {
  JointLimits limits;
  if_given(node, field, [&](const JsonNode& n) {
    read_bounds(n, limits.lower, limits.upper,
                [most](const JsonNode& bound) { return degrees_within(bound, -most, most); });
  });
  read_softness(node, limits.frequency, limits.damping_ratio);
  return limits;
}

JointSpring read_spring(const JsonNode& node, const Unit& unit) {
  check_object(node, unit.spring_spec);
  JointSpring spring = {.frequency = read_positive(*node.find("frequency"))};
  set_not_negative(node, "damping_ratio", spring.damping_ratio);
  if_given(node, unit.rest, [&](const JsonNode& n) { spring.rest = read_place(n, unit); });
  return spring;
}

JointMotor read_motor(const JsonNode& node, const Unit& unit) {
  check_object(node, unit.motor_spec);
  const JsonNode *speed = node.find("speed"), *target = node.find(unit.target);
  if (!speed == !target) {
    node.fail(std::string("needs either \"speed\" or \"").append(unit.target).append("\""));
  }
  JointMotor motor;
  motor.mode = speed ? JointMotorMode::velocity : JointMotorMode::position;
  motor.target = speed ? read_number(*speed) : read_place(*target, unit);
  set_not_negative(node, unit.most, motor.max_force);
  for (const auto& [field, value] : {std::pair{"frequency", &motor.frequency},
                                     std::pair{"damping_ratio", &motor.damping_ratio}}) {
    if_given(node, field, [&, to = value](const JsonNode& n) {
      if (speed) n.fail("a motor with a \"speed\" has none");
      *to = read_not_negative(n);
    });
  }
  return motor;
}

JointDrive read_drive(const JsonNode& node, const Unit& unit) {
  JointDrive drive;
  if_given(node, "spring", [&](const JsonNode& n) { drive.spring = read_spring(n, unit); });
  if_given(node, "motor", [&](const JsonNode& n) { drive.motor = read_motor(n, unit); });
  set_not_negative(node, unit.friction, drive.friction);
  return drive;
}

// "swing" and "twist" of a cone-twist joint.
JointDrive read_named_drive(const JsonNode& node, std::string_view field) {
  JointDrive drive;
  if_given(node, field, [&](const JsonNode& n) {
    check_object(n, "angular_drive");
    drive = read_drive(n, kAngular);
  });
  return drive;
}

// -- Types ------------------------------------------------------------------------------------------

Vec3 read_point(const JsonNode& node, std::string_view field, const Pose& frame) {
  return transformed(frame, read_vec3(*node.find(field)));
}
Vec3 read_axis(const JsonNode& node, const Pose& frame) {
  return rotated(frame.orientation, read_direction(*node.find("axis")));
}

JointDesc read_ball(const JsonNode& node, const Pose& frame) {
  BallJoint joint = {.anchor = read_point(node, "anchor", frame)};
  set_not_negative(node, "friction_torque", joint.friction_torque);
  return joint;
}

JointDesc read_hinge(const JsonNode& node, const Pose& frame) {
  HingeJoint joint = {.anchor = read_point(node, "anchor", frame), .axis = read_axis(node, frame)};
  const JointLimits limits = read_angular_limits(node, kAngular.limits, 360);
  joint.lower_angle = limits.lower;
  joint.upper_angle = limits.upper;
  joint.limit_frequency = limits.frequency;
  joint.limit_damping_ratio = limits.damping_ratio;
  joint.drive = read_drive(node, kAngular);
  return joint;
}

JointDesc read_slider(const JsonNode& node, const Pose& frame) {
  return SliderJoint{.anchor = read_point(node, "anchor", frame),
                     .axis = read_axis(node, frame),
                     .limits = read_linear_limits(node, true),
                     .drive = read_drive(node, kLinear)};
}

JointDesc read_fixed(const JsonNode& node, const Pose& frame) {
  return FixedJoint{.anchor = read_point(node, "anchor", frame)};
}

JointDesc read_distance(const JsonNode& node, const Pose& frame) {
  return DistanceJoint{.anchor_a = read_point(node, "anchor_a", frame),
                       .anchor_b = read_point(node, "anchor_b", frame),
                       .limits = read_linear_limits(node, false),
                       .drive = read_drive(node, kLinear)};
}

JointDesc read_cone_twist(const JsonNode& node, const Pose& frame) {
  ConeTwistJoint joint = {.anchor = read_point(node, "anchor", frame),
                          .axis = read_axis(node, frame)};
  if_given(node, "swing_limit_degrees",
           [&](const JsonNode& n) { joint.swing_limit = degrees_within(n, 0, 180); });
  const JointLimits twist = read_angular_limits(node, "twist_limits_degrees", 360);
  joint.lower_twist = twist.lower;
  joint.upper_twist = twist.upper;
  joint.limit_frequency = twist.frequency;
  joint.limit_damping_ratio = twist.damping_ratio;
  joint.swing = read_named_drive(node, "swing");
  joint.twist = read_named_drive(node, "twist");
  return joint;
}

// "free", "locked" or an object.
JointAxis read_axis_of_six(const JsonNode& node, bool angular, double most_degrees) {
  JointAxis axis;
  if (node.kind == JsonKind::string) {
    constexpr std::string_view kModes[] = {"free", "locked"};
    axis.mode = read_choice(node, kModes) == 0 ? JointAxisMode::free : JointAxisMode::locked;
    return axis;
  }
  if (node.kind != JsonKind::object) node.refuse("\"free\", \"locked\" or an object");
  const Unit& unit = angular ? kAngular : kLinear;
  check_object(node, angular ? "angular_axis" : "linear_axis");
  axis.mode = node.find(unit.limits) ? JointAxisMode::limited : JointAxisMode::free;
  axis.limits = angular ? read_angular_limits(node, unit.limits, most_degrees)
                        : read_linear_limits(node, true);
  axis.drive = read_drive(node, unit);
  return axis;
}

JointDesc read_six_dof(const JsonNode& node, const Pose& frame) {
  SixDofJoint joint = {.anchor = read_point(node, "anchor", frame), .frame = frame.orientation};
  if_given(node, "orientation", [&](const JsonNode& n) {
    joint.frame = product(frame.orientation, read_orientation(n));
  });
  if_given(node, "axes", [&](const JsonNode& axes) {
    check_object(axes, "six_axes");
    constexpr std::string_view kNames[] = {"x", "y", "z", "swing_x", "swing_y", "twist"};
    for (std::size_t i = 0; i < 6; ++i) {
      if_given(axes, kNames[i], [&](const JsonNode& n) {
        joint.axes[i] = read_axis_of_six(n, i >= 3, i == 5 ? 360 : 180);
      });
    }
  });
  return joint;
}

struct JointKind {
  std::string_view type;  // in the file, and of the ObjectSpec
  JointDesc (*read)(const JsonNode&, const Pose&);
};
constexpr JointKind kJoints[] = {
    {"ball", read_ball},       {"hinge", read_hinge},       {"slider", read_slider},
    {"fixed", read_fixed},     {"distance", read_distance}, {"cone_twist", read_cone_twist},
    {"six_dof", read_six_dof},
};

const JointKind& kind_of(const JsonNode& node) {
  if (node.kind != JsonKind::object) node.refuse("an object");
  const JsonNode* type = node.find("type");
  if (!type) node.fail("\"type\" is missing");
  std::vector<std::string_view> types;
  for (const JointKind& kind : kJoints) types.push_back(kind.type);
  return kJoints[read_choice(*type, types)];
}

JointLoad read_breaks(const JsonNode& node) {
  check_object(node, "breaks");
  JointLoad load;
  set_not_negative(node, "force", load.force);
  set_not_negative(node, "torque", load.torque);
  return load;
}

}  // namespace

JointDesc read_joint(const JsonNode& node, const Pose& frame) {
  const JointKind& kind = kind_of(node);
  check_object(node, kind.type);
  JointDesc joint = kind.read(node, frame);
  std::visit(
      [&](auto& desc) {
        if_given(node, "breaks", [&](const JsonNode& n) { desc.breaks = read_breaks(n); });
        if_given(node, "collide", [&](const JsonNode& n) { desc.collide = read_bool(n); });
      },
      joint);
  return joint;
}

}  // namespace skerry::scenes
