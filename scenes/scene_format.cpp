#include "scenes/scene_format.h"

#include <algorithm>
#include <string>

#include "scenes/near_names.h"

namespace skerry::scenes {
namespace {

using Names = std::vector<std::string_view>;

Names operator+(Names a, const Names& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

using Specs = std::vector<ObjectSpec>;

// Members that several kinds of object have.
Names surface() { return {"material", "density", "friction", "restitution", "rolling_resistance"}; }
Names placed() { return {"name", "position", "orientation"}; }
Names softness() { return {"limit_frequency", "limit_damping_ratio"}; }
Names angular_drive() { return {"spring", "motor", "friction_torque"}; }
Names angular_axis() { return Names{"limits_degrees"} + softness() + angular_drive(); }
Names linear_axis() { return Names{"limits", "spring", "motor", "friction_force"} + softness(); }

Specs scene_specs() {
  return {
      {"scene",
       {"format", "version"},
       {"$schema",    "name",           "description", "gravity", "dt",           "solver",
        "substeps",   "steps",          "warmup",      "sleep",   "integrator",   "broadphase",
        "continuous", "persist_events", "hit_speed",   "measure", "seed",         "materials",
        "meshes",     "prefabs",        "bodies",      "joints",  "force_fields", "events"}},
      {"solver",
       {},
       {"kind", "contact_hertz", "contact_damping_ratio", "max_push_velocity",
        "restitution_threshold", "joint_hertz", "joint_damping_ratio", "pgs", "penalty"}},
      {"pgs", {}, {"iterations", "correction", "correction_rate", "slop"}},
      {"penalty", {}, {"substeps", "hertz"}},
      {"sleep", {}, {"enabled", "linear_threshold", "angular_threshold", "time"}},
      {"material", {}, {"friction", "restitution", "rolling_resistance", "density"}},
      {"mesh", {"file"}, {"scale", "weld", "manifold"}},
      {"prefab", {"bodies"}, {"joints"}},
  };
}

// What may stand in a list of bodies.
Specs body_specs() {
  const Names body = Names{"type",      "shapes",        "linear_velocity", "angular_velocity",
                           "mass",      "gravity_scale", "linear_damping",  "angular_damping",
                           "locks",     "allow_sleep",   "awake",           "user_data",
                           "continuous"} +
                     surface() + placed();
  return {
      {"body", {}, body},
      {"instance", {"prefab"}, placed()},
      {"grid_item", {"grid", "of"}, placed()},
      {"stack_item", {"stack", "of"}, placed()},
      {"pile_item", {"pile", "of"}, placed()},
      {"grid", {"count", "spacing"}, {"jitter", "seed"}},
      {"stack", {"count", "offset"}, {"turn_degrees", "jitter", "seed"}},
      {"pile", {"count", "columns", "spacing"}, {"jitter", "turn", "seed"}},
  };
}

Specs shape_specs() {
  const Names shape =
      Names{"position", "orientation", "category", "mask", "group", "sensor"} + surface();
  return {
      {"sphere", {"type", "radius"}, Names{"hollow"} + shape},
      {"capsule", {"type", "radius", "half_height"}, shape},
      {"box", {"type", "half_extents"}, shape},
      {"cylinder", {"type", "radius", "half_height"}, shape},
      {"cone", {"type", "radius", "half_height"}, shape},
      {"ellipsoid", {"type", "semi_axes"}, shape},
      {"convex_hull", {"type"}, Names{"points", "mesh", "scale"} + shape},
      {"plane", {"type"}, Names{"normal", "offset"} + shape},
      {"mesh_shape", {"type", "mesh"}, Names{"scale"} + shape},
      {"height_field", {"type", "heights"}, Names{"holes", "scale"} + shape},
  };
}

Specs property_specs() {
  return {
      {"axis_angle", {"axis", "degrees"}, {}},
      {"euler", {"euler_degrees"}, {}},
      {"mass", {"mass"}, {"center", "inertia"}},
      {"locks", {}, {"translation", "rotation"}},
  };
}

Specs joint_specs() {
  const Names joint = {"a", "b", "breaks", "collide"};
  return {
      {"ball", {"type", "anchor"}, Names{"friction_torque"} + joint},
      {"hinge", {"type", "anchor", "axis"}, angular_axis() + joint},
      {"slider", {"type", "anchor", "axis"}, linear_axis() + joint},
      {"fixed", {"type", "anchor"}, joint},
      {"distance", {"type", "anchor_a", "anchor_b"}, linear_axis() + joint},
      {"cone_twist",
       {"type", "anchor", "axis"},
       Names{"swing_limit_degrees", "twist_limits_degrees", "swing", "twist"} + softness() + joint},
      {"six_dof", {"type", "anchor"}, Names{"orientation", "axes"} + joint},
      {"six_axes", {}, {"x", "y", "z", "swing_x", "swing_y", "twist"}},
  };
}

// Parts of joints.
Specs axis_specs() {
  return {
      {"linear_axis", {}, linear_axis()},
      {"angular_axis", {}, angular_axis()},
      {"angular_drive", {}, angular_drive()},
      {"linear_spring", {"frequency"}, {"damping_ratio", "rest"}},
      {"angular_spring", {"frequency"}, {"damping_ratio", "rest_degrees"}},
      {"linear_motor", {}, {"speed", "target", "max_force", "frequency", "damping_ratio"}},
      {"angular_motor",
       {},
       {"speed", "target_degrees", "max_torque", "frequency", "damping_ratio"}},
      {"breaks", {}, {"force", "torque"}},
  };
}

Specs force_field_specs() {
  return {
      {"uniform", {"type"}, {"acceleration", "force", "bodies"}},
      {"drag", {"type"}, {"linear", "quadratic", "bodies"}},
      {"attractor", {"type", "point", "strength"}, {"softening", "bodies"}},
      {"spring", {"type", "anchor", "stiffness"}, {"damping", "bodies"}},
      {"wind", {"type", "velocity", "drag"}, {"gust", "bodies"}},
      {"gust", {"amplitude", "period"}, {}},
  };
}

Specs event_specs() {
  return {
      {"impulse_event", {"step", "impulse"}, {}},
      {"spawn_event", {"step", "spawn"}, {}},
      {"remove_event", {"step", "remove"}, {}},
      {"impulse", {"body", "impulse"}, {"point"}},
      {"remove", {"body"}, {}},
  };
}

Specs all_specs() {
  Specs all;
  for (const auto& part : {scene_specs(), body_specs(), shape_specs(), property_specs(),
                           joint_specs(), axis_specs(), force_field_specs(), event_specs()})
    all.insert(all.end(), part.begin(), part.end());
  return all;
}

const ObjectSpec& spec_of(std::string_view kind) {
  const auto specs = object_specs();
  return *std::find_if(specs.begin(), specs.end(),
                       [&](const ObjectSpec& spec) { return spec.name == kind; });
}

bool contains(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::span<const ObjectSpec> object_specs() {
  static const Specs kSpecs = all_specs();
  return kSpecs;
}

void check_object(const JsonNode& node, std::string_view kind) {
  if (node.kind != JsonKind::object) node.refuse("an object");
  const ObjectSpec& spec = spec_of(kind);
  for (const JsonNode* member : node.children) {
    if (contains(spec.required, member->key) || contains(spec.optional, member->key)) continue;
    std::vector<std::string> known(spec.required.begin(), spec.required.end());
    known.insert(known.end(), spec.optional.begin(), spec.optional.end());
    member->fail("unknown field" + did_you_mean(member->key, known));
  }
  for (const std::string_view name : spec.required) {
    if (!node.find(name)) node.fail(std::string("\"").append(name).append("\" is missing"));
  }
}

}  // namespace skerry::scenes
