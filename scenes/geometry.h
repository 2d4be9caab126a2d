// Points and triangles that scenes are made of.
#pragma once

#include <vector>

#include <skerry/shapes.h>

namespace skerry::scenes {

// The 12 corners of a regular icosahedron.
std::vector<Vec3> icosahedron(double circumradius);

// A regular icosahedron as a closed mesh, each face split into four `splits` times and pushed out
// to the sphere.
MeshData ball_mesh(double radius, int splits);

// Square ground of cells x cells squares, two triangles each, seen from above; waves of the given
// height, and a rim that rises outside 70 % of the half width so that nothing rolls off.
MeshData wavy_ground(int cells, double width, double wave_height, double rim_height);

// A closed ring about z; its tube has quadrilaterals of two triangles each.
MeshData torus_mesh(double ring_radius, double tube_radius, int ring_segments, int tube_segments);

}  // namespace skerry::scenes
