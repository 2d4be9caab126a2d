// Changes to what live bodies and their shapes are, as the public calls and the posted commands make
// them. Each wakes the body, who touches it and whom it meets. Arguments are checked here (InputError,
// UsageError; the world is then unchanged).
#pragma once

#include <skerry/world.h>

#include "core/colliders.h"

namespace skerry::pipeline {

struct WorldData;

BodyType type_of(const WorldData& world, BodyId body);
void set_type(WorldData& world, BodyId body, BodyType type);

// A shape of a body by its position in BodyDesc::shapes.
const core::Collider& shape_of(const WorldData& world, BodyId body, std::uint32_t shape);
void set_filter(WorldData& world, BodyId body, std::uint32_t shape, const Filter& filter);
void set_material(WorldData& world, BodyId body, std::uint32_t shape, const Material& material);
void set_sensor(WorldData& world, BodyId body, std::uint32_t shape, bool sensor);

void set_gravity(WorldData& world, const Vec3& gravity);

}  // namespace skerry::pipeline
