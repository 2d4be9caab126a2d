// What the built-in scenes are made of, and the functions that make them.
#pragma once

#include <cstdint>

#include "scenes/scene.h"

namespace skerry::scenes {

BodyDesc fixed_box(const Vec3& half_extents, const Vec3& position);
BodyDesc dynamic_body(Shape shape, const Vec3& position, double density = 1000);

// Appends a body and gives its number.
BodyNumber add(SceneDesc& scene, BodyDesc body);

// Static box with its top face at y = 0, half height 1.
void add_floor(SceneDesc& scene, double half_x, double half_z);
// Floor and four walls 1 m thick on it, their inner faces at +-width/2.
void add_pit(SceneDesc& scene, double width, double wall_height);

// The seven common scenes: bodies, order and jitter are fixed by docs/scenes.md.
SceneDesc make_large_pyramid(std::uint64_t seed);
SceneDesc make_many_pyramids(std::uint64_t seed);
SceneDesc make_box_pile(std::uint64_t seed);
SceneDesc make_box_bricks(std::uint64_t seed);
SceneDesc make_sphere_rain(std::uint64_t seed);
SceneDesc make_convex_pile(std::uint64_t seed);
SceneDesc make_islands(std::uint64_t seed);

SceneDesc make_tiny(std::uint64_t seed);
SceneDesc make_mixed(std::uint64_t seed);
SceneDesc make_mesh_terrain(std::uint64_t seed);
SceneDesc make_joint_grid(std::uint64_t seed);
SceneDesc make_chains(std::uint64_t seed);
SceneDesc make_gallery(std::uint64_t seed);

SceneDesc make_ragdoll_rain(std::uint64_t seed);
SceneDesc make_bridge(std::uint64_t seed);
SceneDesc make_washer(std::uint64_t seed);
SceneDesc make_junkyard(std::uint64_t seed);

// Tasks of public accuracy comparisons (scenes/sim_benchmark.cpp).
SceneDesc make_sim_rolling_xy(std::uint64_t seed);
SceneDesc make_sim_rolling_y(std::uint64_t seed);
SceneDesc make_sim_bouncing(std::uint64_t seed);
SceneDesc make_sim_666(std::uint64_t seed);
SceneDesc make_sim_666_elastic(std::uint64_t seed);
SceneDesc make_sim_kapla(std::uint64_t seed);
SceneDesc make_sim_boxes(std::uint64_t seed);

}  // namespace skerry::scenes
