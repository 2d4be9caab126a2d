// Runs one scene in several engines side by side and times every step.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/peers/engine.h"
#include "bench/peers/quality.h"

namespace skerry::peers {

struct Contestant {
  EngineInfo info;
  int workers = 1;
  std::function<std::unique_ptr<Engine>()> make;
};

struct RaceOptions {
  std::uint64_t steps = 0;
  int reps = 1;
  std::uint64_t slice = 20;  // steps of one engine before the next has its turn
};

struct StepTimes {  // [step]
  std::vector<double> wall_ms;
  std::vector<double> cpu_ms;  // of all threads; what to compare on a machine that others use too
};

struct Lane {
  const Contestant* contestant;
  // Medians over the repetitions: in each of them an engine makes the same step with the same work,
  // so that a disturbance of the machine in one of them drops out.
  StepTimes times;
  Quality quality;  // after the last step
};

// All engines take turns over the same slices of simulated time, in an order that rotates, so that
// a machine that grows slower or faster does so for all of them.
std::vector<Lane> race(const PeerScene& scene, const std::vector<Contestant>& contestants,
                       const RaceOptions& options);

double mean(const std::vector<double>& values);
double quantile(std::vector<double> values, double q);

}  // namespace skerry::peers
