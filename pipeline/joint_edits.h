// Changes to a world's joints, as the public calls make them. Arguments are checked here (InputError,
// UsageError; the world is then unchanged).
#pragma once

#include <skerry/world.h>

#include "core/joints_data.h"

namespace skerry::pipeline {

struct WorldData;

JointId add_joint(WorldData& world, const JointDesc& joint);
void remove_joint(WorldData& world, JointId joint);
void set_joint_limits(WorldData& world, JointId joint, JointCoordinate coordinate,
                      const JointLimits& limits);
void set_joint_drive(WorldData& world, JointId joint, JointCoordinate coordinate,
                     const JointDrive& drive);

// Removes the joints that gave way in this step and lists them in WorldData::broken.
void take_broken_joints(WorldData& world);

// Throws UsageError if the id is stale or was never given.
void require(const WorldData& world, JointId joint);

const char* to_string(JointCoordinate coordinate);

}  // namespace skerry::pipeline
