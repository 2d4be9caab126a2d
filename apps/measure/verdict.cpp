#include "apps/measure/verdict.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/measure/compare.h"

namespace skerry::measure {
namespace {

// Differences below this are not worth a claim, however sure they are: from one run to the next the
// places of worlds in memory alone move a speed-up by 3 %.
constexpr double kLeast = 0.05;

std::string number(double value, int digits) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.*f", digits, value);
  return buffer;
}

std::string load_text(double host_ms) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g ms", host_ms);
  return buffer;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

bool told_apart(const Estimate& a, const Estimate& b) {
  return !overlap(a, b) && std::abs(a.value - b.value) > kLeast * std::min(a.value, b.value);
}

// ---- steps

std::string about_hashes(const SceneComparison& comparison) {
  for (const ThroughputRow& row : comparison.throughput) {
    if (!row.difference) continue;
    return row.strategy.label + " DIFFERS from serial, first at step " +
           std::to_string(row.difference->step) + " (" + row.difference->where +
           "): its figures do not count.";
  }
  if (comparison.frame_difference) {
    return comparison.frame_difference_row +
           " DIFFERS from serial in the frame loop, seen at step " +
           std::to_string(comparison.frame_difference->step) + " (" +
           comparison.frame_difference->where + "): its figures do not count.";
  }
  return "All rows made the same bits at every step.";
}

std::string speed_up_text(const Estimate& speed_up) {
  return number(speed_up.value, 2) + " times serial (95 % interval " + number(speed_up.low, 2) +
         " to " + number(speed_up.high, 2) + ")";
}

const ThroughputRow* fastest(const SceneComparison& comparison, bool others) {
  const ThroughputRow* best = nullptr;
  for (const ThroughputRow& row : comparison.throughput) {
    const bool other = row.strategy.scheduler != schedulers::OtherScheduler::none;
    if (other == others && (!best || row.speed_up.value > best->speed_up.value)) best = &row;
  }
  return best;
}

std::string about_throughput(const SceneComparison& comparison) {
  const ThroughputRow& best = *fastest(comparison, false);
  if (best.speed_up.low < 1 + kLeast) {
    const std::string none = "No mode steps faster than serial beyond noise";
    if (best.strategy.mode == ThreadingMode::serial) return none + ".";
    return none + ": the best, " + best.strategy.label + ", makes " + speed_up_text(best.speed_up) +
           ".";
  }
  std::vector<std::string> names = {best.strategy.label};
  for (const ThroughputRow& row : comparison.throughput) {
    const bool own = row.strategy.scheduler == schedulers::OtherScheduler::none;
    if (own && &row != &best && !told_apart(row.speed_up, best.speed_up)) {
      names.push_back(row.strategy.label);
    }
  }
  std::string text = names.size() == 1 ? names[0] + " steps fastest: "
                                       : joined(names) + " step fastest and cannot be told apart: ";
  text +=
      speed_up_text(best.speed_up) + " with " + std::to_string(best.strategy.workers) + " workers";
  const double allowed = comparison.bound.speed_up(best.strategy.workers);
  if (comparison.bound.work_ms() > 0) text += "; the task graph allows " + number(allowed, 2);
  return text + ".";
}

std::string about_schedulers(const SceneComparison& comparison) {
  const ThroughputRow* other = fastest(comparison, true);
  if (!other) return "";
  const ThroughputRow& own = *fastest(comparison, false);
  const double ratio = own.speed_up.value / other->speed_up.value;
  if (!told_apart(own.speed_up, other->speed_up)) {
    return "Our schedulers and the best of the others (" + other->strategy.label +
           ") cannot be told apart.";
  }
  return ratio > 1 ? "Of the other schedulers the best, " + other->strategy.label + ", takes " +
                         number(100 * (ratio - 1), 0) + " % longer per step than " +
                         own.strategy.label + "."
                   : other->strategy.label + " takes " + number(100 * (1 - ratio), 0) +
                         " % less per step than " + own.strategy.label + ".";
}

// ---- frames

struct Judged {
  const FrameRow* row;
  FrameRate rate;
  Estimate frame, input;  // p95
};

Estimate frame_p95(const FrameRow& row) {
  return bootstrap_percentile(row.values(&FrameSamples::latency_ms), 0.95);
}

FrameRate rate_of(const FrameRow& row, const Estimate& frame, double dt) {
  if (row.frames() == 0 || row.gave_up || frame.low > 1e3 * dt) return FrameRate::lost;
  return frame.high <= 1e3 * dt ? FrameRate::held : FrameRate::edge;
}

std::vector<Judged> judged(const SceneComparison& comparison, double host_ms) {
  std::vector<Judged> rows;
  for (const FrameRow& row : comparison.frames) {
    if (row.host_ms != host_ms || row.frames() == 0) continue;
    const Estimate frame = frame_p95(row);
    rows.push_back({&row, rate_of(row, frame, comparison.dt), frame,
                    bootstrap_percentile(row.values(&FrameSamples::input_ms), 0.95)});
  }
  return rows;
}

std::vector<Judged> with_rate(const std::vector<Judged>& rows, FrameRate rate) {
  std::vector<Judged> chosen;
  for (const Judged& row : rows) {
    if (row.rate == rate) chosen.push_back(row);
  }
  return chosen;
}

std::vector<std::string> labels(const std::vector<Judged>& rows) {
  std::vector<std::string> names;
  for (const Judged& row : rows) names.push_back(row.row->strategy.label);
  return names;
}

template <class Figure>
const Judged& least_of(const std::vector<Judged>& rows, const Figure& figure) {
  return *std::min_element(rows.begin(), rows.end(),
                           [&](const Judged& a, const Judged& b) { return figure(a) < figure(b); });
}

LoadVerdict judge(const SceneComparison& comparison, double host_ms) {
  LoadVerdict verdict = {.host_ms = host_ms};
  const std::vector<Judged> all = judged(comparison, host_ms);
  verdict.modes = all.size();
  if (all.empty()) return verdict;
  const std::vector<Judged> holding = with_rate(all, FrameRate::held);
  const std::vector<Judged> edge = with_rate(all, FrameRate::edge);
  verdict.holding = labels(holding);
  verdict.edge = labels(edge);
  std::vector<Judged> rows = holding.empty() ? edge : holding;
  if (rows.empty()) {
    const Judged& least = least_of(all, [](const Judged& j) { return j.row->missed_share(); });
    verdict.best = {least.row->strategy.label};
    verdict.input_ms = least.input.value;
    verdict.best_frame_ms = least.frame.value;
    return verdict;
  }
  std::sort(rows.begin(), rows.end(),
            [](const Judged& a, const Judged& b) { return a.input.value < b.input.value; });
  const Judged& best = rows.front();
  for (const Judged& row : rows) {
    if (!told_apart(row.input, best.input)) verdict.best.push_back(row.row->strategy.label);
  }
  verdict.input_ms = best.input.value;
  verdict.best_frame_ms = best.frame.value;
  const Judged& shortest = least_of(rows, [](const Judged& j) { return j.frame.value; });
  if (&shortest != &best && told_apart(shortest.frame, best.frame)) {
    verdict.shortest = shortest.row->strategy.label;
    verdict.shortest_frame_ms = shortest.frame.value;
    verdict.shortest_input_ms = shortest.input.value;
  }
  if (holding.empty() || edge.empty()) return verdict;
  const Judged& sooner = least_of(edge, [](const Judged& j) { return j.input.value; });
  if (sooner.input.value < best.input.value && told_apart(sooner.input, best.input)) {
    verdict.sooner = sooner.row->strategy.label;
    verdict.sooner_input_ms = sooner.input.value;
  }
  return verdict;
}

std::string holders(const LoadVerdict& verdict, const std::string& rate) {
  if (verdict.holding.size() == verdict.modes) return "every mode holds " + rate;
  std::string edge = joined(verdict.edge);
  if (!edge.empty()) edge += verdict.edge.size() == 1 ? " is at its edge" : " are at its edge";
  if (verdict.holding.empty()) return "no mode surely holds " + rate + ", " + edge;
  const bool alone = verdict.holding.size() == 1 && edge.empty();
  return joined(verdict.holding) +
         (alone                         ? " alone holds "
          : verdict.holding.size() == 1 ? " holds "
                                        : " hold ") +
         rate + (edge.empty() ? "" : ", " + edge);
}

std::string sentence(const LoadVerdict& verdict, const std::string& rate) {
  std::string text = "With " + load_text(verdict.host_ms) + " of host work ";
  if (verdict.holding.empty() && verdict.edge.empty()) {
    return text + "no mode holds " + rate + "; " + verdict.best.front() + " misses least.";
  }
  text += holders(verdict, rate) + ". Use " + verdict.best.front();
  if (verdict.best.size() > 1) {
    const std::vector<std::string> rest(verdict.best.begin() + 1, verdict.best.end());
    text += " (or " + joined(rest) + ": not told apart)";
  }
  text += ": input is visible after " + number(verdict.input_ms, 1) + " ms (p95)";
  if (verdict.shortest) {
    text += ". If the main thread needs the time: " + *verdict.shortest + " ends its frames in " +
            number(verdict.shortest_frame_ms, 1) + " ms instead of " +
            number(verdict.best_frame_ms, 1) + ", and shows input after " +
            number(verdict.shortest_input_ms, 1) + " ms";
  }
  if (verdict.sooner) {
    text += ". " + *verdict.sooner + " would show input after " +
            number(verdict.sooner_input_ms, 1) + " ms";
  }
  return text + ".";
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Where a mode stops holding the rate, and where the mode to use changes.
std::vector<std::string> crossovers(const std::vector<LoadVerdict>& verdicts,
                                    const std::string& rate) {
  std::vector<std::string> sentences;
  for (std::size_t i = 0; i + 1 < verdicts.size(); ++i) {
    const LoadVerdict& low = verdicts[i];
    const LoadVerdict& high = verdicts[i + 1];
    if (low.best.empty() || high.best.empty()) continue;
    const std::string between =
        "Between " + load_text(low.host_ms) + " and " + load_text(high.host_ms) + " ";
    std::vector<std::string> lost;
    for (const auto* names : {&low.holding, &low.edge}) {
      for (const std::string& name : *names) {
        if (!contains(high.holding, name) && !contains(high.edge, name)) lost.push_back(name);
      }
    }
    if (!lost.empty()) {
      sentences.push_back(between + joined(lost) + (lost.size() == 1 ? " stops" : " stop") +
                          " holding " + rate + ".");
    }
    const bool changed =
        std::none_of(high.best.begin(), high.best.end(),
                     [&](const std::string& name) { return contains(low.best, name); });
    if (changed && !high.holding.empty()) {
      sentences.push_back(between + "the choice changes from " + low.best.front() + " to " +
                          high.best.front() + ".");
    }
  }
  return sentences;
}

std::string about_noise(const SceneComparison& comparison) {
  const RepetitionCount& steps = comparison.throughput_reps;
  const RepetitionCount& frames = comparison.frame_reps;
  const int disturbed = steps.disturbed + frames.disturbed;
  if (disturbed == 0) return "";
  const bool kept = steps.counted + frames.counted > steps.made + frames.made - disturbed;
  return std::to_string(disturbed) + " of " + std::to_string(steps.made + frames.made) +
         (disturbed == 1 ? " repetitions was" : " repetitions were") +
         " disturbed by other programs or the hypervisor; " +
         (kept ? "too few quiet ones are left to do without them: take the figures with care."
               : "left out.");
}

}  // namespace

FrameRate frame_rate(const FrameRow& row, double dt) { return rate_of(row, frame_p95(row), dt); }

std::vector<LoadVerdict> load_verdicts(const SceneComparison& comparison) {
  std::vector<double> loads;
  for (const FrameRow& row : comparison.frames) {
    if (std::find(loads.begin(), loads.end(), row.host_ms) == loads.end())
      loads.push_back(row.host_ms);
  }
  std::sort(loads.begin(), loads.end());
  std::vector<LoadVerdict> verdicts;
  for (const double load : loads) verdicts.push_back(judge(comparison, load));
  return verdicts;
}

std::vector<std::string> verdict_of(const SceneComparison& comparison) {
  if (comparison.throughput_reps.made == 0) return {"Stopped before one repetition was complete."};
  const std::string rate = number(1 / comparison.dt, 0) + " Hz";
  std::vector<std::string> sentences = {about_hashes(comparison), about_throughput(comparison),
                                        about_schedulers(comparison)};
  const std::vector<LoadVerdict> verdicts = load_verdicts(comparison);
  for (const LoadVerdict& verdict : verdicts) {
    if (verdict.modes > 0) sentences.push_back(sentence(verdict, rate));
  }
  for (const std::string& text : crossovers(verdicts, rate)) sentences.push_back(text);
  sentences.push_back(about_noise(comparison));
  std::erase(sentences, "");
  return sentences;
}

}  // namespace skerry::measure
