// `skerry compare` with your own game in place of the synthetic host work: replace what Flock does by
// calls of your engine, and get the same tables and report for it.
//   own_host_load [DIRECTORY]
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "apps/measure/compare.h"
#include "apps/report/results.h"
#include "scenes/catalogue.h"

namespace {

using namespace skerry;

// A game whose work is to steer a flock. The amount depends on `ms` alone: 40 passes a millisecond
// was about right where this was written.
class Flock : public measure::HostLoad {
 public:
  // The part that only the main thread may do.
  void run(double ms) override {
    for (int pass = 0; pass < passes(ms); ++pass) steer(0, kBirds);
  }

  // The part that your job system does.
  void run_jobs(double ms, measure::HostPool& pool) override {
    for (int pass = 0; pass < passes(ms); ++pass) {
      pool.parallel_for(kBirds, 256,
                        [this](std::uint32_t begin, std::uint32_t end) { steer(begin, end); });
    }
  }

 private:
  struct Bird {
    double x = 0, y = 0, heading = 0;
  };
  static constexpr std::uint32_t kBirds = 1024;

  static int passes(double ms) { return static_cast<int>(40 * ms); }

  void steer(std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i) {
      Bird& bird = birds_[i];
      bird.heading += 0.01 * std::sin(bird.x - bird.y);
      bird.x += std::cos(bird.heading) / 60;
      bird.y += std::sin(bird.heading) / 60;
    }
  }

  std::vector<Bird> birds_{kBirds};
};

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path directory = argc > 1 ? argv[1] : "own-host-load";
  std::filesystem::create_directories(directory);

  measure::CompareOptions options;
  options.host_ms = {0, 4};
  options.host_shape = measure::HostShape::mixed;
  options.reps = 3;
  Flock flock;
  const measure::SceneComparison comparison =
      measure::compare_scene(scenes::make_scene("tiny"), options, flock);
  for (const std::string& sentence : comparison.verdict) std::printf("* %s\n", sentence.c_str());

  report::Json results = report::begin_results("own_host_load", options);
  report::add(results, comparison);
  report::write_files(directory, results);
  std::printf("wrote %s\n", (directory / "report.html").c_str());
  return comparison.equal() ? 0 : 1;
}
