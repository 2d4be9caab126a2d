// skerry scenes: what there is to run.
#include <fmt/core.h>
#include <memory>

#include "apps/skerry/commands.h"
#include "apps/skerry/json_output.h"
#include "scenes/catalogue.h"
#include "scenes/load.h"

namespace skerry::app {
namespace {

struct ListedScene {
  scenes::SceneDesc scene;
  std::string source;  // "built-in" or the file
};

std::vector<ListedScene> listed_scenes() {
  std::vector<ListedScene> list;
  for (const auto& entry : scenes::catalogue()) {
    list.push_back({scenes::make_scene(entry.name), "built-in"});
  }
  for (const auto& file : scenes::shipped_scenes()) {
    list.push_back({scenes::read_scene_file(file), file.string()});
    list.back().scene.name = file.stem().string();  // what `skerry run` takes
  }
  return list;
}

std::size_t dynamic_bodies(const scenes::SceneDesc& scene) {
  std::size_t count = 0;
  for (const BodyDesc& body : scene.bodies) count += body.type == BodyType::dynamic ? 1 : 0;
  return count;
}

int list_as_json() {
  Json list = Json::array();
  for (const auto& [scene, source] : listed_scenes()) {
    list.push_back({{"name", scene.name},
                    {"description", scene.description},
                    {"source", source},
                    {"bodies", scene.bodies.size()},
                    {"dynamic_bodies", dynamic_bodies(scene)},
                    {"joints", scene.joints.size()},
                    {"steps", scene.defaults.steps},
                    {"dt", scene.defaults.dt},
                    {"substeps", scene.defaults.solver.substeps}});
  }
  fmt::print("{}\n", list.dump(2));
  return kOk;
}

int list_as_table() {
  fmt::print("{:<15} {:>7} {:>7} {:>6}  {}\n", "scene", "dynamic", "joints", "steps", "what");
  for (const auto& [scene, source] : listed_scenes()) {
    fmt::print("{:<15} {:>7} {:>7} {:>6}  {}\n", scene.name, dynamic_bodies(scene),
               scene.joints.size(), scene.defaults.steps, scene.description);
  }
  return kOk;
}

}  // namespace

void add_scenes_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("scenes", "List the scenes");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "As JSON");
  command->callback(
      [json, &action] { action = [json] { return *json ? list_as_json() : list_as_table(); }; });
}

}  // namespace skerry::app
