#include "apps/skerry/compare_table.h"

#include <fmt/core.h>
#include <cstdio>

namespace skerry::app {
namespace {

std::string verdict_word(const measure::ThroughputRow& row) {
  if (!row.difference) return "equal";
  return fmt::format("DIFFERS from step {}: {}", row.difference->step, row.difference->where);
}

void print_throughput(const measure::SceneComparison& comparison) {
  fmt::print("  {:<24} {:>7} {:>9} {:>9} {:>20} {:>9} {:>9}  {}\n", "mode", "workers", "step p50",
             "p99 ms", "speed-up", "CPU ms", "idle ms", "state");
  for (const measure::ThroughputRow& row : comparison.throughput) {
    const std::string speed_up = fmt::format("{:.2f} ({:.2f}-{:.2f})", row.speed_up.value,
                                             row.speed_up.low, row.speed_up.high);
    fmt::print("  {:<24} {:>7} {:>9.3f} {:>9.3f} {:>20} {:>9.3f} {:>9.3f}  {}\n",
               row.strategy.label, row.strategy.workers, row.step_ms.p50, row.step_ms.p99, speed_up,
               row.cpu_ms_per_step, row.idle_ms_per_step, verdict_word(row));
  }
}

double mean_of(const measure::FrameRow& row, std::vector<double> measure::FrameSamples::*member) {
  return measure::mean(measure::pooled(row.values(member)));
}

void print_frame_row(const measure::FrameRow& row) {
  using measure::FrameSamples;
  const auto summary = [&](std::vector<double> FrameSamples::*member) {
    return measure::summarize(measure::pooled(row.values(member)));
  };
  double cpu_ms = 0;
  for (const FrameSamples& rep : row.reps) cpu_ms += rep.cpu_ms;
  const measure::Summary latency = summary(&FrameSamples::latency_ms);
  const double frames = static_cast<double>(std::max<std::uint64_t>(1, row.frames()));
  fmt::print(
      "    {:<32} {:>7.2f} {:>7.2f} {:>7.2f} {:>4.0f} % {:>7.2f} {:>7.2f} {:>7.2f} {:>7.2f} "
      "{:>7.2f}\n",
      row.strategy.label, latency.p50, latency.p95, latency.p99, 100 * row.missed_share(),
      summary(&FrameSamples::input_ms).p95, summary(&FrameSamples::state_age_ms).p50,
      mean_of(row, &FrameSamples::blocked_ms), mean_of(row, &FrameSamples::helped_ms),
      cpu_ms / frames);
}

void print_frames(const measure::SceneComparison& comparison,
                  const std::vector<measure::FrameRow>& rows, const char* title) {
  double host_ms = -1;
  for (const measure::FrameRow& row : rows) {
    if (row.host_ms != host_ms) {
      host_ms = row.host_ms;
      fmt::print("  {:<34} {:>7} {:>7} {:>7} {:>6} {:>7} {:>7} {:>7} {:>7} {:>7}\n",
                 fmt::format("{:.0f} Hz, {:g} ms host work{}", 1 / comparison.dt, host_ms, title),
                 "p50", "p95", "p99 ms", "late", "input", "age", "blocked", "helped", "CPU ms");
    }
    print_frame_row(row);
  }
}

}  // namespace

void print_comparison(const measure::SceneComparison& comparison) {
  fmt::print(
      "\n{}: {} bodies, {} contacts, {} islands (largest {}), {} steps after {}, {} "
      "repetitions, sleeping off\n",
      comparison.scene, comparison.bodies, comparison.contacts, comparison.islands,
      comparison.largest_island, comparison.steps, comparison.warmup,
      comparison.throughput_reps.counted);
  if (comparison.throughput_reps.made > 0) print_throughput(comparison);
  print_frames(comparison, comparison.frames, "");
  print_frames(comparison, comparison.one_at_a_time, ", one setting");
  for (const std::string& sentence : comparison.verdict) fmt::print("  * {}\n", sentence);
  std::fflush(stdout);
}

}  // namespace skerry::app
