// What happened between shapes during a step, in a deterministic order; see docs/events.md.
#pragma once

#include <cstdint>

#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry {

// Of a pair of shapes. Every begin has its end: when the shapes part, and also when a body is removed
// or set aside, asleep or not, or when a filter, a sensor flag, a body's type or a joint forbids the
// pair.
enum class ContactEventKind : std::uint8_t {
  begin,    // they press on each other or overlap, and did not before
  persist,  // they still do; needs WorldSettings::persist_events
  end,      // they are farther apart than contacts foresee (5 mm), or do not meet any more
  hit,      // they pressed after an approach faster than WorldSettings::hit_speed
};

// Events of a step are ordered by a, then b (index, then generation), then shapes, and those of one
// pair as end, begin, persist, hit: the same list in every mode, for any number of workers.
struct ContactEvent {
  ContactEventKind kind = ContactEventKind::begin;
  bool sensor = false;                     // one of the shapes is a sensor: nothing was pushed
  BodyId a, b;                             // a.index < b.index; an end may name a body that is gone
  std::uint32_t shape_a = 0, shape_b = 0;  // position in BodyDesc::shapes
  Vec3 point = Vec3::Zero();               // m, world: mean of the contact points; zero for end
  Vec3 normal = Vec3::Zero();              // unit, from a to b; zero for end and sensors
  double impulse = 0;                      // N s along the normals, summed over points and step
  double approach_speed = 0;  // m/s along the normal at the start of the step, of the fastest point
};

}  // namespace skerry
