// Forces as functions of time, position and velocity: F(t, r, v).
#pragma once

#include <functional>

#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry {

// What a force field is asked about: a dynamic body at an instant of the step (integrators of
// higher order ask at several instants).
struct FieldSample {
  BodyId body;
  double time = 0;                       // s since the world began
  Vec3 position = Vec3::Zero();          // m, centre of mass, world
  Vec3 velocity = Vec3::Zero();          // m/s
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world
  double mass = 0;                       // kg
};
struct FieldForce {
  Vec3 force = Vec3::Zero();   // N, at the centre of mass
  Vec3 torque = Vec3::Zero();  // N m, world
};

// Called from worker threads, for several bodies at once, in no particular order: it must be a pure
// function of its sample. If it throws, that body feels no field this step and the exception leaves
// World::step() after the step has finished; of several, the one of the lowest body id.
using ForceField = std::function<FieldForce(const FieldSample&)>;

}  // namespace skerry
