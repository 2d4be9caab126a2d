// What happened between shapes during a step, in a deterministic order: by body ids, then shapes.
#pragma once

#include <cstdint>

#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry {

enum class ContactEventKind : std::uint8_t { begin, persist, end };

struct ContactEvent {
  ContactEventKind kind = ContactEventKind::begin;
  bool sensor = false;
  BodyId a, b;                             // a.index < b.index
  std::uint32_t shape_a = 0, shape_b = 0;  // position in BodyDesc::shapes
  Vec3 point = Vec3::Zero();               // m, world: mean of the contact points; zero for end
  Vec3 normal = Vec3::Zero();              // unit, from a to b; zero for end and sensors
  double impulse = 0;                      // N s along the normal, summed over the step
  double approach_speed = 0;               // m/s along the normal at the start of the step
};

}  // namespace skerry
