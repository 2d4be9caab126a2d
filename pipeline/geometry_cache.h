// Hulls, meshes and height fields that are alive in a world, so that a thousand equal rocks share one hull.
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include <skerry/shapes.h>

#include "core/colliders.h"

namespace skerry::pipeline {

class GeometryCache {
 public:
  // As collision::build_hull, build_mesh and build_height_field, throwing what they throw.
  std::shared_ptr<const core::HullGeometry> hull(const std::vector<Vec3>& points,
                                                 const Vec3& scale);
  std::shared_ptr<const core::MeshGeometry> mesh(const std::shared_ptr<const MeshData>& data,
                                                 const Vec3& scale);
  std::shared_ptr<const core::HeightFieldGeometry> height_field(
      const std::shared_ptr<const HeightFieldData>& data, const Vec3& scale);

 private:
  struct Hull {
    std::vector<Vec3> points;
    Vec3 scale;
    std::weak_ptr<const core::HullGeometry> geometry;
  };
  struct Mesh {
    std::weak_ptr<const MeshData> data;
    std::weak_ptr<const core::MeshGeometry> geometry;
  };
  struct Field {
    std::weak_ptr<const HeightFieldData> data;
    std::weak_ptr<const core::HeightFieldGeometry> geometry;
  };
  // Looked up by key, never iterated.
  std::unordered_map<std::uint64_t, Hull> hulls_;
  std::unordered_map<std::uint64_t, Mesh> meshes_;
  std::unordered_map<std::uint64_t, Field> fields_;
};

}  // namespace skerry::pipeline
