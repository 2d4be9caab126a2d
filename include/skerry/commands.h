// What the game asks of a world; applied at the beginning of the next step, in the order posted.
#pragma once

#include <functional>
#include <optional>
#include <variant>

#include <skerry/body.h>
#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry {

struct Impulse {
  BodyId body;
  Vec3 impulse = Vec3::Zero();               // N s
  std::optional<Vec3> point = std::nullopt;  // m, world; none: the centre of mass
};
struct Force {  // acts for one step
  BodyId body;
  Vec3 force = Vec3::Zero();   // N, at the centre of mass
  Vec3 torque = Vec3::Zero();  // N m
};
struct SetVelocity {
  BodyId body;
  Vec3 linear = Vec3::Zero();   // m/s
  Vec3 angular = Vec3::Zero();  // rad/s
};
struct SetPose {  // teleports
  BodyId body;
  Pose pose;
};
struct Spawn {
  BodyDesc body;
  std::function<void(BodyId)> on_added = {};  // called on the simulating thread
};
struct RemoveBody {
  BodyId body;
};
// As World::set_type and those below it.
struct SetType {
  BodyId body;
  BodyType type = BodyType::dynamic;
};
struct SetFilter {
  BodyId body;
  std::uint32_t shape = 0;
  Filter filter = {};
};
struct SetMaterial {
  BodyId body;
  std::uint32_t shape = 0;
  Material material = {};
};
struct SetSensor {
  BodyId body;
  std::uint32_t shape = 0;
  bool sensor = false;
};

using Command = std::variant<Impulse, Force, SetVelocity, SetPose, Spawn, RemoveBody, SetType,
                             SetFilter, SetMaterial, SetSensor>;

}  // namespace skerry
