#include "scenes/catalogue.h"

#include <stdexcept>
#include <string>
#include <vector>

#include "scenes/builders.h"
#include "scenes/near_names.h"

namespace skerry::scenes {
namespace {

constexpr CatalogueEntry kCatalogue[] = {
    {"large_pyramid", "5050 touching cubes in one flat pyramid: one island", make_large_pyramid},
    {"many_pyramids", "196 pyramids of 55 cubes", make_many_pyramids},
    {"box_pile", "4096 cubes falling in columns into a pit", make_box_pile},
    {"box_bricks", "4096 cubes falling like bricks, each on four: one island", make_box_bricks},
    {"sphere_rain", "8000 spheres falling into a pit", make_sphere_rain},
    {"convex_pile", "2000 icosahedra falling into a pit", make_convex_pile},
    {"islands", "4096 stacks of 5 cubes", make_islands},
    {"tiny", "20 boxes and spheres", make_tiny},
    {"mixed", "512 mixed bodies, chains, a sensor, bodies removed, pushed and added", make_mixed},
    {"mesh_terrain", "600 mixed bodies on a wavy mesh of 12800 triangles", make_mesh_terrain},
    {"chains", "64 chains of 10 capsules, ball and hinge joints, over bars", make_chains},
    {"joint_grid", "a net of 10000 spheres in 19701 ball joints: one island", make_joint_grid},
    {"ragdoll_rain", "up to 300 ragdolls of 14 bones falling on 100 meshes, column by column",
     make_ragdoll_rain},
    {"bridge", "12 hanging bridges of 24 hinged planks under boxes", make_bridge},
    {"washer", "8000 cubes in a turning drum with paddles", make_washer},
    {"junkyard", "10584 rocks fall into a yard in which a pillar goes round", make_junkyard},
    {"gallery", "every kind of shape on a plane", make_gallery},
    {"sim_rolling_xy", "SimBenchmark: a plate pulled askew under 25 balls", make_sim_rolling_xy},
    {"sim_rolling_y", "SimBenchmark: a plate pulled straight under 25 balls", make_sim_rolling_y},
    {"sim_bouncing", "SimBenchmark: 49 balls that bounce forever", make_sim_bouncing},
    {"sim_666", "SimBenchmark: a cube of 216 balls falls apart", make_sim_666},
    {"sim_666_elastic", "SimBenchmark: the same, perfectly elastic", make_sim_666_elastic},
    {"sim_kapla", "SimBenchmark: a tower of 102 bricks", make_sim_kapla},
    {"sim_boxes", "benchmark/boxes: a free box tumbles", make_sim_boxes},
};

}  // namespace

std::span<const CatalogueEntry> catalogue() { return kCatalogue; }

const CatalogueEntry* find_entry(std::string_view name) {
  for (const CatalogueEntry& entry : kCatalogue) {
    if (name == entry.name) return &entry;
  }
  return nullptr;
}

SceneDesc make_scene(std::string_view name, std::uint64_t seed) {
  if (const CatalogueEntry* entry = find_entry(name)) {
    SceneDesc scene = entry->make(seed);
    scene.name = entry->name;
    scene.description = entry->description;
    return scene;
  }
  std::vector<std::string> names;
  for (const CatalogueEntry& entry : kCatalogue) names.emplace_back(entry.name);
  throw std::out_of_range("unknown scene '" + std::string(name) + "'" + did_you_mean(name, names));
}

}  // namespace skerry::scenes
