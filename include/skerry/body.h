// What describes a body to World::add_body.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <skerry/shapes.h>
#include <skerry/types.h>

namespace skerry {

enum class BodyType : std::uint8_t {
  dynamic,    // moved by forces and contacts
  fixed,      // never moves
  kinematic,  // moved by its velocity alone; pushes, is never pushed
};

// Overrides what the shapes' densities give.
struct MassOverride {
  double mass = 1;                             // kg
  std::optional<Vec3> center = std::nullopt;   // m, body frame; none: from the shapes
  std::optional<Mat3> inertia = std::nullopt;  // kg m^2 about the centre, body axes; none: the
                                               // shapes' inertia scaled to the mass
};

// Axes of the world along which a body may not move, or about which it may not turn (2D problems).
struct AxisLocks {
  std::array<bool, 3> translation = {false, false, false};
  std::array<bool, 3> rotation = {false, false, false};
};

// Whether a dynamic body is swept along its way in steps in which it moves farther than half the
// radius of the largest ball inside its thinnest shape. Such a step ends where the body first meets
// another one; the next step makes the impact, at the speed that the body has there. Sensors and
// kinematic bodies that are as fast themselves do not stop it. Costs nothing while it is slow.
enum class ContinuousCollision : std::uint8_t { automatic, never };

struct BodyDesc {
  BodyType type = BodyType::dynamic;
  std::vector<Shape> shapes = {};        // may be empty: then `mass` is needed for a dynamic body
  Vec3 position = Vec3::Zero();          // m, of the body frame's origin
  Quat orientation = Quat::Identity();   // unit to 1e-3; normalised on entry
  Vec3 linear_velocity = Vec3::Zero();   // m/s, of the centre of mass
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world frame
  double density = 1000;                 // kg/m^3, for shapes without their own
  double friction = 0.6;                 // material of shapes without their own
  double restitution = 0;
  double rolling_resistance = 0;
  std::optional<MassOverride> mass = std::nullopt;
  double gravity_scale = 1;
  double linear_damping = 0;   // 1/s
  double angular_damping = 0;  // 1/s
  AxisLocks locks = {};
  ContinuousCollision continuous = ContinuousCollision::automatic;
  bool allow_sleep = true;
  bool awake = true;
  std::uint64_t user_data = 0;
};

}  // namespace skerry
