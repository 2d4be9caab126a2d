#include <algorithm>
#include <cmath>

#include "pipeline/body_edits.h"
#include "pipeline/edge_checks.h"
#include "pipeline/world_data.h"
#include "solver/finalise.h"

namespace skerry::pipeline {
namespace {

using core::BodyIndex;
using core::Joint;

std::uint64_t body_key(BodyIndex a, BodyIndex b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

void allow_collisions(WorldData& world, const Joint& joint, bool allow) {
  auto& keys = world.joints.no_collide;
  const std::uint64_t key = body_key(joint.a, joint.b);
  const auto at = std::lower_bound(keys.begin(), keys.end(), key);
  if (allow) {
    keys.erase(at);
  } else {
    keys.insert(at, key);
  }
  // Their pairs are judged anew in the next step.
  for (const BodyIndex body : {joint.a, joint.b}) touch_all_colliders(world, body);
}

// The point, in the axes of a body and from its centre of mass.
Vec3 anchor_in(const WorldData& world, BodyIndex body, const Vec3& point) {
  const core::BodyPose& pose = world.bodies.pose[body];
  return pose.orientation.conjugate() * (point - pose.center);
}

// The rotation that turns +z to the axis, in the body's axes.
Quat frame_in(const WorldData& world, BodyIndex body, const Vec3& axis) {
  const Quat turn = Quat::FromTwoVectors(Vec3::UnitZ(), axis);
  return (world.bodies.pose[body].orientation.conjugate() * turn).normalized();
}

void check_bodies(const WorldData& world, BodyId a, BodyId b) {
  require(world, a);
  require(world, b);
  if (a == b)
    throw InputError("b", "b: a joint needs two different bodies, got the same one twice");
  if (!world.bodies.is(a.index, core::kDynamic) && !world.bodies.is(b.index, core::kDynamic)) {
    throw InputError("a", "a: a joint needs at least one dynamic body");
  }
}

struct JointBuilder {
  const WorldData& world;
  Joint& out;

  void anchor(BodyId a, BodyId b, const Vec3& point, bool collide) const {
    check_bodies(world, a, b);
    check_finite("anchor", point);
    out.a = a.index;
    out.b = b.index;
    out.collide = collide;
    out.anchor_a = anchor_in(world, a.index, point);
    out.anchor_b = anchor_in(world, b.index, point);
  }
  void operator()(const BallJoint& joint) const {
    out.type = core::JointType::ball;
    anchor(joint.a, joint.b, joint.anchor, joint.collide);
  }
  void operator()(const HingeJoint& joint) const {
    out.type = core::JointType::hinge;
    anchor(joint.a, joint.b, joint.anchor, joint.collide);
    check_unit("axis", joint.axis);
    const Vec3 axis = joint.axis.normalized();
    out.frame_a = frame_in(world, joint.a.index, axis);
    out.frame_b = frame_in(world, joint.b.index, axis);
    limits(joint);
    check_finite("motor_speed", joint.motor_speed);
    check_not_negative("motor_max_torque", joint.motor_max_torque);
    out.motor_speed = joint.motor_speed;
    out.motor_max_torque = joint.motor_max_torque;
  }
  void limits(const HingeJoint& joint) const {
    if (joint.lower_angle) check_finite("lower_angle", *joint.lower_angle);
    if (joint.upper_angle) check_finite("upper_angle", *joint.upper_angle);
    if (joint.lower_angle && joint.upper_angle && *joint.lower_angle > *joint.upper_angle) {
      throw InputError("lower_angle", "lower_angle: must not be above upper_angle, got " +
                                          std::to_string(*joint.lower_angle) + " above " +
                                          std::to_string(*joint.upper_angle));
    }
    out.has_lower = joint.lower_angle.has_value();
    out.has_upper = joint.upper_angle.has_value();
    out.lower = joint.lower_angle.value_or(0);
    out.upper = joint.upper_angle.value_or(0);
  }
};

std::uint32_t take_joint(core::Joints& joints) {
  if (!joints.free_rows.empty()) {
    const std::uint32_t row = joints.free_rows.back();
    joints.free_rows.pop_back();
    return row;
  }
  joints.rows.emplace_back();
  return static_cast<std::uint32_t>(joints.rows.size() - 1);
}

}  // namespace

void require(const WorldData& world, JointId joint) {
  const auto& rows = world.joints.rows;
  if (joint.index < rows.size() && rows[joint.index].alive &&
      rows[joint.index].generation == joint.generation) {
    return;
  }
  throw UsageError("joint " + std::to_string(joint.index) + " (generation " +
                   std::to_string(joint.generation) + ") is not in this world; was it removed?");
}

JointId add_joint(WorldData& world, const JointDesc& desc) {
  Joint joint;
  std::visit(JointBuilder{world, joint}, desc);
  const std::uint32_t row = take_joint(world.joints);
  joint.alive = true;
  joint.generation = world.joints.rows[row].generation;
  world.joints.rows[row] = joint;
  wake(world, joint.a);
  wake(world, joint.b);
  if (!joint.collide) allow_collisions(world, joint, false);
  return {row, joint.generation};
}

void remove_joint(WorldData& world, JointId id) {
  require(world, id);
  const Joint joint = world.joints.rows[id.index];
  wake(world, joint.a);
  wake(world, joint.b);
  if (!joint.collide) allow_collisions(world, joint, true);
  world.joints.rows[id.index] = {};
  world.joints.rows[id.index].generation = joint.generation + 1;
  auto& free_rows = world.joints.free_rows;
  free_rows.insert(std::lower_bound(free_rows.begin(), free_rows.end(), id.index, std::greater<>()),
                   id.index);
}

}  // namespace skerry::pipeline
