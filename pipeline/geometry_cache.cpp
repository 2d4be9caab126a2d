#include "pipeline/geometry_cache.h"

#include "collision/geometry_build.h"
#include "core/hash.h"

namespace skerry::pipeline {
namespace {

void add(core::StateHasher& hasher, const Vec3& v) {
  hasher.add(v.x());
  hasher.add(v.y());
  hasher.add(v.z());
}

std::uint64_t key_of(const std::vector<Vec3>& points, const Vec3& scale) {
  core::StateHasher hasher;
  for (const Vec3& point : points) add(hasher, point);
  add(hasher, scale);
  return hasher.finish();
}

std::uint64_t key_of(const void* data, const Vec3& scale) {
  core::StateHasher hasher;
  hasher.add(static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(data)));
  add(hasher, scale);
  return hasher.finish();
}

}  // namespace

std::shared_ptr<const core::HullGeometry> GeometryCache::hull(const std::vector<Vec3>& points,
                                                              const Vec3& scale) {
  Hull& entry = hulls_[key_of(points, scale)];
  if (auto geometry = entry.geometry.lock();
      geometry && entry.points == points && entry.scale == scale)
    return geometry;
  auto geometry = collision::build_hull(points, scale);
  entry = {points, scale, geometry};
  return geometry;
}

std::shared_ptr<const core::MeshGeometry> GeometryCache::mesh(
    const std::shared_ptr<const MeshData>& data, const Vec3& scale) {
  Mesh& entry = meshes_[key_of(data.get(), scale)];
  if (auto geometry = entry.geometry.lock(); geometry && entry.data.lock() == data) return geometry;
  auto geometry = collision::build_mesh(*data, scale);
  entry = {data, geometry};
  return geometry;
}

std::shared_ptr<const core::HeightFieldGeometry> GeometryCache::height_field(
    const std::shared_ptr<const HeightFieldData>& data, const Vec3& scale) {
  Field& entry = fields_[key_of(data.get(), scale)];
  if (auto geometry = entry.geometry.lock(); geometry && entry.data.lock() == data) return geometry;
  auto geometry = collision::build_height_field(*data, scale);
  entry = {data, geometry};
  return geometry;
}

}  // namespace skerry::pipeline
