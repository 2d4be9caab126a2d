// Writes the ground of the mesh_terrain scene, or one of other measures, as a binary PLY file:
//   make_terrain FILE [CELLS WIDTH WAVE_HEIGHT RIM_HEIGHT]
// scenes/data/hills.ply is `make_terrain hills.ply 80 48 1.2 6`: 12800 triangles.
#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "scenes/geometry.h"

namespace {

static_assert(std::endian::native == std::endian::little);

template <class Value>
void write_value(std::ofstream& file, Value value) {
  const auto bytes = std::bit_cast<std::array<char, sizeof(Value)>>(value);
  file.write(bytes.data(), bytes.size());
}

bool write_ply(const skerry::MeshData& mesh, const char* name) {
  std::ofstream file(name, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
       << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const skerry::Vec3& vertex : mesh.vertices) {
    for (int i = 0; i < 3; ++i) write_value(file, static_cast<float>(vertex[i]));
  }
  for (const auto& triangle : mesh.triangles) {
    write_value(file, static_cast<unsigned char>(3));
    for (const std::uint32_t corner : triangle) write_value(file, corner);
  }
  return static_cast<bool>(file.flush());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 6) {
    std::fprintf(stderr, "usage: make_terrain FILE [CELLS WIDTH WAVE_HEIGHT RIM_HEIGHT]\n");
    return 2;
  }
  const bool given = argc == 6;
  const int cells = given ? std::atoi(argv[2]) : 80;
  const double width = given ? std::atof(argv[3]) : 48;
  const double wave_height = given ? std::atof(argv[4]) : 1.2;
  const double rim_height = given ? std::atof(argv[5]) : 6;
  if (cells < 1 || cells > 2000 || !(width > 0)) {
    std::fprintf(stderr, "make_terrain: 1 to 2000 cells and a positive width\n");
    return 2;
  }
  const auto mesh = skerry::scenes::wavy_ground(cells, width, wave_height, rim_height);
  if (!write_ply(mesh, argv[1])) {
    std::fprintf(stderr, "make_terrain: cannot write %s\n", argv[1]);
    return 1;
  }
}
