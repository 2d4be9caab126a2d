#include "collision/mesh_points.h"

#include <algorithm>
#include <cmath>

#include "collision/float_lanes.h"

namespace skerry::collision {

namespace float_lanes {

#define SKERRY_LANES
#include "collision/lane_vectors-inl.h"

#include "collision/axis_lanes-inl.h"
#include "collision/mesh_points-inl.h"
#undef SKERRY_LANES

}  // namespace float_lanes

void choose_spread_reference(std::vector<MeshPoints::Block>& blocks, PointChoice& choice) {
  float_lanes::choose_spread_lanes<float_lanes::Lane>(blocks, choice);
}

void MeshPoints::clear() {
  contacts_.clear();
  blocks_.clear();
  size_ = 0;
}

std::uint32_t MeshPoints::begin_contact(const core::V3f& normal) {
  contacts_.push_back({normal, 3e38f});
  return static_cast<std::uint32_t>(contacts_.size() - 1);
}

void MeshPoints::add(std::uint32_t contact, const core::V3f& position, float separation,
                     std::uint32_t feature) {
  const std::uint32_t lane = size_ % Block::kSize;
  if (lane == 0) {
    // Copies of this point, in no patch.
    Block& block = blocks_.emplace_back();
    std::fill_n(block.position[0], Block::kSize, position.x);
    std::fill_n(block.position[1], Block::kSize, position.y);
    std::fill_n(block.position[2], Block::kSize, position.z);
    std::fill_n(block.separation, Block::kSize, separation);
    std::fill_n(block.patch, Block::kSize, kNoPatch);
  }
  Block& block = blocks_.back();
  block.position[0][lane] = position.x;
  block.position[1][lane] = position.y;
  block.position[2][lane] = position.z;
  block.separation[lane] = separation;
  block.feature[lane] = feature;
  block.contact[lane] = contact;
  contacts_[contact].separation = std::min(contacts_[contact].separation, separation);
  ++size_;
}

ContactPoint MeshPoints::at(std::uint32_t i) const {
  const Block& block = blocks_[i / Block::kSize];
  const std::uint32_t lane = i % Block::kSize;
  return {{block.position[0][lane], block.position[1][lane], block.position[2][lane]},
          block.separation[lane],
          block.feature[lane]};
}

float MeshPoints::spread() const {
  float most = 0;
  for (std::uint32_t i = 1; i < size_; ++i)
    most = std::max(most, core::length(at(i).position - at(0).position));
  return most;
}

const MeshPoints::Contact* MeshPoints::deepest(float tolerance) const {
  float least = 3e38f;
  for (const Contact& contact : contacts_)
    if (!contact.taken) least = std::min(least, contact.separation);
  for (const Contact& contact : contacts_)
    if (!contact.taken && contact.separation <= least + tolerance && contact.separation < 3e38f)
      return &contact;
  return nullptr;
}

MeshPoints::Taken MeshPoints::take(const core::V3f& normal, float least_cosine, float patch) {
  taken_now_.assign(contacts_.size(), 0);
  float least = 3e38f;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    Contact& contact = contacts_[i];
    if (contact.taken || core::dot(contact.normal, normal) < least_cosine) continue;
    contact.taken = true;
    taken_now_[i] = 1;
    least = std::min(least, contact.separation);
  }
  core::V3f sum{0, 0, 0};
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const float behind = (contacts_[i].separation - least) * (1 / kSpeculativeDistance);
    if (taken_now_[i] && behind < 1) sum = sum + contacts_[i].normal * (1 - behind);
  }
  for (std::uint32_t i = 0; i < size_; ++i) {
    Block& block = blocks_[i / Block::kSize];
    if (taken_now_[block.contact[i % Block::kSize]]) block.patch[i % Block::kSize] = patch;
  }
  return {least, direction(sum, normal)};
}

}  // namespace skerry::collision
