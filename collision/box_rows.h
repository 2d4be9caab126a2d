// Sixteen pairs of boxes from the rows of their bodies into a batch, and its results into their manifolds.
// Only boxes whose centre and axes are those of their bodies; others go one by one.
#pragma once

#include <cstdint>

#include "collision/box_batch.h"

namespace skerry::collision {

struct alignas(64) BoxRows {
  // core::BodyPose and core::BodyMotion as doubles: centre, orientation x y z w; linear, angular.
  const double* pose_a[BoxBatch::kSize];
  const double* pose_b[BoxBatch::kSize];
  const double* motion_a[BoxBatch::kSize];
  const double* motion_b[BoxBatch::kSize];
  // Three half extents, m; the float behind them is read too.
  const float* size_a[BoxBatch::kSize];
  const float* size_b[BoxBatch::kSize];
  float turn_radius_a[BoxBatch::kSize], turn_radius_b[BoxBatch::kSize];  // m, core::Collider's
};

// All rows of `batch.in` but kKind, as pair_approach and pair_frame give them, for all lanes. False, and
// nothing done, where the machine has no SIMD.
bool place_boxes(const BoxRows& rows, float dt, BoxBatch& batch);

// Manifolds (rows of four floats, core::Manifold) that had the four features that the batch found, each in
// its place, and hardly another normal: they get normal, points and approach speed. Returns in which lanes
// that was done, of those asked for; only these need an address.
std::uint32_t store_boxes(const BoxBatch& batch, std::uint32_t lanes,
                          float* const (&manifold)[BoxBatch::kSize]);

}  // namespace skerry::collision
