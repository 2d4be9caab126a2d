// skerry::jobs alone, as the parallel backend of another simulation: gravity between 2000 bodies.
//
// A step is two stages. "pull" sums for each body the pull of all others: it reads every position,
// so it is a stage by itself. "move" advances a body by its own acceleration. Both work body by
// body, and accelerations are partitioned by body; but move writes the positions that pull of other
// bodies reads, so there must be a barrier between the two, and the graph says so by itself. The
// third stage, the energy, follows move body by body with no barrier: a worker that has moved its
// bodies goes on with their energy.
//
// Usage: embed_jobs_only [steps]
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <vector>

#include <skerry/jobs.h>

namespace jobs = skerry::jobs;

namespace {

enum Data : std::uint64_t { positions = 1, velocities = 2, accelerations = 4, energies = 8 };
constexpr jobs::Domain kBody = 1;

struct Vector {
  double x = 0, y = 0, z = 0;
};

struct Galaxy {
  explicit Galaxy(std::uint32_t count)
      : position(count), velocity(count), acceleration(count), energy(count) {
    std::uint64_t seed = 1;
    const auto draw = [&seed] {  // -1..1
      seed = seed * 6364136223846793005u + 1442695040888963407u;
      return double(seed >> 11) * 0x1p-52 - 1;
    };
    for (Vector& p : position) p = {draw(), draw(), draw()};
  }
  std::vector<Vector> position, velocity, acceleration;
  std::vector<double> energy;  // kinetic, by body
  double dt = 1e-3;
};

void pull(void* context, jobs::IndexRange bodies, jobs::Task&) {
  auto& galaxy = *static_cast<Galaxy*>(context);
  for (std::uint32_t i = bodies.begin; i < bodies.end; ++i) {
    const Vector here = galaxy.position[i];
    Vector sum;
    for (const Vector& there : galaxy.position) {
      const Vector d{there.x - here.x, there.y - here.y, there.z - here.z};
      const double square = d.x * d.x + d.y * d.y + d.z * d.z + 1e-4;
      const double factor = 1 / (square * std::sqrt(square));
      sum = {sum.x + d.x * factor, sum.y + d.y * factor, sum.z + d.z * factor};
    }
    const double mass = 1 / double(galaxy.position.size());
    galaxy.acceleration[i] = {sum.x * mass, sum.y * mass, sum.z * mass};
  }
}

void move(void* context, jobs::IndexRange bodies, jobs::Task&) {
  auto& galaxy = *static_cast<Galaxy*>(context);
  for (std::uint32_t i = bodies.begin; i < bodies.end; ++i) {
    Vector &p = galaxy.position[i], &v = galaxy.velocity[i];
    const Vector a = galaxy.acceleration[i];
    v = {v.x + galaxy.dt * a.x, v.y + galaxy.dt * a.y, v.z + galaxy.dt * a.z};
    p = {p.x + galaxy.dt * v.x, p.y + galaxy.dt * v.y, p.z + galaxy.dt * v.z};
  }
}

void kinetic_energy(void* context, jobs::IndexRange bodies, jobs::Task&) {
  auto& galaxy = *static_cast<Galaxy*>(context);
  for (std::uint32_t i = bodies.begin; i < bodies.end; ++i) {
    const Vector v = galaxy.velocity[i];
    galaxy.energy[i] = 0.5 * (v.x * v.x + v.y * v.y + v.z * v.z);
  }
}

std::uint32_t body_count(void* context) {
  return static_cast<std::uint32_t>(static_cast<Galaxy*>(context)->position.size());
}

jobs::TaskGraph describe_step() {
  jobs::TaskGraph step;
  step.partition(kBody, velocities | accelerations | energies);
  const auto stage = [&](const char* name, jobs::Kernel kernel, std::uint64_t reads,
                         std::uint64_t writes) {
    step.stage({.name = name,
                .domain = kBody,
                .kernel = kernel,
                .count = body_count,
                .chunk = 64,
                .reads = reads,
                .writes = writes});
  };
  stage("pull", pull, positions, accelerations);
  stage("move", move, accelerations, positions | velocities);
  stage("kinetic_energy", kinetic_energy, velocities, energies);
  return step;
}

struct Outcome {
  double milliseconds = 0;  // per step
  double checksum = 0;
};

Outcome simulate(jobs::ExecutorKind kind, int steps) {
  const auto executor = jobs::make_executor(kind, {.affinity = jobs::Affinity::spread});
  const jobs::TaskGraph step = describe_step();
  Galaxy galaxy(2000);
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < steps; ++i) executor->run(step, &galaxy);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
  // Summed in the order of the bodies, so that it does not depend on who computed what.
  return {time.count() / steps, std::accumulate(galaxy.energy.begin(), galaxy.energy.end(), 0.0)};
}

}  // namespace

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 20;
  if (steps < 1) {
    std::fprintf(stderr, "usage: %s [steps]\n", argv[0]);
    return 2;
  }
  const jobs::TaskGraph step = describe_step();
  for (std::uint32_t i = 0; i < step.stages().size(); ++i) {
    std::printf("%-15s %s\n", step.stages()[i].name,
                step.follows_per_item(i) ? "follows body by body" : "waits");
  }
  const Outcome serial = simulate(jobs::ExecutorKind::serial, steps);
  const Outcome parallel = simulate(jobs::ExecutorKind::job_system, steps);
  std::printf("serial      %8.3f ms per step   checksum %.17g\n", serial.milliseconds,
              serial.checksum);
  std::printf("job_system  %8.3f ms per step   checksum %.17g   %d workers, %.2f times as fast\n",
              parallel.milliseconds, parallel.checksum, jobs::automatic_worker_count(),
              serial.milliseconds / parallel.milliseconds);
  if (serial.checksum != parallel.checksum) {
    std::fprintf(stderr, "the checksums differ\n");
    return 1;
  }
  return 0;
}
