// Handles that users keep. A handle names a row and the generation of its tenant, so a handle of a
// removed object is recognised as stale and refused.
#pragma once

#include <compare>
#include <cstdint>

namespace skerry {

template <class Tag>
struct Id {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;

  friend constexpr auto operator<=>(const Id&, const Id&) = default;
};

using BodyId = Id<struct BodyTag>;
using JointId = Id<struct JointTag>;
using ForceFieldId = Id<struct ForceFieldTag>;

}  // namespace skerry
