#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>

#include "apps/measure/compare_parts.h"
#include "apps/measure/process_meter.h"

namespace skerry::measure {
namespace {

// What one row has gathered in one repetition.
struct RowRep {
  std::vector<double> step_ms;
  double cpu_ms = 0, idle_ms = 0, blocked_ms = 0, peak_mb = 0;
  double switches = 0, forced_switches = 0;
  std::uint64_t allocations = 0;
  std::vector<StageMeans> stages;  // sums
};

constexpr int kIdleMs = 100;

class Throughput {
 public:
  Throughput(const scenes::SceneDesc& scene, const CompareOptions& options, SceneComparison& result)
      : scene_(scene), options_(options), result_(result) {
    std::vector<Strategy> rows = strategies(options.axes);
    if (options.other_schedulers) {
      for (const Strategy& row : other_schedulers(options.axes)) rows.push_back(row);
    }
    for (const Strategy& row : rows) result.throughput.push_back({.strategy = row});
    reps_.resize(rows.size());
  }

  void run(const Watcher& watcher) {
    const std::size_t rows = reps_.size();
    const std::size_t units = static_cast<std::size_t>(options_.step_reps() + 1) * rows;
    std::size_t unit = 0;
    for (int rep = 0; rep < options_.step_reps(); ++rep) {
      const MachineLoad load;
      for (std::size_t i = 0; i < rows; ++i) {
        // Each row is first, second, ... in turn.
        const std::size_t row = (i + static_cast<std::size_t>(rep)) % rows;
        watcher.report(double(unit++) / double(units), label(row));
        if (!run_row(row, watcher)) return finish();
      }
      disturbed_.push_back(load.disturbing());
      result_.throughput_reps.steal = std::max(result_.throughput_reps.steal, load.steal());
      result_.throughput_reps.others = std::max(result_.throughput_reps.others, load.others());
      ++result_.throughput_reps.made;
    }
    for (std::size_t row = 0; row < rows && !watcher.stopped(); ++row) {
      watcher.report(double(unit++) / double(units), label(row) + ", analysis");
      analyse(row, watcher);
    }
    finish();
  }

 private:
  std::string label(std::size_t row) const {
    return "steps, " + result_.throughput[row].strategy.label;
  }

  WorldSettings base(bool record_tasks = false) const {
    WorldSettings settings = base_settings(scene_, options_, result_.dt);
    settings.record_tasks = record_tasks;
    return settings;
  }

  // False if it was stopped: the repetition then does not count.
  bool run_row(std::size_t index, const Watcher& watcher) {
    ThroughputRow& row = result_.throughput[index];
    forget_peak_rss();
    const double rss_before = rss_mb();
    Session session(scene_, base(), result_.dt, row.strategy);
    for (std::uint64_t step = 0; step < options_.warmup; ++step) {
      if (watcher.stopped()) return false;
      session.advance();
      check_hash(session.world(), row);
    }
    RowRep rep;
    for (std::uint64_t step = 0; step < options_.steps; ++step) {
      if (watcher.stopped()) return false;
      time_step(session, rep);
      check_hash(session.world(), row);
    }
    rep.peak_mb = peak_rss_mb() - rss_before;
    row.state_hash = session.world().state_hash();
    row.rep_ms.push_back(mean(rep.step_ms));
    reps_[index].push_back(std::move(rep));
    describe(session.world());
    return true;
  }

  static void time_step(Session& session, RowRep& rep) {
    const ContextSwitches switches_before = context_switches();
    const double cpu_before = cpu_ms();
    const std::uint64_t allocations_before = allocation_count();
    const StepReport report = session.advance();
    rep.allocations += allocation_count() - allocations_before;
    rep.cpu_ms += cpu_ms() - cpu_before;
    const ContextSwitches switches = context_switches();
    rep.switches += static_cast<double>(switches.voluntary - switches_before.voluntary);
    rep.forced_switches += static_cast<double>(switches.involuntary - switches_before.involuntary);
    rep.step_ms.push_back(report.step_ms);
    rep.idle_ms += report.idle_ms;
    rep.blocked_ms += report.blocked_ms;
    const auto stages = report.stages();
    rep.stages.resize(stages.size());
    for (std::size_t i = 0; i < stages.size(); ++i) {
      rep.stages[i].name = stages[i].name;
      rep.stages[i].wall_ms += stages[i].wall_ms;
      rep.stages[i].cpu_ms += stages[i].cpu_ms;
      rep.stages[i].tasks += stages[i].tasks;
    }
  }

  // The first serial run writes the reference, every other run is held against it.
  void check_hash(World& world, ThroughputRow& row) {
    const std::uint64_t step = world.step_count();
    const std::uint64_t hash = world.state_hash();
    if (step > reference_.size()) {
      reference_.push_back(hash);
    } else if (reference_[step - 1] != hash && !row.difference) {
      Session serial(scene_, base(), result_.dt, result_.throughput[0].strategy);
      serial.advance_to(step);
      row.difference = {step, first_difference(world, serial.world())};
    }
  }

