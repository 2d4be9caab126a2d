#include "core/contacts.h"

#include <algorithm>
#include <cmath>

#include "core/assert.h"

namespace skerry::core {
namespace {
std::vector<std::uint32_t>& free_list(ContactTable& table, std::uint32_t capacity) {
  SKERRY_ASSERT(capacity == 1 || capacity == kMeshManifolds,
                "no pool of manifolds of this capacity");
  return capacity == 1 ? table.free_single : table.free_mesh;
}
}  // namespace

std::uint32_t take_manifolds(ContactTable& table, std::uint32_t capacity) {
  std::vector<std::uint32_t>& rows = free_list(table, capacity);
  if (rows.empty()) {
    const auto first = static_cast<std::uint32_t>(table.manifolds.size());
    table.manifolds.resize(first + capacity);
    table.apart_until.resize(first + capacity, 0);
    table.touch_gaps.resize(first + capacity);
    return first;
  }
  const std::uint32_t first = rows.back();
  rows.pop_back();
  table.apart_until[first] = 0;
  return first;
}

void take_memory(ContactTable& table, std::uint32_t first_manifold) {
  if (table.polytope_memory.size() <= first_manifold)
    table.polytope_memory.resize(table.manifolds.size());
}

void give_manifolds(ContactTable& table, std::uint32_t first, std::uint32_t capacity) {
  SKERRY_ASSERT(first + capacity <= table.manifolds.size(), "manifolds from another table");
  free_list(table, capacity).push_back(first);
}

float combined_restitution(const Collider& a, const Collider& b) {
  return std::max(a.restitution, b.restitution);
}

void set_materials(ContactTable& table, const ContactPair& pair, const Collider& a,
                   const Collider& b) {
  for (std::uint32_t i = 0; i < pair.manifold_capacity; ++i) {
    Manifold& manifold = table.manifolds[pair.first_manifold + i];
    manifold.friction = std::sqrt(a.friction * b.friction);
    manifold.restitution = combined_restitution(a, b);
    manifold.rolling_resistance = std::max(a.rolling_resistance, b.rolling_resistance);
  }
}

}  // namespace skerry::core
