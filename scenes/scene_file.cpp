#include "scenes/scene_file.h"

#include <algorithm>
#include <numeric>
#include <sstream>

#include "scenes/item_expander.h"
#include "scenes/json_values.h"
#include "scenes/mesh_file.h"
#include "scenes/near_names.h"
#include "scenes/scene_format.h"
#include "scenes/settings_reader.h"

namespace skerry::scenes {
namespace {

void check_format(const JsonNode& root) {
  if (root.kind != JsonKind::object) root.refuse("an object");
  const JsonNode* format = root.find("format");
  if (!format)
    root.fail("\"format\" is missing; a scene file begins with \"format\": \"skerry-scene\"");
  if (read_string(*format) != "skerry-scene") format->refuse("\"skerry-scene\"");
  const JsonNode* version = root.find("version");
  if (!version) root.fail("\"version\" is missing");
  if (read_number(*version) != kSceneFormatVersion) version->refuse("1, the only version there is");
}

// -- What names stand for ---------------------------------------------------------------------------

// Calls use(name, value) for the members of an object whose keys are names.
template <class Use>
void for_named(const JsonNode& root, std::string_view field, Use&& use) {
  if_given(root, field, [&](const JsonNode& table) {
    if (table.kind != JsonKind::object) table.refuse("an object");
    for (const JsonNode* member : table.children) {
      if (member->key.empty()) member->fail("needs a name that is not empty");
      use(member->key, *member);
    }
  });
}

std::shared_ptr<const MeshData> read_mesh(const JsonNode& node,
                                          const std::filesystem::path& directory) {
  check_object(node, "mesh");
  const JsonNode& file = *node.find("file");
  const std::filesystem::path path = read_name(file);
  if (path.is_absolute()) file.refuse("a path relative to the scene file");
  MeshFileOptions options;
  if_given(node, "scale", [&](const JsonNode& n) { options.scale = read_scale(n); });
  if_given(node, "weld", [&](const JsonNode& n) { options.weld = read_not_negative(n); });
  if_given(node, "manifold", [&](const JsonNode& n) { options.manifold = read_bool(n); });
  try {
    return std::make_shared<const MeshData>(load_mesh(directory / path, options));
  } catch (const std::runtime_error& error) {
    file.fail("mesh file " + file.shown() + ": " + error.what());
  }
}

SceneLibrary read_library(const JsonNode& root, const std::filesystem::path& directory) {
  SceneLibrary library;
  for_named(root, "materials", [&](const std::string& name, const JsonNode& node) {
    library.materials[name] = read_material(node);
  });
  for_named(root, "meshes", [&](const std::string& name, const JsonNode& node) {
    library.meshes[name] = read_mesh(node, directory);
  });
  for_named(root, "prefabs",
            [&](const std::string& name, const JsonNode& node) { library.prefabs[name] = &node; });
  return library;
}

// -- Force fields -----------------------------------------------------------------------------------

UniformField read_uniform(const JsonNode& node) {
  UniformField field;
  if_given(node, "acceleration", [&](const JsonNode& n) { field.acceleration = read_vec3(n); });
  if_given(node, "force", [&](const JsonNode& n) { field.force = read_vec3(n); });
  return field;
}

DragField read_drag(const JsonNode& node) {
  DragField field;
  if_given(node, "linear", [&](const JsonNode& n) { field.linear = read_not_negative(n); });
  if_given(node, "quadratic", [&](const JsonNode& n) { field.quadratic = read_not_negative(n); });
  return field;
}

AttractorField read_attractor(const JsonNode& node) {
  AttractorField field = {read_vec3(*node.find("point")), read_number(*node.find("strength"))};
  if_given(node, "softening", [&](const JsonNode& n) { field.softening = read_not_negative(n); });
  return field;
}

SpringField read_spring(const JsonNode& node) {
  SpringField field = {read_vec3(*node.find("anchor")), read_not_negative(*node.find("stiffness"))};
  if_given(node, "damping", [&](const JsonNode& n) { field.damping = read_not_negative(n); });
  return field;
}

WindField read_wind(const JsonNode& node) {
  WindField field = {read_vec3(*node.find("velocity")), read_not_negative(*node.find("drag"))};
  if_given(node, "gust", [&](const JsonNode& gust) {
    check_object(gust, "gust");
    field.gust_amplitude = read_not_negative(*gust.find("amplitude"));
    field.gust_period = read_positive(*gust.find("period"));
  });
  return field;
}

FieldDesc read_field(const JsonNode& node, const Scope& scope) {
  constexpr std::string_view kTypes[] = {"uniform", "drag", "attractor", "spring", "wind"};
  if (node.kind != JsonKind::object) node.refuse("an object");
  const JsonNode* type = node.find("type");
  if (!type) node.fail("\"type\" is missing");
  const std::size_t kind = read_choice(*type, kTypes);
  check_object(node, kTypes[kind]);
  FieldDesc field;
  switch (kind) {
    case 0:
      field.field = read_uniform(node);
      break;
    case 1:
      field.field = read_drag(node);
      break;
    case 2:
      field.field = read_attractor(node);
      break;
    case 3:
      field.field = read_spring(node);
      break;
    default:
      field.field = read_wind(node);
      break;
  }
  if_given(node, "bodies", [&](const JsonNode& list) {
    for (const JsonNode* name : read_list(list, 1)) field.bodies.push_back(find_body(scope, *name));
  });
  return field;
}

// -- Events -----------------------------------------------------------------------------------------

std::uint64_t step_of(const JsonNode& event) {
  return static_cast<std::uint64_t>(read_integer(*event.find("step"), 1, 1'000'000'000));
}

void check_event(const JsonNode& node) {
  if (node.kind != JsonKind::object) node.refuse("an object");
  for (const char* action : {"impulse", "spawn", "remove"}) {
    if (node.find(action)) return check_object(node, std::string(action) + "_event");
  }
  node.fail("needs one of \"impulse\", \"spawn\" and \"remove\"");
}

// Reads the events in the order in which they happen, so that a name means what it means then.
class EventReader {
 public:
  EventReader(ItemExpander& items, Scope& scope) : items_(items), scope_(scope) {}

  std::vector<SceneEvent> read(const JsonNode& list) {
    std::vector<const JsonNode*> nodes = read_list(list, 0);
    for (const JsonNode* node : nodes) check_event(*node);
    std::stable_sort(nodes.begin(), nodes.end(), [](const JsonNode* a, const JsonNode* b) {
      return step_of(*a) < step_of(*b);
    });
    std::vector<SceneEvent> events;
    for (const JsonNode* node : nodes) events.push_back(read_event(*node));
    return events;
  }

 private:
  SceneEvent read_event(const JsonNode& node) {
    const std::uint64_t step = step_of(node);
    if (const JsonNode* impulse = node.find("impulse")) return {step, read_impulse(*impulse)};
    if (const JsonNode* spawn = node.find("spawn")) return {step, read_spawn(*spawn)};
    return {step, read_remove(*node.find("remove"), step)};
  }

  BodyNumber living_body(const JsonNode& name) const {
    const BodyNumber body = find_body(scope_, name);
    if (const auto gone = removed_.find(body); gone != removed_.end()) {
      name.fail(name.shown() + " was removed at step " + std::to_string(gone->second));
    }
    return body;
  }

  ImpulseEvent read_impulse(const JsonNode& node) const {
    check_object(node, "impulse");
    const JsonNode& name = *node.find("body");
    ImpulseEvent event = {living_body(name), read_vec3(*node.find("impulse"))};
    if (items_.bodies[event.body].type != BodyType::dynamic) {
      name.fail(name.shown() + " is not dynamic: an impulse does nothing to it");
    }
    if_given(node, "point", [&](const JsonNode& n) { event.point = read_vec3(n); });
    return event;
  }

  SpawnEvent read_spawn(const JsonNode& node) {
    const auto bodies_before = static_cast<std::ptrdiff_t>(items_.bodies.size());
    const auto joints_before = static_cast<std::ptrdiff_t>(items_.joints.size());
    items_.expand_item(node, {}, scope_);
    SpawnEvent event;
    event.bodies.assign(items_.bodies.begin() + bodies_before, items_.bodies.end());
    event.joints.assign(items_.joints.begin() + joints_before, items_.joints.end());
    return event;
  }

  RemoveEvent read_remove(const JsonNode& node, std::uint64_t step) {
    check_object(node, "remove");
    const BodyNumber body = living_body(*node.find("body"));
    removed_[body] = step;
    return {body};
  }

  ItemExpander& items_;
  Scope& scope_;
  std::map<BodyNumber, std::uint64_t> removed_;
};

// -- The whole --------------------------------------------------------------------------------------

std::uint64_t seed_of(const JsonNode& root, const ReadOptions& options) {
  std::uint64_t seed = kDefaultSeed;
  if_given(root, "seed", [&](const JsonNode& n) {
    seed = static_cast<std::uint64_t>(read_integer(n, 0, 0xffffffff));
  });
  return options.seed.value_or(seed);
}

void read_fields(const JsonNode& root, const Scope& scope, SceneDesc& scene) {
  if_given(root, "force_fields", [&](const JsonNode& list) {
    for (const JsonNode* node : read_list(list, 0))
      scene.fields.push_back(read_field(*node, scope));
  });
}

// What the engine says of a body or joint, said of the place in the file that it came from.
[[noreturn]] void blame(const ItemExpander& items, const BuildError& error) {
  const bool joint = error.part() == BuildError::Part::joint;
  const JsonNode& origin = *(joint ? items.joint_origins : items.body_origins).at(error.number());
  std::string field = error.field().substr(error.field().find("].") + 2);
  std::string detail = error.cause();
  if (detail.starts_with(field + ": ")) detail.erase(0, field.size() + 2);
  std::string path = origin.path();
  if (!field.empty()) path.append(".").append(field);
  throw SceneError(origin.document->file_name(), origin.line, path, detail);
}

// What the engine says of a setting, likewise.
[[noreturn]] void blame(const JsonNode& root, const InputError& error) {
  const JsonNode* origin = &root;
  std::istringstream names(error.field());
  for (std::string name; std::getline(names, name, '.');) {
    const JsonNode* member = origin->kind == JsonKind::object ? origin->find(name) : nullptr;
    if (member == nullptr) break;
    origin = member;
  }
  std::string detail = error.what();
  if (detail.starts_with(error.field() + ": ")) detail.erase(0, error.field().size() + 2);
  throw SceneError(root.document->file_name(), origin->line, error.field(), detail);
}

void read_contents(const JsonNode& root, const ReadOptions& options,
                   const std::filesystem::path& directory, SceneDesc& scene) {
  SceneLibrary library = read_library(root, directory);
  ItemExpander items(library, seed_of(root, options));
  Scope scope;
  if_given(root, "bodies", [&](const JsonNode& list) {
    for (const JsonNode* item : read_list(list, 0)) items.expand_item(*item, {}, scope);
  });
  if_given(root, "joints", [&](const JsonNode& list) { items.join(list, {}, scope); });
  scene.bodies = items.bodies;
  scene.joints = items.joints;
  read_fields(root, scope, scene);
  if_given(root, "events",
           [&](const JsonNode& list) { scene.events = EventReader(items, scope).read(list); });
  items.check_unused_prefabs();
  scene.names = std::move(scope);
  try {
    check_buildable(scene);
  } catch (const BuildError& error) {
    blame(items, error);
  } catch (const InputError& error) {
    blame(root, error);
  }
  scene.materials = std::move(library.materials);
  scene.meshes = std::move(library.meshes);
}

}  // namespace

SceneDesc read_scene_text(const std::string& text, const std::string& name,
                          const std::filesystem::path& directory, const ReadOptions& options) {
  const JsonDocument document(text, name);
  const JsonNode& root = document.root();
  check_format(root);
  check_object(root, "scene");
  SceneDesc scene;
  scene.name = std::filesystem::path(name).stem().string();
  if_given(root, "name", [&](const JsonNode& n) { scene.name = read_name(n); });
  if_given(root, "description", [&](const JsonNode& n) { scene.description = read_string(n); });
  read_defaults(root, scene.defaults);
  read_contents(root, options, directory, scene);
  return scene;
}

SceneDesc read_scene_file(const std::filesystem::path& file, const ReadOptions& options) {
  return read_scene_text(read_text_file(file), file.string(), file.parent_path(), options);
}

}  // namespace skerry::scenes
