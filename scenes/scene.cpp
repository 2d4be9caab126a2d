#include "scenes/scene.h"

#include <algorithm>

namespace skerry::scenes {
namespace {

const char* list_name(BuildError::Part part) {
  switch (part) {
    case BuildError::Part::body:
      return "bodies";
    case BuildError::Part::joint:
      return "joints";
    case BuildError::Part::field:
      return "force_fields";
  }
  return "";
}

std::string place(BuildError::Part part, std::size_t number) {
  return std::string(list_name(part)) + '[' + std::to_string(number) + ']';
}

JointDesc with_ids(const SceneJoint& joint, const BuiltScene& built) {
  JointDesc result = joint.joint;
  std::visit(
      [&](auto& desc) {
        if (joint.a != kWorldFrame) desc.a = built.bodies.at(joint.a);
        if (joint.b != kWorldFrame) desc.b = built.bodies.at(joint.b);
      },
      result);
  return result;
}

void add_body(const BodyDesc& body, BuiltScene& built, World& world) {
  try {
    built.bodies.push_back(world.add_body(body));
  } catch (const InputError& error) {
    throw BuildError(BuildError::Part::body, built.bodies.size(), error);
  }
}

void add_joint(const SceneJoint& joint, BuiltScene& built, World& world) {
  try {
    built.joints.push_back(world.add_joint(with_ids(joint, built)));
  } catch (const InputError& error) {
    throw BuildError(BuildError::Part::joint, built.joints.size(), error);
  }
}

void add_field(const FieldDesc& field, BuiltScene& built, World& world) {
  std::vector<BodyId> only;
  for (const BodyNumber body : field.bodies) only.push_back(built.bodies.at(body));
  built.fields.push_back(world.add_force_field(make_field(field, only)));
}

void add_everything(const SceneDesc& scene, BuiltScene& built, World& world) {
  built.bodies.reserve(scene.bodies.size());
  built.joints.reserve(scene.joints.size());
  for (const BodyDesc& body : scene.bodies) add_body(body, built, world);
  for (const SceneJoint& joint : scene.joints) add_joint(joint, built, world);
  for (const FieldDesc& field : scene.fields) add_field(field, built, world);
}

void take_back(const BuiltScene& built, World& world) {
  for (const ForceFieldId field : built.fields) world.remove_force_field(field);
  for (const JointId joint : built.joints) world.remove_joint(joint);
  for (auto body = built.bodies.rbegin(); body != built.bodies.rend(); ++body) {
    world.remove_body(*body);
  }
}

void spawn(const SpawnEvent& event, BuiltScene& built, World& world) {
  for (const BodyDesc& body : event.bodies) add_body(body, built, world);
  for (const SceneJoint& joint : event.joints) add_joint(joint, built, world);
}

void apply(const SceneEvent& event, BuiltScene& built, World& world) {
  if (const auto* impulse = std::get_if<ImpulseEvent>(&event.action)) {
    const BodyId body = built.bodies.at(impulse->body);
    if (impulse->point) {
      world.apply_impulse_at(body, impulse->impulse, *impulse->point);
    } else {
      world.apply_impulse(body, impulse->impulse);
    }
  } else if (const auto* bodies = std::get_if<SpawnEvent>(&event.action)) {
    spawn(*bodies, built, world);
  } else if (const auto* removed = std::get_if<RemoveEvent>(&event.action)) {
    world.remove_body(built.bodies.at(removed->body));
  }
}

}  // namespace

BuildError::BuildError(Part part, std::size_t number, const InputError& cause)
    : InputError(place(part, number) + '.' + cause.field(),
                 place(part, number) + ": " + cause.what()),
      part_(part),
      number_(number),
      cause_(cause.what()) {}

WorldSettings world_settings(const SceneDesc& scene, WorldSettings base) {
  const SceneDefaults& defaults = scene.defaults;
  base.gravity = defaults.gravity;
  base.solver = defaults.solver;
  base.sleep = defaults.sleep;
  base.integrator = defaults.integrator;
  base.broadphase = defaults.broadphase;
  base.continuous = defaults.continuous;
  base.persist_events = defaults.persist_events;
  base.hit_speed = defaults.hit_speed;
  base.measure_steps = defaults.measure;
  return base;
}

BuiltScene build(const SceneDesc& scene, World& world) {
  BuiltScene built;
  try {
    add_everything(scene, built, world);
  } catch (...) {
    take_back(built, world);
    throw;
  }
  return built;
}

std::size_t apply_events(const SceneDesc& scene, BuiltScene& built, World& world,
                         std::uint64_t step) {
  const auto [first, last] =
      std::equal_range(scene.events.begin(), scene.events.end(), SceneEvent{step, RemoveEvent{}},
                       [](const SceneEvent& a, const SceneEvent& b) { return a.step < b.step; });
  std::for_each(first, last, [&](const SceneEvent& event) { apply(event, built, world); });
  return static_cast<std::size_t>(last - first);
}

void check_buildable(const SceneDesc& scene) {
  World world(world_settings(scene));
  BuiltScene built;
  add_everything(scene, built, world);
  for (const SceneEvent& event : scene.events) {
    if (const auto* bodies = std::get_if<SpawnEvent>(&event.action)) spawn(*bodies, built, world);
  }
}

}  // namespace skerry::scenes
