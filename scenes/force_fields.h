// Force fields that can be written down: data here, the engine's F(t, r, v) from make_field().
#pragma once

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include <skerry/forces.h>

namespace skerry::scenes {

// The same acceleration and force for every body.
struct UniformField {
  Vec3 acceleration = Vec3::Zero();  // m/s^2
  Vec3 force = Vec3::Zero();         // N
};
// F = -(linear + quadratic |v|) v
struct DragField {
  double linear = 0;     // N s/m
  double quadratic = 0;  // N s^2/m^2
};
// Gravitation-like pull a = strength d / (|d|^2 + softening^2)^(3/2); negative strength pushes.
struct AttractorField {
  Vec3 point = Vec3::Zero();  // m
  double strength = 0;        // m^3/s^2
  double softening = 0.1;     // m
};
// F = -stiffness r - damping v, r from the anchor.
struct SpringField {
  Vec3 anchor = Vec3::Zero();  // m
  double stiffness = 0;        // N/m
  double damping = 0;          // N s/m
};
// F = drag (w - v), with the wind w = velocity (1 + gust_amplitude sin(2 pi t / gust_period)).
struct WindField {
  Vec3 velocity = Vec3::Zero();  // m/s
  double drag = 0;               // N s/m
  double gust_amplitude = 0;
  double gust_period = 1;  // s
};

struct FieldDesc {
  std::variant<UniformField, DragField, AttractorField, SpringField, WindField> field;
  std::vector<std::uint32_t> bodies = {};  // BodyNumbers; empty: all bodies
};

// `bodies`: the ids of FieldDesc::bodies. The result is a pure function of its sample and gives the
// same bits everywhere.
ForceField make_field(const FieldDesc& field, std::span<const BodyId> bodies);

}  // namespace skerry::scenes
