// Contacts of one shape with many triangles, and how they are brought together in patches.
//
//   Bits     the same for every instruction set.
//   Threads  no state but its own.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/narrowphase_kernels.h"

namespace skerry::collision {

// Points in rows, with the contact that each belongs to. All points of a contact share its normal.
class MeshPoints {
 public:
  struct alignas(64) Block {
    static constexpr std::uint32_t kSize = 16;  // every SIMD width divides it
    float position[3][kSize];                   // m
    float separation[kSize];                    // m
    float patch[kSize];                         // the patch that may choose it, or kNoPatch
    std::uint32_t feature[kSize];
    std::uint32_t contact[kSize];
  };
  static constexpr float kNoPatch = -1;
  struct Contact {
    core::V3f normal;    // unit, from the first shape to the second
    float separation;    // m, of its deepest point
    bool taken = false;  // by a patch
  };

  void clear();
  std::uint32_t begin_contact(const core::V3f& normal);
  void add(std::uint32_t contact, const core::V3f& position, float separation,
           std::uint32_t feature);
  std::uint32_t size() const { return size_; }
  ContactPoint at(std::uint32_t i) const;
  float spread() const;  // m, from the first point to the farthest
  // Deepest contact that no patch has taken, the first among those that are as deep up to a
  // tolerance in m; null if there is none.
  const Contact* deepest(float tolerance) const;
  // Contacts whose normals are within an angle of this one, and that no patch has taken, go to this
  // one.
  struct Taken {
    float separation;  // m, of the deepest
    // Unit: the mean normal, of those that are as deep; less of the others, none of what is
    // kSpeculativeDistance behind. So it turns smoothly where the deepest one changes.
    core::V3f normal;
  };
  Taken take(const core::V3f& normal, float least_cosine, float patch);

  std::vector<Block>& blocks() { return blocks_; }

 private:
  std::vector<Contact> contacts_;
  std::vector<std::uint8_t> taken_now_;  // [contacts], 1: by the patch being made
  std::vector<Block> blocks_;            // the last is filled up with points of no patch
  std::uint32_t size_ = 0;
};

struct PointChoice {
  core::V3f normal;     // unit, of the patch
  float patch;          // whose points may be chosen
  float deep;           // m: separations up to this count as deepest
  float near;           // m: points nearer to one chosen are the same
  std::uint32_t count;  // chosen
  std::uint32_t index[4];
};
// At most four: a deep one, the one farthest from it, and those that span the largest area; what
// touches first before what is farther away. Takes from the patch what is the same as one chosen.
void choose_spread(std::vector<MeshPoints::Block>& blocks, PointChoice& choice);

// The same source with float for lanes.
void choose_spread_reference(std::vector<MeshPoints::Block>& blocks, PointChoice& choice);

}  // namespace skerry::collision
