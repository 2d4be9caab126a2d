#include "pipeline/joint_edits.h"

#include <algorithm>
#include <cmath>

#include "pipeline/body_edits.h"
#include "pipeline/edge_checks.h"
#include "pipeline/joint_rows.h"
#include "pipeline/world_data.h"

namespace skerry::pipeline {
namespace {

using core::BodyIndex;
using core::Joint;
using core::kNone;

// Whether the two bodies of a joint collide is for the broadphase, which sees the change by itself.
void allow_collisions(WorldData& world, const Joint& joint, bool allow) {
  if (joint.a == kNone || joint.b == kNone) return;
  auto& keys = world.joints.no_collide;
  const std::uint64_t key =
      (std::uint64_t{std::min(joint.a, joint.b)} << 32) | std::max(joint.a, joint.b);
  const auto at = std::lower_bound(keys.begin(), keys.end(), key);
  if (allow) {
    keys.erase(at);
  } else {
    keys.insert(at, key);
  }
}

// Counts a joint among those of its bodies, or no more.
void count_locks(WorldData& world, const Joint& joint, bool there) {
  if (joint.lock_count == 0) return;
  for (const BodyIndex body : {joint.a, joint.b}) {
    if (body == kNone) continue;
    std::uint32_t& count = world.bodies.lock_joints[body];
    count = there ? count + 1 : count - 1;
  }
}

void wake_bodies(WorldData& world, const Joint& joint) {
  for (const BodyIndex body : {joint.a, joint.b}) {
    if (body != kNone) wake(world, body);
  }
}

std::uint32_t take_row(core::Joints& joints) {
  if (!joints.free_rows.empty()) {
    const std::uint32_t row = joints.free_rows.back();
    joints.free_rows.pop_back();
    return row;
  }
  joints.rows.emplace_back();
  return static_cast<std::uint32_t>(joints.rows.size() - 1);
}

bool breakable(const Joint& joint) {
  return std::isfinite(joint.breaks.force) || std::isfinite(joint.breaks.torque);
}

void remove_row(WorldData& world, std::uint32_t row) {
  Joint& joint = world.joints.rows[row];
  wake_bodies(world, joint);
  count_locks(world, joint, false);
  if (!joint.collide) allow_collisions(world, joint, true);
  if (breakable(joint)) --world.joints.breakable;
  const std::uint32_t generation = joint.generation + 1;
  joint = {};
  joint.generation = generation;
  auto& free_rows = world.joints.free_rows;
  free_rows.insert(std::lower_bound(free_rows.begin(), free_rows.end(), row, std::greater<>()),
                   row);
}

// The axis of a coordinate, for changes.
core::DrivenAxis& axis_of(WorldData& world, JointId id, JointCoordinate coordinate) {
  require(world, id);
  for (core::DrivenAxis& axis : world.joints.rows[id.index].axes) {
    if (axis.coordinate == coordinate) return axis;
  }
  throw UsageError("joint " + std::to_string(id.index) + " does not move along " +
                   to_string(coordinate));
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
  Joint joint = make_joint(world, desc);
  const std::uint32_t row = take_row(world.joints);
  joint.alive = true;
  joint.generation = world.joints.rows[row].generation;
  world.joints.rows[row] = joint;
  wake_bodies(world, joint);
  count_locks(world, joint, true);
  if (!joint.collide) allow_collisions(world, joint, false);
  if (breakable(joint)) ++world.joints.breakable;
  return {row, joint.generation};
}

void remove_joint(WorldData& world, JointId id) {
  require(world, id);
  remove_row(world, id.index);
}

void set_joint_limits(WorldData& world, JointId id, JointCoordinate coordinate,
                      const JointLimits& limits) {
  core::DrivenAxis& axis = axis_of(world, id, coordinate);
  check_limits("limits", coordinate, limits);
  axis.limits = limits;
  wake_bodies(world, world.joints.rows[id.index]);
}

void set_joint_drive(WorldData& world, JointId id, JointCoordinate coordinate,
                     const JointDrive& drive) {
  core::DrivenAxis& axis = axis_of(world, id, coordinate);
  check_drive("drive", drive);
  axis.drive = drive;
  wake_bodies(world, world.joints.rows[id.index]);
}

void take_broken_joints(WorldData& world) {
  world.broken.clear();
  if (world.joints.breakable == 0) return;
  for (const std::uint32_t row : world.islands.joints) {
    const Joint& joint = world.joints.rows[row];
    if (!joint.broken) continue;
    const auto id_of = [&](BodyIndex body) {
      return body == kNone ? BodyId{} : world.bodies.id(body);
    };
    world.broken.push_back(
        {{row, joint.generation}, id_of(joint.a), id_of(joint.b), joint.force, joint.torque});
  }
  std::sort(world.broken.begin(), world.broken.end(),
            [](const auto& a, const auto& b) { return a.joint < b.joint; });
  for (const JointBroken& broken : world.broken) remove_row(world, broken.joint.index);
}

const char* to_string(JointCoordinate coordinate) {
  switch (coordinate) {
    case JointCoordinate::x:
      return "x";
    case JointCoordinate::y:
      return "y";
    case JointCoordinate::z:
      return "z";
    case JointCoordinate::swing_x:
      return "swing_x";
    case JointCoordinate::swing_y:
      return "swing_y";
    case JointCoordinate::twist:
      return "twist";
    case JointCoordinate::distance:
      return "distance";
    default:
      return "swing";
  }
}

}  // namespace skerry::pipeline
