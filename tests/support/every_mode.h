// One suite for every threading mode and worker count.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <skerry/world.h>

namespace skerry::test {

struct ModeAndWorkers {
  ThreadingMode mode = ThreadingMode::serial;
  int workers = 1;
};

// All modes, with 1, 2, 3, 4 and 8 workers where the mode has any.
std::vector<ModeAndWorkers> every_mode();
std::string name_of(const testing::TestParamInfo<ModeAndWorkers>& info);

// A world in that mode, the rest as given.
World make_world(const ModeAndWorkers& param, WorldSettings settings = {});
// One step, whoever drives it: the dedicated thread in the modes that have one.
StepReport step(World& world, double dt);

class EveryMode : public testing::TestWithParam<ModeAndWorkers> {};

}  // namespace skerry::test