  // Tasks of the same steps, then the world left alone.
  void analyse(std::size_t index, const Watcher& watcher) {
    ThroughputRow& row = result_.throughput[index];
    Session session(scene_, base(true), result_.dt, row.strategy);
    std::vector<double> busy(static_cast<std::size_t>(row.strategy.workers), 0.0);
    for (std::uint64_t i = 0; i < options_.warmup + options_.steps; ++i) {
      if (watcher.stopped()) return;
      const StepReport report = session.advance();
      if (i < options_.warmup) continue;
      const auto tasks = session.world().last_tasks();
      const std::vector<double> of_step = busy_ms_by_worker(tasks, row.strategy.workers);
      for (std::size_t w = 0; w < busy.size(); ++w) busy[w] += of_step[w];
      if (index == 0) {
        result_.bound.add(graph_bound(report.stages(), tasks), 1 / double(options_.steps));
      }
    }
    row.imbalance = imbalance(busy);
    // Long enough after the step for whoever spins to have gone to sleep.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const double cpu_before = cpu_ms();
    std::this_thread::sleep_for(std::chrono::milliseconds(kIdleMs));
    row.idle_cpu = (cpu_ms() - cpu_before) / kIdleMs;
  }

  void describe(const World& world) {
    const StepReport& last = world.last_report();
    result_.bodies = world.body_count();
    result_.joints = world.joint_count();
    result_.contacts = last.contacts;
    result_.islands = last.islands;
    result_.largest_island = last.largest_island;
  }

  void finish() {
    // A row of a repetition that was not completed does not count.
    const auto made = static_cast<std::size_t>(result_.throughput_reps.made);
    for (std::size_t row = 0; row < reps_.size(); ++row) {
      reps_[row].resize(made);
      result_.throughput[row].rep_ms.resize(made);
    }
    const std::vector<bool> counts = repetitions_that_count(disturbed_);
    RepetitionCount& count = result_.throughput_reps;
    count.disturbed = static_cast<int>(std::count(disturbed_.begin(), disturbed_.end(), true));
    count.counted = static_cast<int>(std::count(counts.begin(), counts.end(), true));
    for (std::size_t row = 0; row < reps_.size(); ++row) summarize_row(row, counts);
  }

  void summarize_row(std::size_t index, const std::vector<bool>& counts) {
    ThroughputRow& row = result_.throughput[index];
    Repetitions steps, serial_steps;
    double made = 0;
    for (std::size_t rep = 0; rep < counts.size(); ++rep) {
      if (!counts[rep]) continue;
      const RowRep& values = reps_[index][rep];
      steps.push_back(values.step_ms);
      serial_steps.push_back(reps_[0][rep].step_ms);
      made += static_cast<double>(values.step_ms.size());
      add(values, row);
    }
    row.step_ms = summarize(pooled(steps));
    row.typical_ms = bootstrap_typical(steps);
    row.speed_up = bootstrap_ratio(serial_steps, steps);
    if (made > 0) scale(1 / made, row);
  }

  static void add(const RowRep& values, ThroughputRow& row) {
    row.cpu_ms_per_step += values.cpu_ms;
    row.idle_ms_per_step += values.idle_ms;
    row.blocked_ms_per_step += values.blocked_ms;
    row.switches_per_step += values.switches;
    row.forced_switches_per_step += values.forced_switches;
    row.allocations_per_step += static_cast<double>(values.allocations);
    row.peak_mb = std::max(row.peak_mb, values.peak_mb);
    if (row.stages.empty()) {
      row.stages = values.stages;
      return;
    }
    for (std::size_t i = 0; i < row.stages.size(); ++i) {
      row.stages[i].wall_ms += values.stages[i].wall_ms;
      row.stages[i].cpu_ms += values.stages[i].cpu_ms;
      row.stages[i].tasks += values.stages[i].tasks;
    }
  }

  static void scale(double factor, ThroughputRow& row) {
    for (double* sum :
         {&row.cpu_ms_per_step, &row.idle_ms_per_step, &row.blocked_ms_per_step,
          &row.switches_per_step, &row.forced_switches_per_step, &row.allocations_per_step}) {
      *sum *= factor;
    }
    for (StageMeans& stage : row.stages) {
      stage.wall_ms *= factor;
      stage.cpu_ms *= factor;
      stage.tasks *= factor;
    }
  }

  const scenes::SceneDesc& scene_;
  const CompareOptions& options_;
  SceneComparison& result_;
  std::vector<std::vector<RowRep>> reps_;  // [row][repetition]
  std::vector<bool> disturbed_;            // [repetition]
  std::vector<std::uint64_t> reference_;   // [step - 1]
};

}  // namespace

void measure_throughput(const scenes::SceneDesc& scene, const CompareOptions& options,
                        SceneComparison& result, const Watcher& watcher) {
  Throughput(scene, options, result).run(watcher);
}

}  // namespace skerry::measure
