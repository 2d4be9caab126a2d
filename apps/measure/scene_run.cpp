#include "apps/measure/scene_run.h"

#include <algorithm>
#include <map>

#include "apps/measure/process_meter.h"

namespace skerry::measure {
namespace {

// Adds up what the steps say; the meters stand still while this class works.
class Recorder {
 public:
  Recorder(const RunOptions& options, RunResult& result) : options_(options), result_(result) {
    result_.step_ms.reserve(std::min<std::uint64_t>(options.steps, 1 << 20));
  }

  void before_step() {
    cpu_before_ = cpu_ms();
    allocations_before_ = allocation_count();
  }

  void after_step(const StepReport& report, World& world) {
    result_.allocations += allocation_count() - allocations_before_;
    result_.cpu_ms += cpu_ms() - cpu_before_;
    result_.step_ms.push_back(report.step_ms);
    add_stages(report);
    add_warnings(report);
    if (options_.settings.measure_steps) add_measures(report.measures);
    if (options_.hash_every > 0 && report.step % options_.hash_every == 0) {
      result_.hashes.push_back({report.step, world.state_hash()});
    }
    if (options_.keep_tasks) {
      const auto tasks = world.last_tasks();
      const auto step_ns = static_cast<std::int64_t>(1e6 * report.step_ms);
      result_.tasks.push_back(
          {report.step, report.begin_ns, report.begin_ns + step_ns, {tasks.begin(), tasks.end()}});
    }
  }

  void add_warnings(const StepReport& report) {
    for (const std::string& warning : report.warnings) ++warnings_[warning];
  }

  void finish() {
    const auto steps = static_cast<double>(std::max<std::size_t>(1, result_.step_ms.size()));
    for (StageMean& stage : result_.stages) stage.wall_ms /= steps;
    finish_measures();
    for (const auto& [text, times] : warnings_) {
      result_.warnings.push_back(times == 1 ? text
                                            : text + " (" + std::to_string(times) + " times)");
    }
  }

 private:
  void add_measures(const Measures& step) {
    RunMeasures& sum = result_.measured;
    const double energy = step.kinetic_energy + step.potential_energy;
    if (sum.steps++ == 0) sum.energy_first = energy;
    sum.energy_last = energy;
    sum.energy_lost += step.contacts.energy_lost;
    sum.penetration_mean += step.penetration_mean;
    sum.penetration_max = std::max(sum.penetration_max, step.penetration_max);
    const ContactLaw& law = step.contacts.law;
    if (law.manifolds == 0) return;
    ++sum.law_steps;
    sum.law.manifolds += law.manifolds;
    sum.law.impulse_mean += law.impulse_mean;
    sum.law.pull_max = std::max(sum.law.pull_max, law.pull_max);
    sum.law.cone_mean += law.cone_mean;
    sum.law.cone_max = std::max(sum.law.cone_max, law.cone_max);
    sum.law.normal_mean += law.normal_mean;
    sum.law.normal_max = std::max(sum.law.normal_max, law.normal_max);
    sum.law.friction_mean += law.friction_mean;
    sum.law.friction_max = std::max(sum.law.friction_max, law.friction_max);
  }

  void finish_measures() {
    RunMeasures& sum = result_.measured;
    if (sum.steps > 0) sum.penetration_mean /= static_cast<double>(sum.steps);
    if (sum.law_steps == 0) return;
    sum.law.manifolds /= sum.law_steps;
    for (double* part : {&sum.law.impulse_mean, &sum.law.cone_mean, &sum.law.normal_mean,
                         &sum.law.friction_mean}) {
      *part /= static_cast<double>(sum.law_steps);
    }
  }

  void add_stages(const StepReport& report) {
    const auto stages = report.stages();
    if (result_.stages.empty()) {
      for (const StageTime& stage : stages) result_.stages.push_back({stage.name, 0});
    }
    const std::size_t count = std::min(result_.stages.size(), stages.size());
    for (std::size_t i = 0; i < count; ++i) result_.stages[i].wall_ms += stages[i].wall_ms;
  }

  const RunOptions& options_;
  RunResult& result_;
  std::map<std::string, std::uint64_t> warnings_;
  double cpu_before_ = 0;
  std::uint64_t allocations_before_ = 0;
};

}  // namespace

RunResult run_scene(const scenes::SceneDesc& scene, const RunOptions& options,
                    const Watcher& watcher) {
  RunResult result;
  Session session(scene, options.settings, options.dt);
  Recorder recorder(options, result);
  const auto total = static_cast<double>(options.warmup + options.steps);
  for (std::uint64_t i = 0; i < options.warmup + options.steps; ++i) {
    if (watcher.stopped()) {
      result.interrupted = true;
      break;
    }
    if (i < options.warmup) {
      recorder.add_warnings(session.advance());
    } else {
      recorder.before_step();
      const StepReport report = session.advance();
      recorder.after_step(report, session.world());
    }
    watcher.report(static_cast<double>(i + 1) / total, i < options.warmup ? "warmup" : "steps");
  }
  recorder.finish();
  result.last = session.world().last_report();
  result.bodies = session.world().body_count();
  result.measures = session.world().measure();
  result.state_hash = session.world().state_hash();
  return result;
}

}  // namespace skerry::measure
