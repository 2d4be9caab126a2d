// What can be said of a world's state as a whole: sums and the hash.
#pragma once

#include <cstdint>

#include <skerry/step_report.h>

namespace skerry::pipeline {

struct WorldData;

// Sums in ascending order of bodies and pairs, in double.
Measures measure(const WorldData& world);

// Covers, per alive body in ascending order: index, pose and velocities of the centre of mass,
// angular momentum, whether it is awake; then the events of the last step.
std::uint64_t state_hash(const WorldData& world);

}  // namespace skerry::pipeline
