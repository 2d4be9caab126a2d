// From what users say of a joint to its row: which coordinates are locked, which are axes. Throws
// InputError or UsageError.
#pragma once

#include <string>

#include <skerry/joints.h>

#include "core/joints_data.h"

namespace skerry::pipeline {

struct WorldData;

core::Joint make_joint(const WorldData& world, const JointDesc& desc);

// Angles reach a whole turn at most, a swing half of one; a distance or swing is never negative.
void check_limits(const std::string& field, JointCoordinate coordinate, const JointLimits& limits);
void check_drive(const std::string& field, const JointDrive& drive);

}  // namespace skerry::pipeline
