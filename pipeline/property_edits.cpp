#include "pipeline/property_edits.h"

#include "core/rounding.h"
#include "pipeline/body_edits.h"
#include "pipeline/edge_checks.h"
#include "pipeline/publish.h"
#include "pipeline/world_data.h"

namespace skerry::pipeline {
namespace {

using core::BodyIndex;
using core::Collider;
using core::ColliderIndex;
using core::kNone;

ColliderIndex find_shape(const WorldData& world, BodyId body, std::uint32_t shape) {
  require(world, body);
  ColliderIndex c = world.bodies.first_collider[body.index];
  while (c != kNone && world.colliders.rows[c].shape_in_body != shape)
    c = world.colliders.rows[c].next_in_body;
  if (c != kNone) return c;
  throw InputError("shape", "shape: body " + std::to_string(body.index) + " has no shape " +
                                std::to_string(shape));
}

// What a body may become by its shapes and mass.
void check_type(const WorldData& world, BodyIndex body, BodyType type) {
  check_body_type(type);
  if (type != BodyType::dynamic) return;
  for (ColliderIndex c = world.bodies.first_collider[body]; c != kNone;
       c = world.colliders.rows[c].next_in_body) {
    const core::ShapeType shape = world.colliders.rows[c].type;
    if (shape == core::ShapeType::plane || shape == core::ShapeType::height_field) {
      throw InputError("type",
                       "type: a body with a plane or a height field must be fixed or kinematic");
    }
  }
  const core::DynamicTraits& traits = world.bodies.as_dynamic[body];
  check_dynamic_mass({traits.mass, Vec3::Zero(), traits.inertia}, true);
}

// The broadphase is to judge all pairs of a body anew, and queries see what it has become.
void changed(WorldData& world, BodyIndex body) {
  world.broadphase->touch(world.bodies, world.colliders, body);
  world.queries.note(body, QueryPictures::Edit::shapes);
}

}  // namespace

BodyType type_of(const WorldData& world, BodyId body) {
  require(world, body);
  if (world.bodies.is(body.index, core::kDynamic)) return BodyType::dynamic;
  return world.bodies.is(body.index, core::kKinematic) ? BodyType::kinematic : BodyType::fixed;
}

void set_type(WorldData& world, BodyId body, BodyType type) {
  if (type_of(world, body) == type) return;
  check_type(world, body.index, type);
  core::Bodies& bodies = world.bodies;
  disturb(world, body.index);
  const core::BodyMotion before = bodies.motion[body.index];
  make_type(world, body.index, type);
  const bool moves = type != BodyType::fixed;
  core::set_motion(bodies, body.index, moves ? before.linear : Vec3::Zero(),
                   moves ? before.angular : Vec3::Zero());
  bodies.force[body.index] = {};
  bodies.flags[body.index] &= ~std::uint32_t{core::kForced};
  bodies.still_time[body.index] = 0;
  refresh_kinematic_awake(world, body.index);
  core::disturb(bodies, body.index);
  changed(world, body.index);
}

const Collider& shape_of(const WorldData& world, BodyId body, std::uint32_t shape) {
  return world.colliders.rows[find_shape(world, body, shape)];
}

void set_filter(WorldData& world, BodyId body, std::uint32_t shape, const Filter& filter) {
  const ColliderIndex row = find_shape(world, body, shape);
  disturb(world, body.index);
  world.colliders.rows[row].filter = filter;
  changed(world, body.index);
}

void set_material(WorldData& world, BodyId body, std::uint32_t shape, const Material& material) {
  const ColliderIndex row = find_shape(world, body, shape);
  check_material("material.", material);
  disturb(world, body.index);
  Collider& collider = world.colliders.rows[row];
  collider.friction = core::rounded_to_float(material.friction);
  collider.restitution = core::rounded_to_float(material.restitution);
  collider.rolling_resistance = core::rounded_to_float(material.rolling_resistance);
  for (const core::ContactPair& pair : world.contacts.pairs)
    if (pair.a == row || pair.b == row)
      core::set_materials(world.contacts, pair, world.colliders.rows[pair.a],
                          world.colliders.rows[pair.b]);
}

void set_sensor(WorldData& world, BodyId body, std::uint32_t shape, bool sensor) {
  const ColliderIndex row = find_shape(world, body, shape);
  if (world.colliders.rows[row].sensor == sensor) return;
  disturb(world, body.index);
  // Its pairs end as what they were, and begin as what they are now.
  collision::drop_pairs_of(world.contacts, row);
  collect_end_events(world, world.pending_end_events);
  world.colliders.rows[row].sensor = sensor;
  set_radii(world, body.index);
  changed(world, body.index);
}

void set_gravity(WorldData& world, const Vec3& gravity) {
  check_rate("gravity", gravity);
  world.settings.gravity = gravity;
  wake_all(world);
}

}  // namespace skerry::pipeline
