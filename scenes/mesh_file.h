// Triangle meshes from OBJ, STL, PLY and glTF files.
#pragma once

#include <filesystem>
#include <string>

#include <skerry/shapes.h>

namespace skerry::scenes {

struct MeshFileOptions {
  Vec3 scale = {1, 1, 1};
  double weld = 0;       // m, before scaling: vertices at most this far apart become one
  bool manifold = true;  // refuse meshes with manifold_defect()
};

// STL files and many others repeat a vertex for each triangle; equal ones are always merged, because
// collision needs to know which triangles are neighbours. Triangles that become lines are left out.
// Throws std::runtime_error with a sentence (without the file's name): no such file, unknown kind,
// unreadable, no triangles, not finite, not manifold.
MeshData load_mesh(const std::filesystem::path& file, const MeshFileOptions& options = {});

// What keeps the mesh from being a surface, as a sentence; empty if every edge belongs to at most
// two triangles, and to two only if they are wound alike. Open edges are fine.
std::string manifold_defect(const MeshData& mesh);

// The mesh with vertices merged as in MeshFileOptions::weld, in order of first use.
MeshData welded(const MeshData& mesh, double tolerance);

}  // namespace skerry::scenes
