#include "solver/contact_blocks.h"
#include "solver/reference_lanes.h"

namespace skerry::solver {
namespace {
// Inlining is left to the compiler: wide loops over plain floats, all inlined, take minutes.
#define SKERRY_LANE static inline
#include "solver/contact_kernels.inl"
#undef SKERRY_LANE
}  // namespace

const ContactKernels* reference_kernels(std::uint32_t width) {
  static const ContactKernels w1 = KernelsOf<ReferenceLanes<1>>::make("reference 1");
  static const ContactKernels w16 = KernelsOf<ReferenceLanes<16>>::make("reference 16");
  return width == 1 ? &w1 : width == 16 ? &w16 : nullptr;
}

}  // namespace skerry::solver
