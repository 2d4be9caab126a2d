#include "bench/peers/race.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numeric>
#include <thread>

namespace skerry::peers {
namespace {

struct Runner {
  std::unique_ptr<Engine> engine;
  StepTimes times;
};

double milliseconds(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

void run_slice(Runner& runner, std::uint64_t steps) {
  for (std::uint64_t i = 0; i < steps; ++i) {
    const double cpu = milliseconds(CLOCK_PROCESS_CPUTIME_ID);
    const double wall = milliseconds(CLOCK_MONOTONIC);
    runner.engine->step();
    runner.times.wall_ms.push_back(milliseconds(CLOCK_MONOTONIC) - wall);
    runner.times.cpu_ms.push_back(milliseconds(CLOCK_PROCESS_CPUTIME_ID) - cpu);
  }
}

void show_progress(const PeerScene& scene, const RaceOptions& options, int rep,
                   std::uint64_t done) {
  std::fprintf(stderr, "\r%s: round %d of %d, step %llu of %llu   ", scene.source.name.c_str(),
               rep + 1, options.reps, static_cast<unsigned long long>(done),
               static_cast<unsigned long long>(options.steps));
  if (done == options.steps) std::fputc('\n', stderr);
}

std::vector<Runner> run_once(const PeerScene& scene, const std::vector<Contestant>& contestants,
                             const RaceOptions& options, int rep) {
  std::vector<Runner> runners;
  for (const Contestant& contestant : contestants) {
    runners.push_back({contestant.make(), {}});
    runners.back().engine->build(scene);
  }
  std::size_t first = static_cast<std::size_t>(rep);
  for (std::uint64_t done = 0; done < options.steps; ++first) {
    const std::uint64_t count = std::min(options.slice, options.steps - done);
    for (std::size_t i = 0; i < runners.size(); ++i) {
      run_slice(runners[(first + i) % runners.size()], count);
      // Workers that still wait for more work fall asleep before somebody else is timed.
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    done += count;
    show_progress(scene, options, rep, done);
  }
  return runners;
}

std::vector<double> median_per_step(const std::vector<StepTimes>& reps,
                                    std::vector<double> StepTimes::*clock) {
  std::vector<double> medians;
  for (std::size_t step = 0; step < (reps[0].*clock).size(); ++step) {
    std::vector<double> values;
    for (const StepTimes& rep : reps) values.push_back((rep.*clock)[step]);
    medians.push_back(quantile(values, 0.5));
  }
  return medians;
}

}  // namespace

std::vector<Lane> race(const PeerScene& scene, const std::vector<Contestant>& contestants,
                       const RaceOptions& options) {
  std::vector<Lane> lanes;
  for (const Contestant& contestant : contestants) lanes.push_back({&contestant, {}, {}});
  std::vector<std::vector<StepTimes>> times(lanes.size());  // [lane][rep]
  for (int rep = 0; rep < options.reps; ++rep) {
    std::vector<Runner> runners = run_once(scene, contestants, options, rep);
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      times[i].push_back(std::move(runners[i].times));
      if (rep > 0) continue;
      lanes[i].quality = measure_quality(scene, runners[i].engine->states());
    }
  }
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    lanes[i].times = {median_per_step(times[i], &StepTimes::wall_ms),
                      median_per_step(times[i], &StepTimes::cpu_ms)};
  }
  return lanes;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], at - static_cast<double>(below));
}

}  // namespace skerry::peers
