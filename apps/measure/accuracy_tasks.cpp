#include "apps/measure/accuracy_tasks.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "apps/measure/session.h"
#include "scenes/catalogue.h"

namespace skerry::measure {
namespace {

constexpr AccuracyTask kTasks[] = {
    {"sim_rolling_xy", 1e-3, "(m/s)^2", "Bullet 5.7e-9, RaiSim 4.1e-7, MuJoCo 2.4e-3, ODE 3.145"},
    {"sim_rolling_y", 1e-3, "(m/s)^2", "Bullet 4.9e-9, ODE 7.7e-9, RaiSim 4.1e-7, DART 0.426"},
    {"sim_bouncing", 1e-2, "% rms", "RaiSim 0.057, ODE 0.57, Bullet 11.3, DART 11.3"},
    {"sim_bouncing", 1e-3, "% rms", "RaiSim 5.7e-4, ODE 0.057, DART 1.12, Bullet 1.14"},
    {"sim_666", 1e-2, "m^2", "RaiSim 0.0153, ODE 0.0162, MuJoCo 0.93, Bullet 37"},
    {"sim_666", 1e-3, "m^2", "RaiSim 1.35e-4, ODE 1.57e-4, DART 2.8e-4, MuJoCo 0.095"},
    {"sim_666_elastic", 1e-2, "% rms", "RaiSim 6.6, ODE 8.5, Bullet 9.1, DART 329"},
    {"sim_666_elastic", 4e-3, "% rms", "RaiSim 0.047, ODE 0.12, Bullet 2.7, DART 7.5"},
    {"sim_666_elastic", 1e-3, "% rms", "RaiSim 0.0084, ODE 0.031, Bullet 0.59, DART 1.7"},
    {"sim_boxes", 1e-3, "of |L|", "Simbody 1.9e-3, Bullet 3.6e-3, ODE 3.8e-3, DART 0.64"},
    {"sim_kapla", 1e-2, "steps", "RaiSim 54839 and Bullet 55058 at 1000 iterations, ODE 6453"},
};

double energy_of(const Measures& m) { return m.kinetic_energy + m.potential_energy; }

Vec3 vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

// One task's measure, step by step.
class Judge {
 public:
  Judge(const AccuracyTask& task, World& world, std::span<const BodyId> bodies)
      : name_(task.scene), world_(world), bodies_(bodies), start_(world.measure()) {}

  void judge() {
    ++steps_;
    if (name_.starts_with("sim_rolling")) {
      sum_ += rolling_error();
    } else if (name_ == "sim_666") {
      sum_ += squared_overlaps();
    } else if (name_ == "sim_boxes") {
      const Vec3 before = vector(start_.angular_momentum);
      // About the centre of mass; it started at the origin.
      const Vec3 now = world_.angular_momentum(bodies_[0]);
      sum_ = std::max(sum_, (now - before).norm() / before.norm());
    } else if (name_ != "sim_kapla") {
      const double error = energy_of(world_.measure()) / energy_of(start_) - 1;
      sum_ += error * error;
    }
  }
  bool over() const { return name_ == "sim_kapla" && world_.pose(bodies_.back()).position.y() < 1; }
  double error() const {
    const double mean = sum_ / static_cast<double>(std::max<std::uint64_t>(1, steps_));
    if (name_ == "sim_kapla") return static_cast<double>(steps_);
    if (name_ == "sim_boxes") return sum_;
    if (name_ == "sim_bouncing" || name_ == "sim_666_elastic") return 100 * std::sqrt(mean);
    return mean;
  }

 private:
  // The plate is pulled by 150 N and slows by friction under it; balls roll at 2/7 of it.
  double rolling_error() const {
    constexpr double kG = 9.81, kPlate = 10, kBalls = 25;
    const double friction = 0.4 * (kPlate + kBalls) * kG;
    const double a = (150 - friction) / (kPlate + kBalls * 2.0 / 7);
    const Vec3 along = name_ == "sim_rolling_y" ? Vec3(0, 0, 1) : Vec3(0.5, 0, std::sqrt(0.75));
    const Vec3 plate = a * world_.time() * along, ball = 2.0 / 7 * plate;
    double sum = 0;
    for (std::size_t i = 2; i < bodies_.size(); ++i)
      sum += (world_.linear_velocity(bodies_[i]) - ball).squaredNorm();
    return (world_.linear_velocity(bodies_[1]) - plate).squaredNorm() + sum / kBalls;
  }

  double squared_overlaps() const {
    constexpr double kRadius = 0.1;
    const auto all = world_.transforms();
    double sum = 0;
    const auto add = [&sum](double depth) { sum += depth > 0 ? depth * depth : 0; };
    for (std::size_t i = 1; i < all.size(); ++i) {
      add(kRadius - all[i].position.y());
      for (std::size_t k = i + 1; k < all.size(); ++k)
        add(2 * kRadius - (all[i].position - all[k].position).norm());
    }
    return sum;
  }

  std::string_view name_;
  World& world_;
  std::span<const BodyId> bodies_;
  Measures start_;
  double sum_ = 0;
  std::uint64_t steps_ = 0;
};

}  // namespace

std::span<const AccuracyTask> accuracy_tasks() { return kTasks; }

AccuracyResult run_accuracy_task(const AccuracyTask& task, SolverKind solver, std::uint64_t steps) {
  const scenes::SceneDesc scene = scenes::make_scene(task.scene);
  WorldSettings settings = scenes::world_settings(scene);
  settings.solver.kind = solver;
  Session session(scene, settings, task.dt);
  World& world = session.world();
  const std::vector<BodyId> bodies(world.bodies().begin(), world.bodies().end());
  Judge judge(task, world, bodies);
  const double seconds = scene.defaults.dt * static_cast<double>(scene.defaults.steps);
  const auto all = static_cast<std::uint64_t>(std::llround(seconds / task.dt));
  const std::uint64_t count = steps == 0 ? all : std::min(steps, all);
  AccuracyResult result;
  std::uint64_t made = 0;
  while (made < count && !judge.over()) {
    result.step_ms += session.advance().step_ms;
    ++made;
    judge.judge();
  }
  result.error = judge.error();
  result.step_ms /= static_cast<double>(std::max<std::uint64_t>(1, made));
  return result;
}

}  // namespace skerry::measure
