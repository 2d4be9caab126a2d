// Bodies come, go and move, as the public calls and the posted commands have it.
// Arguments are checked here (InputError, UsageError; the world is then unchanged).
#pragma once

#include <skerry/world.h>

#include "core/bodies.h"

namespace skerry::pipeline {

struct WorldData;

BodyId add_body(WorldData& world, const BodyDesc& body);
void remove_body(WorldData& world, BodyId body);

void set_pose(WorldData& world, BodyId body, const Pose& pose);
void set_velocity(WorldData& world, BodyId body, const Vec3& linear, const Vec3& angular);
void move_kinematic(WorldData& world, BodyId body, const Pose& target, double dt);
void apply_force(WorldData& world, BodyId body, const Vec3& force, const Vec3& torque);
void apply_impulse(WorldData& world, BodyId body, const Vec3& impulse, const Vec3& offset);

// Throws UsageError if the id is stale or was never given.
void require(const WorldData& world, BodyId body);

// Wakes a body, with its island.
void wake(WorldData& world, core::BodyIndex body);
// Something that acts everywhere has changed.
void wake_all(WorldData& world);

// Something about a body has changed by hand: wakes it, who touches it, and whom it meets in the next
// step.
void disturb(WorldData& world, core::BodyIndex body);

// What follows from a body's other data.
void refresh_kinematic_awake(WorldData& world, core::BodyIndex body);  // moving ones are simulated
void set_radii(WorldData& world, core::BodyIndex body);                // inner and turn radius
// Flags and masses of a type; a dynamic body is awake.
void make_type(WorldData& world, core::BodyIndex body, BodyType type);

}  // namespace skerry::pipeline
