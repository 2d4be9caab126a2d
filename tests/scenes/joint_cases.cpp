#include "tests/scenes/cases.h"

namespace skerry::test {
namespace {

// Two balls "a" and "b", and one joint whose members stand on line 4.
std::string joint(const std::string& members) {
  return scene_with(R"("bodies": [ { "name": "a", "shapes": [{ "type": "sphere", "radius": 1 }] },
{ "name": "b", "position": [3, 0, 0], "shapes": [{ "type": "sphere", "radius": 1 }] } ],
"joints": [ { )" + members +
                    " } ]");
}
std::string typed(const std::string& type, const std::string& more) {
  return joint(R"("type": ")" + type + R"(", "a": "a", "b": "b", )" + more);
}
std::string hinge(const std::string& more) {
  return typed("hinge", R"("anchor": [0, 0, 0], "axis": [0, 1, 0], )" + more);
}
std::string slider(const std::string& more) {
  return typed("slider", R"("anchor": [0, 0, 0], "axis": [0, 1, 0], )" + more);
}
std::string cone(const std::string& more) {
  return typed("cone_twist", R"("anchor": [0, 0, 0], "axis": [0, 1, 0], )" + more);
}
std::string six(const std::string& more) {
  return typed("six_dof", R"("anchor": [0, 0, 0], )" + more);
}

constexpr const char* kTypes =
    ":4: joints[0].type: must be one of ball, hinge, slider, fixed, distance, cone_twist, "
    "six_dof, ";

std::vector<WrongScene> wrong_bodies_and_frames() {
  static const std::string kSlip =
      std::string(kTypes) + "got \"slyder\" (did you mean \"slider\"?)";
  return {
      {"joint_type", typed("slyder", R"("anchor": [0, 0, 0])"), kSlip.c_str(), true},
      {"joint_without_type", joint(R"("a": "a", "anchor": [0, 0, 0])"),
       ":4: joints[0]: \"type\" is missing", true},
      {"joint_body", joint(R"("type": "ball", "a": "a", "b": "bb", "anchor": [0, 0, 0])"),
       ":4: joints[0].b: unknown body \"bb\" (did you mean \"b\"?)", false},
      {"joint_to_itself", joint(R"("type": "ball", "a": "a", "b": "a", "anchor": [0, 0, 0])"),
       ":4: joints[0].b: joins the body to itself", false},
      {"joint_of_nothing", joint(R"("type": "fixed", "anchor": [0, 0, 0])"),
       ":4: joints[0]: needs \"a\" or \"b\"; what is left out is the world", false},
      {"joint_without_anchor", typed("distance", R"("anchor_a": [0, 0, 0])"),
       ":4: joints[0]: \"anchor_b\" is missing", true},
      {"joint_anchor_nan", typed("ball", R"("anchor": [0, NaN, 0])"),
       ":4: not valid JSON: syntax error while parsing value - invalid literal; last read: "
       "'0, N'",
       false},
      {"joint_anchor_infinite", typed("fixed", R"("anchor": [0, -1e999, 0])"),
       ":4: joints[0].anchor[1]: must be a finite number, got -1e999", false},
      {"joint_axis_zero", typed("slider", R"("anchor": [0, 0, 0], "axis": [0, 0, 0])"),
       ":4: joints[0].axis: must not be of length 0", false},
      {"joint_axis_short", typed("cone_twist", R"("anchor": [0, 0, 0], "axis": [0, 1])"),
       ":4: joints[0].axis: must be a list of three numbers, got a list of 2", true},
      {"joint_frame", six(R"("orientation": [0, 0, 0, 0.5])"),
       ":4: joints[0].orientation: must be a unit quaternion, got length 0.5", false},
      {"joint_field_of_another_type", typed("ball", R"("anchor": [0, 0, 0], "axis": [0, 1, 0])"),
       ":4: joints[0].axis: unknown field", true},
      {"joint_collide", hinge(R"("collide": 1)"),
       ":4: joints[0].collide: must be true or false, got 1", true},
      {"joint_of_fixed_bodies",
       scene_with(R"("bodies": [ { "name": "a", "type": "fixed", )"
                  R"("shapes": [{ "type": "sphere", "radius": 1 }] } ],)"
                  "\n"
                  R"("joints": [ { "type": "ball", "a": "a", "anchor": [0, 0, 0] } ])"),
       ":3: joints[0].a: a joint needs at least one dynamic body", false},
  };
}

std::vector<WrongScene> wrong_limits() {
  return {
      {"joint_limits", hinge(R"("limits_degrees": [30, -30])"),
       ":4: joints[0].limits_degrees: the lower limit 30 is above the upper -30", false},
      {"joint_limits_one", hinge(R"("limits_degrees": [30])"),
       ":4: joints[0].limits_degrees: must be a list of two numbers (null: no bound), got a list "
       "of 1",
       true},
      {"joint_limits_degrees", hinge(R"("limits_degrees": [null, 400])"),
       ":4: joints[0].limits_degrees[1]: must be between -360 and 360, got 400", true},
      {"joint_limits_text", slider(R"("limits": ["low", 1])"),
       ":4: joints[0].limits[0]: must be a number, got \"low\"", true},
      {"slider_limits", slider(R"("limits": [0.5, 0.25])"),
       ":4: joints[0].limits: the lower limit 0.5 is above the upper 0.25", false},
      {"slider_limits_in_degrees", slider(R"("limits_degrees": [0, 1])"),
       ":4: joints[0].limits_degrees: unknown field", true},
      {"rope_of_negative_length",
       typed("distance", R"("anchor_a": [0, 0, 0], "anchor_b": [1, 0, 0], "limits": [null, -1])"),
       ":4: joints[0].limits[1]: must be zero or more, got -1", true},
      {"limit_frequency", slider(R"("limits": [0, 1], "limit_frequency": -2)"),
       ":4: joints[0].limit_frequency: must be zero or more, got -2", true},
      {"limit_damping", cone(R"("limit_damping_ratio": -0.1)"),
       ":4: joints[0].limit_damping_ratio: must be zero or more, got -0.1", true},
      {"cone_limit", cone(R"("swing_limit_degrees": 181)"),
       ":4: joints[0].swing_limit_degrees: must be between 0 and 180, got 181", true},
      {"cone_twist", cone(R"("twist_limits_degrees": [10, 0])"),
       ":4: joints[0].twist_limits_degrees: the lower limit 10 is above the upper 0", false},
      {"six_mode", six(R"("axes": { "x": "fre" })"),
       ":4: joints[0].axes.x: must be one of free, locked, got \"fre\" (did you mean \"free\"?)",
       true},
      {"six_mode_type", six(R"("axes": { "x": true })"),
       ":4: joints[0].axes.x: must be \"free\", \"locked\" or an object, got true", true},
      {"six_axis", six(R"("axes": { "swing_z": "free" })"),
       ":4: joints[0].axes.swing_z: unknown field (did you mean \"swing_x\"?)", true},
      {"six_swing", six(R"("axes": { "swing_x": { "limits_degrees": [-200, 200] } })"),
       ":4: joints[0].axes.swing_x.limits_degrees[0]: must be between -180 and 180, got -200",
       false},
      {"six_units", six(R"("axes": { "twist": { "limits": [0, 1] } })"),
       ":4: joints[0].axes.twist.limits: unknown field (did you mean \"limits_degrees\"?)", true},
  };
}

std::vector<WrongScene> wrong_drives_and_loads() {
  return {
      {"spring_frequency", hinge(R"("spring": { "frequency": -1 })"),
       ":4: joints[0].spring.frequency: must be positive, got -1", true},
      {"spring_without_frequency", slider(R"("spring": { "rest": 1 })"),
       ":4: joints[0].spring: \"frequency\" is missing", true},
      {"spring_damping", slider(R"("spring": { "frequency": 1, "damping_ratio": -1 })"),
       ":4: joints[0].spring.damping_ratio: must be zero or more, got -1", true},
      {"spring_rest", hinge(R"("spring": { "frequency": 1, "rest_degrees": 500 })"),
       ":4: joints[0].spring.rest_degrees: must be between -360 and 360, got 500", true},
      {"spring_units", slider(R"("spring": { "frequency": 1, "rest_degrees": 5 })"),
       ":4: joints[0].spring.rest_degrees: unknown field", true},
      {"motor_without_aim", hinge(R"("motor": { "max_torque": 3 })"),
       ":4: joints[0].motor: needs either \"speed\" or \"target_degrees\"", false},
      {"motor_with_two_aims", slider(R"("motor": { "speed": 1, "target": 3 })"),
       ":4: joints[0].motor: needs either \"speed\" or \"target\"", false},
      {"motor_force", slider(R"("motor": { "speed": 1, "max_force": -3 })"),
       ":4: joints[0].motor.max_force: must be zero or more, got -3", true},
      {"motor_frequency", hinge(R"("motor": { "target_degrees": 1, "frequency": -3 })"),
       ":4: joints[0].motor.frequency: must be zero or more, got -3", true},
      {"motor_frequency_of_speed", hinge(R"("motor": { "speed": 1, "frequency": 3 })"),
       ":4: joints[0].motor.frequency: a motor with a \"speed\" has none", false},
      {"ball_friction", typed("ball", R"("anchor": [0, 0, 0], "friction_torque": -1)"),
       ":4: joints[0].friction_torque: must be zero or more, got -1", true},
      {"slider_friction", slider(R"("friction_force": -1)"),
       ":4: joints[0].friction_force: must be zero or more, got -1", true},
      {"cone_drive", cone(R"("swing": { "frequency": 1 })"),
       ":4: joints[0].swing.frequency: unknown field", true},
      {"breaking_force", hinge(R"("breaks": { "force": -5 })"),
       ":4: joints[0].breaks.force: must be zero or more, got -5", true},
      {"breaking_torque", hinge(R"("breaks": { "torque": "a lot" })"),
       ":4: joints[0].breaks.torque: must be a number, got \"a lot\"", true},
  };
}

}  // namespace

std::vector<WrongScene> wrong_joints() {
  std::vector<WrongScene> all = wrong_bodies_and_frames();
  for (const auto& more : {wrong_limits(), wrong_drives_and_loads()}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

}  // namespace skerry::test
