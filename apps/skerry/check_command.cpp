// skerry check: is this scene file right, and what is in it?
#include <fmt/core.h>
#include <array>
#include <memory>

#include "apps/skerry/arguments.h"
#include "apps/skerry/commands.h"
#include "scenes/scene_file.h"

namespace skerry::app {
namespace {

std::string count_text(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

void print_bodies(const scenes::SceneDesc& scene) {
  std::array<std::size_t, 3> by_type = {};
  std::size_t shapes = 0;
  for (const BodyDesc& body : scene.bodies) {
    ++by_type[static_cast<std::size_t>(body.type)];
    shapes += body.shapes.size();
  }
  fmt::print("  {} ({} dynamic, {} fixed, {} kinematic), {}\n",
             count_text(scene.bodies.size(), "body", "bodies"), by_type[0], by_type[1], by_type[2],
             count_text(shapes, "shape", "shapes"));
}

void print_events(const scenes::SceneDesc& scene) {
  if (scene.events.empty()) return;
  std::size_t spawned = 0;
  for (const scenes::SceneEvent& event : scene.events) {
    if (const auto* spawn = std::get_if<scenes::SpawnEvent>(&event.action)) {
      spawned += spawn->bodies.size();
    }
  }
  fmt::print("  {} from step {} to {}, {} spawned\n",
             count_text(scene.events.size(), "event", "events"), scene.events.front().step,
             scene.events.back().step, count_text(spawned, "body", "bodies"));
}

int check_file(const std::string& file) {
  const scenes::SceneDesc scene = scenes::read_scene_file(file);
  const scenes::SceneDefaults& defaults = scene.defaults;
  fmt::print("{}: ok\n", file);
  fmt::print("  {}{}{}\n", scene.name, scene.description.empty() ? "" : ": ", scene.description);
  fmt::print("  gravity ({}, {}, {}) m/s^2, {} of {:.6g} s, {}, sleeping {}\n",
             defaults.gravity.x(), defaults.gravity.y(), defaults.gravity.z(),
             count_text(defaults.steps, "step", "steps"), defaults.dt,
             count_text(static_cast<std::size_t>(defaults.solver.substeps), "substep", "substeps"),
             defaults.sleep.enabled ? "on" : "off");
  print_bodies(scene);
  fmt::print("  {}, {}, {}\n", count_text(scene.joints.size(), "joint", "joints"),
             count_text(scene.fields.size(), "force field", "force fields"),
             count_text(scene.materials.size(), "material", "materials"));
  for (const auto& [name, mesh] : scene.meshes) {
    fmt::print("  mesh {}: {}, {}\n", name,
               count_text(mesh->triangles.size(), "triangle", "triangles"),
               count_text(mesh->vertices.size(), "vertex", "vertices"));
  }
  print_events(scene);
  return kOk;
}

}  // namespace

void add_check_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("check", "Check a scene file and say what it holds");
  const auto file = std::make_shared<std::string>();
  command->add_option("FILE", *file, "Scene file")->required();
  command->callback([file, &action] { action = [file] { return check_file(*file); }; });
}

}  // namespace skerry::app
