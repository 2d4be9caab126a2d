#include "scenes/mesh_file.h"

#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <bit>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

namespace skerry::scenes {
namespace {

using Cell = std::array<std::int64_t, 3>;

struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t h = 0;
    for (const std::int64_t part : cell) {
      h = (h ^ static_cast<std::uint64_t>(part)) * 0x9e3779b97f4a7c15u;
      h ^= h >> 29;
    }
    return static_cast<std::size_t>(h);
  }
};

// Finds, for a point, the first point seen before within the tolerance.
class Welder {
 public:
  explicit Welder(double tolerance) : tolerance_(tolerance) {}

  std::uint32_t index_of(const Vec3& point) {
    const Cell home = cell_of(point);
    std::uint32_t best = kNone;
    const int reach = tolerance_ > 0 ? 1 : 0;
    for (int x = -reach; x <= reach; ++x) {
      for (int y = -reach; y <= reach; ++y) {
        for (int z = -reach; z <= reach; ++z) {
          best = std::min(best, nearest_in({home[0] + x, home[1] + y, home[2] + z}, point));
        }
      }
    }
    if (best != kNone) return best;
    points_.push_back(point);
    const auto index = static_cast<std::uint32_t>(points_.size() - 1);
    cells_[home].push_back(index);
    return index;
  }

  std::vector<Vec3> take_points() { return std::move(points_); }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  // Without a tolerance every point has a cell of its own: its bits (+0 and -0 being one).
  Cell cell_of(const Vec3& p) const {
    Cell cell;
    for (int i = 0; i < 3; ++i) {
      cell[static_cast<std::size_t>(i)] =
          tolerance_ > 0
              ? static_cast<std::int64_t>(std::floor(std::clamp(p[i] / tolerance_, -9e15, 9e15)))
              : std::bit_cast<std::int64_t>(p[i] + 0.0);
    }
    return cell;
  }

  std::uint32_t nearest_in(const Cell& cell, const Vec3& point) const {
    const auto found = cells_.find(cell);
    if (found == cells_.end()) return kNone;
    for (const std::uint32_t index : found->second) {
      if ((points_[index] - point).cwiseAbs().maxCoeff() <= tolerance_) return index;
    }
    return kNone;
  }

  double tolerance_;
  std::vector<Vec3> points_;
  std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> cells_;
};

void append(const aiMesh& part, MeshData& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    mesh.vertices.emplace_back(static_cast<double>(v.x), static_cast<double>(v.y),
                               static_cast<double>(v.z));
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines
    mesh.triangles.push_back(
        {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
  }
}

MeshData import(const std::filesystem::path& file) {
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
  if (!scene) throw std::runtime_error(std::string("cannot be read: ") + importer.GetErrorString());
  MeshData mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) append(*scene->mMeshes[i], mesh);
  return mesh;
}

void check_kind(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* known : {".obj", ".stl", ".ply", ".gltf", ".glb"}) {
    if (extension == known) return;
  }
  throw std::runtime_error("must be an .obj, .stl, .ply, .gltf or .glb file");
}

void check_finite(const MeshData& mesh) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!mesh.vertices[i].allFinite()) {
      throw std::runtime_error("vertex " + std::to_string(i) + " is not finite");
    }
  }
}

std::string point_text(const Vec3& p) {
  std::array<char, 96> buffer = {};
  std::snprintf(buffer.data(), buffer.size(), "(%.6g, %.6g, %.6g)", p.x(), p.y(), p.z());
  return buffer.data();
}

}  // namespace

MeshData welded(const MeshData& mesh, double tolerance) {
  Welder welder(tolerance);
  MeshData result;
  std::vector<std::uint32_t> moved(mesh.vertices.size(), 0xffffffffu);
  for (const auto& triangle : mesh.triangles) {
    std::array<std::uint32_t, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      std::uint32_t& to = moved[triangle[i]];
      if (to == 0xffffffffu) to = welder.index_of(mesh.vertices[triangle[i]]);
      corners[i] = to;
    }
    const bool line =
        corners[0] == corners[1] || corners[1] == corners[2] || corners[0] == corners[2];
    if (!line) result.triangles.push_back(corners);
  }
  result.vertices = welder.take_points();
  return result;
}

std::string manifold_defect(const MeshData& mesh) {
  // A directed edge may occur once; then an edge has at most two triangles, wound alike.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    edges.emplace_back(a, b);
    edges.emplace_back(b, c);
    edges.emplace_back(c, a);
  }
  std::sort(edges.begin(), edges.end());
  const auto twice = std::adjacent_find(edges.begin(), edges.end());
  if (twice == edges.end()) return "";
  return "is not manifold: several triangles run along the edge " +
         point_text(mesh.vertices[twice->first]) + " - " +
         point_text(mesh.vertices[twice->second]) + " in the same direction";
}

MeshData load_mesh(const std::filesystem::path& file, const MeshFileOptions& options) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) throw std::runtime_error("no such file");
  check_kind(file);
  const MeshData imported = import(file);
  check_finite(imported);
  MeshData mesh = welded(imported, options.weld);
  if (mesh.triangles.empty()) throw std::runtime_error("has no triangles");
  if (options.manifold) {
    if (const std::string defect = manifold_defect(mesh); !defect.empty()) {
      throw std::runtime_error(defect);
    }
  }
  for (Vec3& vertex : mesh.vertices) vertex = vertex.cwiseProduct(options.scale);
  return mesh;
}

}  // namespace skerry::scenes
