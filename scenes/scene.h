// A scene as plain data, and what puts it into a world. Built-in scenes (catalogue.h) and scene
// files (scene_file.h) both end up here, so tests, benchmarks and programs show the same thing.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include <skerry/skerry.h>

#include "scenes/force_fields.h"

namespace skerry::scenes {

inline constexpr std::uint64_t kDefaultSeed = 12345;
inline constexpr std::array kSolverKinds = {SolverKind::soft_step_tgs, SolverKind::pgs,
                                            SolverKind::penalty};

struct SceneDefaults {
  Vec3 gravity = {0, -10, 0};  // m/s^2
  double dt = 1.0 / 60;        // s
  std::uint64_t steps = 300;   // timed
  std::uint64_t warmup = 0;    // simulated before them
  // Of WorldSettings:
  SolverSettings solver = {};
  SleepSettings sleep = {};
  Integrator integrator = Integrator::exact;
  BroadphaseKind broadphase = BroadphaseKind::tree;
  bool continuous = true;
  bool persist_events = false;
  double hit_speed = std::numeric_limits<double>::infinity();  // m/s
  bool measure = false;
};

struct SceneMaterial {
  Material surface = {};
  double density = 1000;  // kg/m^3
};

// Bodies are named by position in SceneDesc::bodies; the bodies of spawn events are numbered on
// from there, in the order of the events.
using BodyNumber = std::uint32_t;
inline constexpr BodyNumber kWorldFrame = 0xffffffffu;  // of a joint: no body, but the world

struct SceneJoint {
  BodyNumber a = 0, b = 0;
  JointDesc joint;  // its own a and b are set when it is built
};

struct ImpulseEvent {
  BodyNumber body = 0;
  Vec3 impulse = Vec3::Zero();               // N s
  std::optional<Vec3> point = std::nullopt;  // m, world; none: the centre of mass
};
struct SpawnEvent {
  std::vector<BodyDesc> bodies;
  std::vector<SceneJoint> joints;
};
struct RemoveEvent {
  BodyNumber body = 0;
};
struct SceneEvent {
  std::uint64_t step = 1;  // acts just before this step is made; the first step is 1
  std::variant<ImpulseEvent, SpawnEvent, RemoveEvent> action;
};

struct SceneDesc {
  std::string name;
  std::string description;
  SceneDefaults defaults = {};
  std::map<std::string, SceneMaterial> materials;  // for people who ask; bodies hold their values
  std::map<std::string, std::shared_ptr<const MeshData>> meshes;
  std::vector<BodyDesc> bodies;
  std::vector<SceneJoint> joints;
  std::vector<FieldDesc> fields;
  std::vector<SceneEvent> events;           // ascending step
  std::map<std::string, BodyNumber> names;  // of bodies that have one
};

// `base` with what the scene's defaults say.
WorldSettings world_settings(const SceneDesc& scene, WorldSettings base = {});

// What the engine refused, and whose fault it was. `number` counts as BodyNumber does for bodies,
// and on from SceneDesc::joints into the events for joints.
class BuildError : public InputError {
 public:
  enum class Part : std::uint8_t { body, joint, field };
  BuildError(Part part, std::size_t number, const InputError& cause);
  Part part() const noexcept { return part_; }
  std::size_t number() const noexcept { return number_; }
  const std::string& cause() const noexcept { return cause_; }  // the engine's sentence

 private:
  Part part_;
  std::size_t number_;
  std::string cause_;
};

struct BuiltScene {
  std::vector<BodyId> bodies;  // [BodyNumber]; spawned ones are appended when they come
  std::vector<JointId> joints;
  std::vector<ForceFieldId> fields;
};

// Puts bodies, joints and fields into the world, in the scene's order. Throws BuildError; the world
// then holds what it held before.
BuiltScene build(const SceneDesc& scene, World& world);

// Makes the events of one step happen; call it just before that step. Returns how many there were.
std::size_t apply_events(const SceneDesc& scene, BuiltScene& built, World& world,
                         std::uint64_t step);

// Tries everything that build() and apply_events() would hand to the engine in a world of its own.
// Throws BuildError.
void check_buildable(const SceneDesc& scene);

}  // namespace skerry::scenes
